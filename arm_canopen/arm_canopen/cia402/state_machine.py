# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The power drive system's state machine from the master's side (CiA 402-2, figure 4, table 28).

Pure functions: which controlword leads from the state that the drive shows towards the one that is
wanted. Bits of the operation mode are added elsewhere.
"""

from __future__ import annotations

from enum import IntEnum

from canopen_core.standard import Controlword, DriveState

_S = DriveState
RESET_PULSE = 0.05  # [s] for which bit 7 of a fault reset is set, and then cleared


class Command(IntEnum):
    """Device control commands as controlwords (CiA 402-2, table 28)."""

    DISABLE_VOLTAGE = 0
    QUICK_STOP = Controlword.ENABLE_VOLTAGE
    SHUTDOWN = Controlword.ENABLE_VOLTAGE | Controlword.QUICK_STOP
    SWITCH_ON = Controlword.ENABLE_VOLTAGE | Controlword.QUICK_STOP | Controlword.SWITCH_ON
    ENABLE_OPERATION = (
        Controlword.ENABLE_VOLTAGE
        | Controlword.QUICK_STOP
        | Controlword.SWITCH_ON
        | Controlword.ENABLE_OPERATION
    )
    FAULT_RESET = Controlword.FAULT_RESET


TARGETS: tuple[DriveState, ...] = (
    _S.SWITCH_ON_DISABLED,
    _S.READY_TO_SWITCH_ON,
    _S.SWITCHED_ON,
    _S.OPERATION_ENABLED,
    _S.QUICK_STOP_ACTIVE,
)
"""States that a master can command; the others the drive enters by itself."""

_UP: dict[DriveState, Command] = {
    _S.SWITCH_ON_DISABLED: Command.SHUTDOWN,  # transition 2
    _S.READY_TO_SWITCH_ON: Command.SWITCH_ON,  # 3
    _S.SWITCHED_ON: Command.ENABLE_OPERATION,  # 4
}
"""The step upwards from each state."""

_HOLD: dict[DriveState, Command] = {
    _S.SWITCH_ON_DISABLED: Command.DISABLE_VOLTAGE,
    _S.READY_TO_SWITCH_ON: Command.SHUTDOWN,
    _S.SWITCHED_ON: Command.SWITCH_ON,
    _S.OPERATION_ENABLED: Command.ENABLE_OPERATION,
    _S.QUICK_STOP_ACTIVE: Command.QUICK_STOP,
}
"""The command that keeps each state."""

_RANK: dict[DriveState, int] = {
    _S.SWITCH_ON_DISABLED: 0,
    _S.READY_TO_SWITCH_ON: 1,
    _S.SWITCHED_ON: 2,
    _S.OPERATION_ENABLED: 3,
}

_UNCONTROLLED = (_S.UNKNOWN, _S.NOT_READY_TO_SWITCH_ON, _S.FAULT_REACTION_ACTIVE, _S.FAULT)


def next_command(state: DriveState, target: DriveState) -> Command:
    """Return the command that leads from a state towards one of :data:`TARGETS`.

    By the shortest way. In a fault, and where the drive goes on by itself, it is DISABLE_VOLTAGE:
    a fault is never left as a side effect of wanting another state, only by an explicit reset.
    """
    if target not in TARGETS:
        raise ValueError(f'{target.title} cannot be commanded; possible: {TARGETS}')
    if state in _UNCONTROLLED:
        return Command.DISABLE_VOLTAGE
    if state is target:
        return _HOLD[target]
    if target is _S.QUICK_STOP_ACTIVE:
        # only Operation Enabled leads there (11); from below, a quick stop is Switch On Disabled
        return Command.QUICK_STOP if state is _S.OPERATION_ENABLED else Command.DISABLE_VOLTAGE
    if state is _S.QUICK_STOP_ACTIVE:
        # 16 back to Operation Enabled, else 12; the way to any other state begins at the bottom
        enable = target is _S.OPERATION_ENABLED
        return Command.ENABLE_OPERATION if enable else Command.DISABLE_VOLTAGE
    if _RANK[state] < _RANK[target]:
        return _UP[state]
    return _HOLD[target]  # transitions 5 to 10 lead down directly


def fault_reset(state: DriveState, elapsed: float) -> int:
    """Return the controlword that resets a fault by its rising edge, again and again.

    Each level lasts long enough for a drive that looks at the controlword less often than the
    master sends it; ``elapsed`` is the time since the first in [s].
    """
    if state is not DriveState.FAULT or int(elapsed / RESET_PULSE) % 2:
        return Command.DISABLE_VOLTAGE
    return Command.FAULT_RESET

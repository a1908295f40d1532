# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The power drive system's state machine from the master's side (CiA 402-2, figure 4, table 28).

One table gives the command that leads from the displayed state towards the wanted one.
Bits of the operation mode are added elsewhere. :class:`ControlwordOutput` sends the result by
RPDO, or by SDO while the RPDO is suspended.
"""

from __future__ import annotations

from enum import IntEnum

from canopen_core.standard import Controlword, DriveState

from ..master.process_image import SentRpdo
from ..master.remote_node import RemoteNode

_S = DriveState
RESET_PULSE = 0.05  # [s] shortest time for which bit 7 of a fault reset is set, and then cleared


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

_OFF, _STOP, _DOWN, _ON, _RUN = (
    Command.DISABLE_VOLTAGE,
    Command.QUICK_STOP,
    Command.SHUTDOWN,
    Command.SWITCH_ON,
    Command.ENABLE_OPERATION,
)

COMMANDS: dict[DriveState, tuple[Command, ...]] = {
    # a column for each of TARGETS; transitions of figure 4 in brackets, none where it stays
    _S.SWITCH_ON_DISABLED: (_OFF, _DOWN, _DOWN, _DOWN, _OFF),  # (2) upwards
    _S.READY_TO_SWITCH_ON: (_OFF, _DOWN, _ON, _ON, _OFF),  # (7), (3)
    _S.SWITCHED_ON: (_OFF, _DOWN, _ON, _RUN, _OFF),  # (10), (6), (4)
    _S.OPERATION_ENABLED: (_OFF, _DOWN, _ON, _RUN, _STOP),  # (9), (8), (5), (11)
    _S.QUICK_STOP_ACTIVE: (_OFF, _OFF, _OFF, _RUN, _STOP),  # (12), (16); other ways begin below
}
"""What leads from a state to each target by the shortest way.

From below Operation Enabled a quick stop is Switch On Disabled. States that are not here the drive
leaves by itself, and a fault only by an explicit reset: they get DISABLE_VOLTAGE.
"""

_COMMANDS = {
    (state, target): command
    for state, row in COMMANDS.items()
    for target, command in zip(TARGETS, row, strict=True)
}


def next_command(state: DriveState, target: DriveState) -> Command:
    """Return the command that leads from a state towards one of :data:`TARGETS`."""
    if target not in TARGETS:
        raise ValueError(f'{target.title} cannot be commanded; possible: {TARGETS}')
    return _COMMANDS.get((state, target), Command.DISABLE_VOLTAGE)


def fault_reset(state: DriveState, elapsed: float, period: float = 0.0) -> int:
    """Return the controlword of a fault reset: a rising edge of bit 7, repeated.

    Each level lasts at least two SYNC periods (``period`` in [s]), and long enough for drives that
    read the controlword less often; ``elapsed`` is the time since the first one in [s].
    """
    pulse = max(RESET_PULSE, 2.0 * period)
    if state is not DriveState.FAULT or int(elapsed / pulse) % 2:
        return Command.DISABLE_VOLTAGE
    return Command.FAULT_RESET


class ControlwordOutput:
    """The controlword of one axis, and the RPDOs that carry it."""

    def __init__(self, node: RemoteNode, index: int) -> None:
        self.writer = node.objects.writer(index)  # by SDO where no RPDO carries it
        self.outputs: list[SentRpdo] = [
            output
            for output in node.image.rpdos
            if any(mapped.index == index for mapped in output.config.mapping)
        ]

    @property
    def kept_back(self) -> bool:
        """Whether an RPDO with the controlword is suspended, for this axis or another one."""
        for output in self.outputs:  # noqa: SIM110  # in every cycle: half of what any() costs
            if output.kept_back_by:
                return True
        return False

    @property
    def keeps_back(self) -> bool:
        """Whether an RPDO is suspended for this axis."""
        return any(self in output.kept_back_by for output in self.outputs)

    def keep_back(self) -> None:
        """Suspend every RPDO that carries the controlword of this axis."""
        for output in self.outputs:
            output.kept_back_by.add(self)

    def send_again(self) -> None:
        """Resume these RPDOs, except those suspended for another axis."""
        for output in self.outputs:
            output.kept_back_by.discard(self)

    def can_send(self, controlword: int) -> bool:
        """Set the controlword, and return whether the RPDOs that carry it can be sent with it."""
        try:
            self.writer.write(controlword)
            for output in self.outputs:
                output.frame()
        except Exception:  # noqa: BLE001  # whatever made the cycle fail may last
            return False
        return True

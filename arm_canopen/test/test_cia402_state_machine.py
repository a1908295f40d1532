# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state machine against a table of the standard's transitions that the code does not share."""

from __future__ import annotations

from itertools import pairwise

import pytest

from arm_canopen import DriveState
from arm_canopen.cia402.state_machine import (
    Command,
    fault_reset,
    next_command,
    TARGETS,
)
from canopen_core.standard import drive_state

S = DriveState

# CiA 402-2, table 28: command bits 7, 3, 2, 1, 0 of the controlword; None is "does not matter"
PATTERNS: dict[str, tuple[int | None, ...]] = {
    'shutdown': (0, None, 1, 1, 0),
    'switch on': (0, 0, 1, 1, 1),
    'enable operation': (0, 1, 1, 1, 1),
    'disable voltage': (0, None, None, 0, None),
    'quick stop': (0, None, 0, 1, None),
}

# CiA 402-2, figure 4: state, command, next state; the numbers are those of the transitions
TRANSITIONS: dict[tuple[DriveState, str], DriveState] = {
    (S.SWITCH_ON_DISABLED, 'shutdown'): S.READY_TO_SWITCH_ON,  # 2
    (S.READY_TO_SWITCH_ON, 'switch on'): S.SWITCHED_ON,  # 3
    (S.SWITCHED_ON, 'enable operation'): S.OPERATION_ENABLED,  # 4
    (S.OPERATION_ENABLED, 'switch on'): S.SWITCHED_ON,  # 5
    (S.SWITCHED_ON, 'shutdown'): S.READY_TO_SWITCH_ON,  # 6
    (S.READY_TO_SWITCH_ON, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 7
    (S.READY_TO_SWITCH_ON, 'quick stop'): S.SWITCH_ON_DISABLED,  # 7
    (S.OPERATION_ENABLED, 'shutdown'): S.READY_TO_SWITCH_ON,  # 8
    (S.OPERATION_ENABLED, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 9
    (S.SWITCHED_ON, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 10
    (S.SWITCHED_ON, 'quick stop'): S.SWITCH_ON_DISABLED,  # 10
    (S.OPERATION_ENABLED, 'quick stop'): S.QUICK_STOP_ACTIVE,  # 11
    (S.QUICK_STOP_ACTIVE, 'disable voltage'): S.SWITCH_ON_DISABLED,  # 12
    (S.QUICK_STOP_ACTIVE, 'enable operation'): S.OPERATION_ENABLED,  # 16
}

AUTOMATIC: dict[DriveState, DriveState] = {
    S.NOT_READY_TO_SWITCH_ON: S.SWITCH_ON_DISABLED,  # 1
    S.FAULT_REACTION_ACTIVE: S.FAULT,  # 14
}

# CiA 402-2, table 31: bits 6, 5, 3, 2, 1, 0 of the statusword
STATUS_BITS: dict[tuple[int, int | None, int, int, int, int], DriveState] = {
    (0, None, 0, 0, 0, 0): S.NOT_READY_TO_SWITCH_ON,
    (1, None, 0, 0, 0, 0): S.SWITCH_ON_DISABLED,
    (0, 1, 0, 0, 0, 1): S.READY_TO_SWITCH_ON,
    (0, 1, 0, 0, 1, 1): S.SWITCHED_ON,
    (0, 1, 0, 1, 1, 1): S.OPERATION_ENABLED,
    (0, 0, 0, 1, 1, 1): S.QUICK_STOP_ACTIVE,
    (0, None, 1, 1, 1, 1): S.FAULT_REACTION_ACTIVE,
    (0, None, 1, 0, 0, 0): S.FAULT,
}

REAL_STATES = [state for state in S if state is not S.UNKNOWN]


def command_of(word: int) -> str:
    """Name the command of a controlword by the table of the standard."""
    bits = tuple(word >> bit & 1 for bit in (7, 3, 2, 1, 0))
    names = [
        name
        for name, pattern in PATTERNS.items()
        if all(want is None or want == bit for want, bit in zip(pattern, bits, strict=True))
    ]
    assert len(names) == 1, f'0x{word:02X} is {names}'
    return names[0]


def after(state: DriveState, word: int) -> DriveState:
    """Return the state that a drive takes when it gets a controlword."""
    if state in AUTOMATIC:
        return AUTOMATIC[state]
    if state is S.FAULT:
        return S.FAULT  # a reset needs a rising edge, which is no command of the table
    return TRANSITIONS.get((state, command_of(word)), state)


@pytest.mark.parametrize('target', TARGETS, ids=lambda state: state.name)
@pytest.mark.parametrize('start', REAL_STATES, ids=lambda state: state.name)
def test_every_state_is_led_to_every_target(start: DriveState, target: DriveState) -> None:
    """The way ends at the target; a fault is only left by a reset, a quick stop ends below."""
    path = [start]
    for _ in range(8):
        path.append(after(path[-1], next_command(path[-1], target)))
    if S.FAULT in path:
        assert path[-1] is S.FAULT
    elif target is S.QUICK_STOP_ACTIVE and start not in (S.OPERATION_ENABLED, target):
        assert path[-1] is S.SWITCH_ON_DISABLED
    else:
        assert path[-1] is target
    if target is not S.OPERATION_ENABLED:
        assert S.OPERATION_ENABLED not in path[1:], 'enabled on the way to something else'


@pytest.mark.parametrize('target', TARGETS, ids=lambda state: state.name)
def test_unknown_state_gets_no_power(target: DriveState) -> None:
    """A statusword that the standard does not know is answered with Disable voltage."""
    assert next_command(S.UNKNOWN, target) is Command.DISABLE_VOLTAGE


def test_a_target_that_is_held_stays() -> None:
    """In each target the command of that target changes nothing."""
    for target in TARGETS:
        assert after(target, next_command(target, target)) is target


@pytest.mark.parametrize('target', [state for state in S if state not in TARGETS])
def test_states_that_a_drive_enters_by_itself_are_no_targets(target: DriveState) -> None:
    """Asking for a fault, or for the start-up states, is a mistake of the program."""
    with pytest.raises(ValueError, match='cannot be commanded'):
        next_command(S.SWITCHED_ON, target)


def test_every_statusword_decodes_as_the_standard_says() -> None:
    """All 65,536 words give the state of the table, or UNKNOWN where no row fits."""
    rows: dict[tuple[int, ...], DriveState] = {
        (b6, b5, b3, b2, b1, b0): state
        for (b6, five, b3, b2, b1, b0), state in STATUS_BITS.items()
        for b5 in ((0, 1) if five is None else (five,))
    }
    for word in range(0x10000):
        bits = tuple(word >> bit & 1 for bit in (6, 5, 3, 2, 1, 0))
        assert drive_state(word) is rows.get(bits, S.UNKNOWN), f'0x{word:04X}'


def test_fault_reset_is_a_rising_edge() -> None:
    """Repeated while the fault lasts, and only in a fault; a drive of half the rate sees it."""
    words = [fault_reset(DriveState.FAULT, 0.01 * cycle + 1e-6) for cycle in range(40)]
    for every in range(1, 6):
        seen = words[::every]
        assert any(b & ~a & 0x80 for a, b in pairwise([0, *seen]))
        assert any(a & ~b & 0x80 for a, b in pairwise(seen))
    assert fault_reset(DriveState.SWITCHED_ON, 0.0) == 0

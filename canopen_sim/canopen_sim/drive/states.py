# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States, commands and options of the power drive system as tables (CiA 402-2, clause 6)."""

from __future__ import annotations

from enum import auto, Enum
from typing import NamedTuple

from arm_canopen import DriveState as State

FAULT_RESET_BIT = 0x80


class DriveCommand(Enum):
    """Command of a controlword to the state machine (CiA 402-2, table 26)."""

    NONE = auto()
    SHUTDOWN = auto()
    SWITCH_ON = auto()  # also "disable operation", the same bits in another state
    ENABLE_OPERATION = auto()
    DISABLE_VOLTAGE = auto()
    QUICK_STOP = auto()


COMMAND_MASKS: tuple[tuple[int, int, DriveCommand], ...] = (
    (0x82, 0x00, DriveCommand.DISABLE_VOLTAGE),
    (0x86, 0x02, DriveCommand.QUICK_STOP),
    (0x87, 0x06, DriveCommand.SHUTDOWN),
    (0x8F, 0x07, DriveCommand.SWITCH_ON),
    (0x8F, 0x0F, DriveCommand.ENABLE_OPERATION),
)
"""Mask, value and command (CiA 402-2, table 26)."""


def decode_command(controlword: int) -> DriveCommand:
    """Return the command in a controlword; with bit 7 set there is none but the fault reset."""
    for mask, value, command in COMMAND_MASKS:
        if controlword & mask == value:
            return command
    return DriveCommand.NONE


class Transition(NamedTuple):
    """An edge of the state machine.

    Attributes:
        number: Its number in CiA 402-2, figure 4.
        target: Where it leads.
    """

    number: int
    target: State


COMMANDED_TRANSITIONS: dict[tuple[State, DriveCommand], Transition] = {
    (State.SWITCH_ON_DISABLED, DriveCommand.SHUTDOWN): Transition(2, State.READY_TO_SWITCH_ON),
    (State.READY_TO_SWITCH_ON, DriveCommand.SWITCH_ON): Transition(3, State.SWITCHED_ON),
    # "enable operation" passes Switched On by itself (table 26, note)
    (State.READY_TO_SWITCH_ON, DriveCommand.ENABLE_OPERATION): Transition(3, State.SWITCHED_ON),
    (State.READY_TO_SWITCH_ON, DriveCommand.DISABLE_VOLTAGE): Transition(
        7, State.SWITCH_ON_DISABLED
    ),
    (State.READY_TO_SWITCH_ON, DriveCommand.QUICK_STOP): Transition(7, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, DriveCommand.ENABLE_OPERATION): Transition(4, State.OPERATION_ENABLED),
    (State.SWITCHED_ON, DriveCommand.SHUTDOWN): Transition(6, State.READY_TO_SWITCH_ON),
    (State.SWITCHED_ON, DriveCommand.DISABLE_VOLTAGE): Transition(10, State.SWITCH_ON_DISABLED),
    (State.SWITCHED_ON, DriveCommand.QUICK_STOP): Transition(10, State.SWITCH_ON_DISABLED),
    (State.OPERATION_ENABLED, DriveCommand.SWITCH_ON): Transition(5, State.SWITCHED_ON),
    (State.OPERATION_ENABLED, DriveCommand.SHUTDOWN): Transition(8, State.READY_TO_SWITCH_ON),
    (State.OPERATION_ENABLED, DriveCommand.DISABLE_VOLTAGE): Transition(
        9, State.SWITCH_ON_DISABLED
    ),
    (State.OPERATION_ENABLED, DriveCommand.QUICK_STOP): Transition(11, State.QUICK_STOP_ACTIVE),
    (State.QUICK_STOP_ACTIVE, DriveCommand.DISABLE_VOLTAGE): Transition(
        12, State.SWITCH_ON_DISABLED
    ),
    (State.QUICK_STOP_ACTIVE, DriveCommand.ENABLE_OPERATION): Transition(
        16, State.OPERATION_ENABLED
    ),
}
"""Transitions that a controlword causes (CiA 402-2, figure 4 and table 26).

Those of themselves are 0 and 1 (start), 12 (quick stop done), 13 (fault) and 14 (reaction done);
15 is the rising edge of the fault reset bit.
"""


class StopOption(Enum):
    """Values of 0x605B to 0x605E that the drive can do; not every object has each (CiA 402-2).

    "Current limit" and "voltage limit" brake as hard as the motor can: ramps of twice the quick
    stop deceleration. The vendor's value -1 of the fault reaction brakes half as hard as "slow
    down".
    """

    VENDOR_SLOW = -1
    DISABLE = 0
    SLOW_DOWN = 1
    QUICK_STOP = 2
    CURRENT_LIMIT = 3
    VOLTAGE_LIMIT = 4


class QuickStopOption(Enum):
    """Values of 0x605A that the drive can do (CiA 402-2, 0x605A)."""

    DISABLE = 0
    SLOW_DOWN = 1
    QUICK_STOP = 2
    CURRENT_LIMIT = 3
    VOLTAGE_LIMIT = 4
    SLOW_DOWN_AND_STAY = 5
    QUICK_STOP_AND_STAY = 6
    CURRENT_LIMIT_AND_STAY = 7
    VOLTAGE_LIMIT_AND_STAY = 8

    @property
    def stays(self) -> bool:
        """The drive stays in Quick stop active when it stands still."""
        return self.value > StopOption.VOLTAGE_LIMIT.value

    @property
    def ramp(self) -> StopOption:
        """How it brakes."""
        return StopOption(self.value - 4 if self.stays else self.value)


class AbortConnectionOption(Enum):
    """Values of 0x6007: what a lost connection to the master causes (CiA 402-2, 0x6007)."""

    NO_ACTION = 0
    FAULT = 1
    DISABLE_VOLTAGE = 2
    QUICK_STOP = 3

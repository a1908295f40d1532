# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Device profiles: states, words and modes of drives (CiA 402-2, clauses 6 to 8), and I/O objects.

I/O modules follow CiA 401, encoders CiA 406 with one channel.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import dataclass
from enum import IntEnum, IntFlag

from .dictionary import ObjectDictionary, ObjectEntry
from .objects import Index


class DriveState(IntEnum):
    """States of the power drive system (CiA 402-2, figure 4), numbered as in ros2_canopen."""

    UNKNOWN = 0
    NOT_READY_TO_SWITCH_ON = 1
    SWITCH_ON_DISABLED = 2
    READY_TO_SWITCH_ON = 3
    SWITCHED_ON = 4
    OPERATION_ENABLED = 5
    QUICK_STOP_ACTIVE = 6
    FAULT_REACTION_ACTIVE = 7
    FAULT = 8

    @property
    def title(self) -> str:
        """Name as the standard writes it."""
        return self.name.replace('_', ' ').capitalize()


class Controlword(IntFlag):
    """Bits of 0x6040 (CiA 402-2, table 25); bits 4 to 6 and 9 depend on the mode."""

    SWITCH_ON = 1 << 0
    ENABLE_VOLTAGE = 1 << 1
    QUICK_STOP = 1 << 2  # active low
    ENABLE_OPERATION = 1 << 3
    NEW_SET_POINT = 1 << 4  # profile position
    HOMING_START = 1 << 4  # homing
    ENABLE_INTERPOLATION = 1 << 4  # interpolated position
    CHANGE_IMMEDIATELY = 1 << 5  # profile position
    RELATIVE = 1 << 6  # profile position
    FAULT_RESET = 1 << 7  # rising edge
    HALT = 1 << 8
    CHANGE_ON_SET_POINT = 1 << 9  # profile position


class Statusword(IntFlag):
    """Bits of 0x6041 (CiA 402-2, table 30); bits 12 and 13 depend on the mode."""

    READY_TO_SWITCH_ON = 1 << 0
    SWITCHED_ON = 1 << 1
    OPERATION_ENABLED = 1 << 2
    FAULT = 1 << 3
    VOLTAGE_ENABLED = 1 << 4
    QUICK_STOP = 1 << 5  # active low
    SWITCH_ON_DISABLED = 1 << 6
    WARNING = 1 << 7
    REMOTE = 1 << 9
    TARGET_REACHED = 1 << 10
    INTERNAL_LIMIT = 1 << 11
    SET_POINT_ACKNOWLEDGE = 1 << 12  # profile position
    HOMING_ATTAINED = 1 << 12  # homing
    INTERPOLATION_ACTIVE = 1 << 12  # interpolated position
    FOLLOWS_COMMAND = 1 << 12  # cyclic synchronous modes
    ZERO_SPEED = 1 << 12  # profile velocity
    FOLLOWING_ERROR = 1 << 13  # position modes
    HOMING_ERROR = 1 << 13  # homing


STATE_MASKS: tuple[tuple[int, int, DriveState], ...] = (
    (0x4F, 0x00, DriveState.NOT_READY_TO_SWITCH_ON),
    (0x4F, 0x40, DriveState.SWITCH_ON_DISABLED),
    (0x6F, 0x21, DriveState.READY_TO_SWITCH_ON),
    (0x6F, 0x23, DriveState.SWITCHED_ON),
    (0x6F, 0x27, DriveState.OPERATION_ENABLED),
    (0x6F, 0x07, DriveState.QUICK_STOP_ACTIVE),
    (0x4F, 0x0F, DriveState.FAULT_REACTION_ACTIVE),
    (0x4F, 0x08, DriveState.FAULT),
)
"""Mask, value and state (CiA 402-2, table 31)."""

STATE_WORDS: dict[DriveState, int] = {state: value for _, value, state in STATE_MASKS}
"""The state bits that a drive shows in each state."""


def _decode_state(statusword: int) -> DriveState:
    for mask, value, state in STATE_MASKS:
        if statusword & mask == value:
            return state
    return DriveState.UNKNOWN


_STATE_BY_LOW_BITS = tuple(_decode_state(word) for word in range(0x80))


def drive_state(statusword: int) -> DriveState:
    """Return the state in a statusword; UNKNOWN if no row of the table matches."""
    return _STATE_BY_LOW_BITS[statusword & 0x7F]


class OperationMode(IntEnum):
    """Values of 0x6060 and 0x6061 (CiA 402-2, table 36)."""

    NO_MODE = 0
    PROFILE_POSITION = 1
    VELOCITY = 2
    PROFILE_VELOCITY = 3
    PROFILE_TORQUE = 4
    HOMING = 6
    INTERPOLATED_POSITION = 7
    CYCLIC_POSITION = 8
    CYCLIC_VELOCITY = 9
    CYCLIC_TORQUE = 10

    @property
    def title(self) -> str:
        """Name as a person writes it."""
        return self.name.replace('_', ' ').capitalize()

    @property
    def support_bit(self) -> int:
        """Bit of this mode in 0x6502 (CiA 402-2, figure 48); 0 for no mode."""
        return 1 << (self - 1) if self else 0


def mode_title(number: int) -> str:
    """Return the name of a mode, also of one outside the standard (vendor modes are negative)."""
    try:
        return OperationMode(number).title
    except ValueError:
        return f'Mode {number}'


STATUS_TEXTS: tuple[tuple[Statusword, str], ...] = (
    (Statusword.FAULT, 'fault'),
    (Statusword.VOLTAGE_ENABLED, 'voltage enabled'),
    (Statusword.WARNING, 'warning'),
    (Statusword.REMOTE, 'remote'),
    (Statusword.TARGET_REACHED, 'target reached'),
    (Statusword.INTERNAL_LIMIT, 'internal limit active'),
)
"""Bits beside the state, in the order of the word."""


def statusword_text(statusword: int) -> str:
    """Describe a statusword: its state and the bits that are set beside it."""
    bits = [text for bit, text in STATUS_TEXTS if statusword & bit]
    extra = f' ({", ".join(bits)})' if bits else ''
    return f'0x{statusword:04X} {drive_state(statusword).title}{extra}'


TARGET_OBJECTS: dict[OperationMode, tuple[Index, int]] = {
    OperationMode.PROFILE_POSITION: (Index.TARGET_POSITION, 0),
    OperationMode.VELOCITY: (Index.VL_TARGET_VELOCITY, 0),
    OperationMode.PROFILE_VELOCITY: (Index.TARGET_VELOCITY, 0),
    OperationMode.PROFILE_TORQUE: (Index.TARGET_TORQUE, 0),
    OperationMode.INTERPOLATED_POSITION: (Index.INTERPOLATION_DATA, 1),
    OperationMode.CYCLIC_POSITION: (Index.TARGET_POSITION, 0),
    OperationMode.CYCLIC_VELOCITY: (Index.TARGET_VELOCITY, 0),
    OperationMode.CYCLIC_TORQUE: (Index.TARGET_TORQUE, 0),
}

POSITION_MODES = (
    OperationMode.PROFILE_POSITION,
    OperationMode.INTERPOLATED_POSITION,
    OperationMode.CYCLIC_POSITION,
)
VELOCITY_MODES = (
    OperationMode.VELOCITY,
    OperationMode.PROFILE_VELOCITY,
    OperationMode.CYCLIC_VELOCITY,
)
TORQUE_MODES = (OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE)
CYCLIC_MODES = frozenset(
    {
        OperationMode.INTERPOLATED_POSITION,
        OperationMode.CYCLIC_POSITION,
        OperationMode.CYCLIC_VELOCITY,
        OperationMode.CYCLIC_TORQUE,
    }
)
"""Modes that take a target with every SYNC (CiA 402-2, clauses 12 to 16)."""


class EncoderObject(IntEnum):
    """Objects of an encoder; the speed is sub-index 1 of its array."""

    UNITS_PER_REVOLUTION = 0x6001
    TOTAL_RANGE = 0x6002
    PRESET = 0x6003
    POSITION = 0x6004
    SPEED = 0x6030


ANALOG_EVENTS = 0x6423  # analogue input global interrupt enable


@dataclass(frozen=True, slots=True)
class IoGroup:
    """Inputs or outputs of one kind.

    A module offers the same digital channels as objects of 8, 16 or 32 bits, which begin at
    ``indices``; sub-index 0 is their number. Analogue channels have one index per width.
    """

    name: str  # as in ``digital_inputs``
    indices: tuple[int, ...]
    is_output: bool
    is_digital: bool

    @property
    def direction(self) -> str:
        """Key of bus.yml that contains its PDOs."""
        return 'rpdo' if self.is_output else 'tpdo'

    def entries(
        self, dictionary: ObjectDictionary, mapped: Container[tuple[int, int]] = ()
    ) -> Sequence[ObjectEntry]:
        """Return the channels of a module; among several widths, those mapped into PDOs."""
        widths = [
            [entry for entry in dictionary.subindices(index) if entry.subindex]
            for index in self.indices
            if dictionary.has_index(index)
        ]
        carried = (each for each in widths if any(entry.address in mapped for entry in each))
        return next(carried, widths[0] if widths else [])


DIGITAL_INPUTS = IoGroup(
    'digital_inputs', (0x6000, 0x6100, 0x6120), is_output=False, is_digital=True
)
DIGITAL_OUTPUTS = IoGroup(
    'digital_outputs', (0x6200, 0x6300, 0x6320), is_output=True, is_digital=True
)
ANALOG_INPUTS = IoGroup(
    'analog_inputs', (0x6400, 0x6401, 0x6402, 0x6403), is_output=False, is_digital=False
)
IO_GROUPS = (
    DIGITAL_INPUTS,
    DIGITAL_OUTPUTS,
    ANALOG_INPUTS,
    IoGroup('analog_outputs', (0x6410, 0x6411, 0x6412, 0x6413), is_output=True, is_digital=False),
)
ERROR_OBJECTS = {0x6200: (0x6206, 0x6207), 0x6411: (0x6443, 0x6444)}
"""Error mode of outputs (which ones change when the master is lost), and their error values."""

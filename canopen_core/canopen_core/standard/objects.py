# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Indices of the objects that master and devices use by name (CiA 301, 7.5.2; CiA 402-2)."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple


class Index(IntEnum):
    """Object indices of the communication profile (CiA 301) and the drive profile (CiA 402)."""

    DEVICE_TYPE = 0x1000
    ERROR_REGISTER = 0x1001
    PREDEFINED_ERROR_FIELD = 0x1003
    SYNC_COB_ID = 0x1005
    CYCLE_PERIOD = 0x1006
    SYNC_WINDOW = 0x1007
    GUARD_TIME = 0x100C
    LIFE_TIME_FACTOR = 0x100D
    STORE_PARAMETERS = 0x1010
    RESTORE_PARAMETERS = 0x1011
    TIME_COB_ID = 0x1012
    EMCY_COB_ID = 0x1014
    EMCY_INHIBIT_TIME = 0x1015
    CONSUMER_HEARTBEAT = 0x1016
    PRODUCER_HEARTBEAT = 0x1017
    IDENTITY = 0x1018
    SYNC_OVERFLOW = 0x1019
    VERIFY_CONFIGURATION = 0x1020
    ERROR_BEHAVIOUR = 0x1029
    SDO_SERVER = 0x1200
    RPDO_COMMUNICATION = 0x1400
    RPDO_MAPPING = 0x1600
    TPDO_COMMUNICATION = 0x1800
    TPDO_MAPPING = 0x1A00
    CONCISE_DCF = 0x1F22
    PROGRAM_DATA = 0x1F50
    PROGRAM_CONTROL = 0x1F51

    ABORT_CONNECTION_OPTION = 0x6007
    ERROR_CODE = 0x603F
    CONTROLWORD = 0x6040
    STATUSWORD = 0x6041
    VL_TARGET_VELOCITY = 0x6042
    VL_VELOCITY_DEMAND = 0x6043
    VL_VELOCITY_ACTUAL = 0x6044
    VL_VELOCITY_MIN_MAX = 0x6046
    VL_ACCELERATION = 0x6048
    VL_DECELERATION = 0x6049
    VL_QUICK_STOP = 0x604A
    QUICK_STOP_OPTION = 0x605A
    SHUTDOWN_OPTION = 0x605B
    DISABLE_OPTION = 0x605C
    HALT_OPTION = 0x605D
    FAULT_REACTION_OPTION = 0x605E
    MODE_OF_OPERATION = 0x6060
    MODE_OF_OPERATION_DISPLAY = 0x6061
    POSITION_DEMAND = 0x6062
    POSITION_ACTUAL_INTERNAL = 0x6063
    POSITION_ACTUAL = 0x6064
    FOLLOWING_ERROR_WINDOW = 0x6065
    FOLLOWING_ERROR_TIMEOUT = 0x6066
    POSITION_WINDOW = 0x6067
    POSITION_WINDOW_TIME = 0x6068
    VELOCITY_DEMAND = 0x606B
    VELOCITY_ACTUAL = 0x606C
    VELOCITY_WINDOW = 0x606D
    VELOCITY_WINDOW_TIME = 0x606E
    VELOCITY_THRESHOLD = 0x606F
    VELOCITY_THRESHOLD_TIME = 0x6070
    TARGET_TORQUE = 0x6071
    MAX_TORQUE = 0x6072
    TORQUE_DEMAND = 0x6074
    TORQUE_ACTUAL = 0x6077
    CURRENT_ACTUAL = 0x6078
    DC_LINK_VOLTAGE = 0x6079
    TARGET_POSITION = 0x607A
    POSITION_RANGE_LIMIT = 0x607B
    HOME_OFFSET = 0x607C
    SOFTWARE_POSITION_LIMIT = 0x607D
    MAX_PROFILE_VELOCITY = 0x607F
    MAX_MOTOR_SPEED = 0x6080
    PROFILE_VELOCITY = 0x6081
    PROFILE_ACCELERATION = 0x6083
    PROFILE_DECELERATION = 0x6084
    QUICK_STOP_DECELERATION = 0x6085
    TORQUE_SLOPE = 0x6087
    POSITION_ENCODER_RESOLUTION = 0x608F
    GEAR_RATIO = 0x6091
    FEED_CONSTANT = 0x6092
    VELOCITY_FACTOR = 0x6096
    ACCELERATION_FACTOR = 0x6097
    HOMING_METHOD = 0x6098
    HOMING_SPEEDS = 0x6099
    HOMING_ACCELERATION = 0x609A
    SI_UNIT_POSITION = 0x60A8
    SI_UNIT_VELOCITY = 0x60A9
    SI_UNIT_ACCELERATION = 0x60AA
    POSITION_OFFSET = 0x60B0
    VELOCITY_OFFSET = 0x60B1
    TORQUE_OFFSET = 0x60B2
    INTERPOLATION_DATA = 0x60C1
    INTERPOLATION_PERIOD = 0x60C2
    INTERPOLATION_CONFIGURATION = 0x60C4
    MAX_ACCELERATION = 0x60C5
    MAX_DECELERATION = 0x60C6
    POSITIVE_TORQUE_LIMIT = 0x60E0
    NEGATIVE_TORQUE_LIMIT = 0x60E1
    FOLLOWING_ERROR = 0x60F4
    MAX_SLIPPAGE = 0x60F8
    DIGITAL_INPUTS = 0x60FD
    TARGET_VELOCITY = 0x60FF
    SUPPORTED_MODES = 0x6502


PDO_COUNT_MAX = 512  # PDOs of each direction in the dictionary (CiA 301, 7.5.2.35)
PDO_BITS_MAX = 64  # [bit] payload of a classic CAN frame

COMMANDS = frozenset(
    {
        Index.CONTROLWORD,
        Index.MODE_OF_OPERATION,
        Index.TARGET_POSITION,
        Index.TARGET_VELOCITY,
        Index.VL_TARGET_VELOCITY,
        Index.TARGET_TORQUE,
        Index.INTERPOLATION_DATA,
    }
)
"""Objects of a drive's first axis that command it in each cycle."""
OFFSETS = frozenset({Index.POSITION_OFFSET, Index.VELOCITY_OFFSET, Index.TORQUE_OFFSET})
"""Objects of a drive's first axis that are added to its targets."""

SLOW_WRITES: dict[int, float] = {
    Index.STORE_PARAMETERS: 10.0,
    Index.RESTORE_PARAMETERS: 10.0,
    Index.CONCISE_DCF: 10.0,
    Index.PROGRAM_DATA: 60.0,
    Index.PROGRAM_CONTROL: 60.0,
}
"""Objects whose write a device acknowledges only after writing flash memory, and the longest time
for that in [s] (CiA 301, 7.5.2.13 and 7.5.2.14; CiA 302-3)."""
SETTINGS = (range(0x1000, 0x1F00), range(0x6000, 0xA000))
"""Objects of the standards: settings that may safely be written twice (CiA 301, table 10). What a
write of other objects triggers, only the vendor knows."""

AXIS_OFFSET = 0x800  # between the objects of two axes of a drive (CiA 402-2, 7.2)
AXES_MAX = 8  # axes of one device (CiA 402-2, 7.2)
_PROFILE_AREA = 0x6000  # first object of the first axis
_STATE = frozenset(
    {
        Index.STATUSWORD,
        Index.MODE_OF_OPERATION_DISPLAY,
        Index.POSITION_ACTUAL,
        Index.VELOCITY_ACTUAL,
        Index.TORQUE_ACTUAL,
    }
)
_SIGNED = frozenset(
    {
        (Index.VL_TARGET_VELOCITY, 0),
        (Index.POSITION_ACTUAL, 0),
        (Index.VELOCITY_ACTUAL, 0),
        (Index.TARGET_TORQUE, 0),
        (Index.TORQUE_ACTUAL, 0),
        (Index.TARGET_POSITION, 0),
        (Index.POSITION_OFFSET, 0),
        (Index.VELOCITY_OFFSET, 0),
        (Index.TORQUE_OFFSET, 0),
        (Index.INTERPOLATION_DATA, 1),
        (Index.TARGET_VELOCITY, 0),
    }
)


class PdoObject(NamedTuple):
    """A parameter object of a PDO."""

    direction: str  # ``rpdo`` or ``tpdo``, as the device sees it
    number: int  # of the PDO, from 1
    is_mapping: bool  # it has the mapping, and not the communication parameters


def pdo_object(index: int) -> PdoObject | None:
    """Return the PDO that an object parameterizes (CiA 301, 7.5.2.35 to 7.5.2.38), or None."""
    kind, offset = divmod(index - Index.RPDO_COMMUNICATION, PDO_COUNT_MAX)
    if not 0 <= kind < 4:
        return None
    return PdoObject('tpdo' if kind & 2 else 'rpdo', offset + 1, bool(kind & 1))


def axis_of(index: int) -> tuple[int, int]:
    """Return the index of the same object in the first axis, and the axis number from 0."""
    axis, offset = divmod(index - _PROFILE_AREA, AXIS_OFFSET)
    return (_PROFILE_AREA + offset, axis) if 0 <= axis < AXES_MAX else (index, 0)


def is_signed(index: int, subindex: int) -> bool:
    """Return whether an object of any axis is a position, velocity or torque, which has a sign."""
    return (axis_of(index)[0], subindex) in _SIGNED


def slow_timeout(index: int, usual: float) -> float:
    """Return the time-out for writing an object in [s]; ``usual``, unless the object is slow."""
    return max(usual, SLOW_WRITES.get(index, 0.0))


def is_setting(index: int) -> bool:
    """Return whether an object may safely be written twice."""
    return (
        any(index in area for area in SETTINGS)
        and index not in SLOW_WRITES
        and not is_controlword(index)
    )


def is_state(index: int) -> bool:
    """Return whether an object is a state of any drive axis that the cycle reads."""
    return axis_of(index)[0] in _STATE


def is_controlword(index: int) -> bool:
    """Return whether an object is the controlword of any drive axis."""
    return axis_of(index)[0] == Index.CONTROLWORD

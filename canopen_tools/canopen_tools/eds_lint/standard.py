# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the standards define for objects that devices share: data type and access."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from arm_canopen.standard import (
    AccessType,
    DataType,
    DeviceProfile,
    Index,
    is_drive,
    ObjectDictionary,
    profile_number,
)


class Role(Enum):
    """Who has to be able to do what."""

    VALUE = 'set by the device'
    SETTING = 'somebody writes it'
    EITHER = 'writing is optional'


READABLE_ONLY = frozenset({AccessType.READ_ONLY, AccessType.CONSTANT})
ACCESS: dict[Role, frozenset[AccessType]] = {
    Role.VALUE: READABLE_ONLY,
    Role.SETTING: frozenset(AccessType) - READABLE_ONLY,
    Role.EITHER: frozenset(AccessType) - {AccessType.WRITE_ONLY},
}


@dataclass(frozen=True, slots=True)
class StandardObject:
    """An object as a standard describes it."""

    data_type: DataType
    role: Role


U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
I8, I16, I32 = DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32

Rows: TypeAlias = tuple[tuple[int, int, DataType, Role], ...]

_COMMUNICATION: Rows = (  # CiA 301, 7.5.2
    (Index.DEVICE_TYPE, 0, U32, Role.VALUE),
    (Index.ERROR_REGISTER, 0, U8, Role.VALUE),
    (Index.SYNC_COB_ID, 0, U32, Role.EITHER),
    (Index.CYCLE_PERIOD, 0, U32, Role.SETTING),
    (Index.SYNC_WINDOW, 0, U32, Role.SETTING),
    (Index.DEVICE_NAME, 0, DataType.VISIBLE_STRING, Role.VALUE),
    (Index.HARDWARE_VERSION, 0, DataType.VISIBLE_STRING, Role.VALUE),
    (Index.SOFTWARE_VERSION, 0, DataType.VISIBLE_STRING, Role.VALUE),
    (Index.GUARD_TIME, 0, U16, Role.EITHER),
    (Index.LIFE_TIME_FACTOR, 0, U8, Role.EITHER),
    (Index.TIME_COB_ID, 0, U32, Role.EITHER),
    (Index.EMCY_COB_ID, 0, U32, Role.EITHER),
    (Index.EMCY_INHIBIT_TIME, 0, U16, Role.SETTING),
    (Index.CONSUMER_HEARTBEAT, 1, U32, Role.SETTING),
    (Index.PRODUCER_HEARTBEAT, 0, U16, Role.EITHER),
    (Index.IDENTITY, 1, U32, Role.VALUE),
    (Index.IDENTITY, 2, U32, Role.VALUE),
    (Index.IDENTITY, 3, U32, Role.VALUE),
    (Index.IDENTITY, 4, U32, Role.VALUE),
    (Index.SYNC_OVERFLOW, 0, U8, Role.SETTING),
)
_DRIVE: Rows = (  # CiA 402-2, clause 7 and the clauses of the modes
    (Index.ERROR_CODE, 0, U16, Role.VALUE),
    (Index.CONTROLWORD, 0, U16, Role.SETTING),
    (Index.STATUSWORD, 0, U16, Role.VALUE),
    (Index.QUICK_STOP_OPTION, 0, I16, Role.EITHER),
    (Index.MODE_OF_OPERATION, 0, I8, Role.SETTING),
    (Index.MODE_OF_OPERATION_DISPLAY, 0, I8, Role.VALUE),
    (Index.POSITION_DEMAND, 0, I32, Role.VALUE),
    (Index.POSITION_ACTUAL, 0, I32, Role.VALUE),
    (Index.VELOCITY_ACTUAL, 0, I32, Role.VALUE),
    (Index.TARGET_TORQUE, 0, I16, Role.SETTING),
    (Index.TORQUE_ACTUAL, 0, I16, Role.VALUE),
    (Index.TARGET_POSITION, 0, I32, Role.SETTING),
    (Index.PROFILE_VELOCITY, 0, U32, Role.SETTING),
    (Index.PROFILE_ACCELERATION, 0, U32, Role.SETTING),
    (Index.PROFILE_DECELERATION, 0, U32, Role.SETTING),
    (Index.QUICK_STOP_DECELERATION, 0, U32, Role.SETTING),
    (Index.HOMING_METHOD, 0, I8, Role.SETTING),
    (Index.INTERPOLATION_PERIOD, 1, U8, Role.EITHER),
    (Index.INTERPOLATION_PERIOD, 2, I8, Role.EITHER),
    (Index.TARGET_VELOCITY, 0, I32, Role.SETTING),
    (Index.SUPPORTED_MODES, 0, U32, Role.VALUE),
)

_GENERIC_IO: Rows = (  # CiA 401, clause 7: the first of each kind
    (0x6000, 1, U8, Role.VALUE),
    (0x6200, 1, U8, Role.SETTING),
    (0x6401, 1, I16, Role.VALUE),
    (0x6411, 1, I16, Role.SETTING),
)
_ENCODER: Rows = (  # CiA 406, clause 7
    (0x6000, 0, U16, Role.EITHER),
    (0x6001, 0, U32, Role.EITHER),
    (0x6002, 0, U32, Role.EITHER),
    (0x6003, 0, U32, Role.SETTING),
    (0x6004, 0, U32, Role.VALUE),
)
_PROFILES: dict[int, Rows] = {
    DeviceProfile.GENERIC_IO: _GENERIC_IO,
    DeviceProfile.DRIVE: _DRIVE,
    DeviceProfile.ENCODER: _ENCODER,
}


def standard_objects(dictionary: ObjectDictionary) -> dict[tuple[int, int], StandardObject]:
    """Return what CiA 301 and the profile of a device define, by index and sub-index."""
    number = DeviceProfile.DRIVE if is_drive(dictionary) else profile_number(dictionary)
    return {
        (index, subindex): StandardObject(data_type, role)
        for index, subindex, data_type, role in (*_COMMUNICATION, *_PROFILES.get(number, ()))
    }


MANDATORY: dict[tuple[int, int], str] = {
    (Index.DEVICE_TYPE, 0): 'device type',
    (Index.ERROR_REGISTER, 0): 'error register',
    (Index.IDENTITY, 1): 'vendor id',
}
"""What every CANopen device has (CiA 301, 7.5.2)."""

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which device profile a device follows: objects from 0x6000 on are those of that profile."""

from __future__ import annotations

from enum import IntEnum

from .dictionary import ObjectDictionary
from .objects import AXES_MAX, AXIS_OFFSET, Index

PROFILE_MASK = 0xFFFF  # bits of 0x1000 that hold the number of the profile (CiA 301, 7.5.2.1)


class DeviceProfile(IntEnum):
    """Numbers of profiles whose objects are known here."""

    GENERIC_IO = 401
    DRIVE = 402
    ENCODER = 406


def profile_number(dictionary: ObjectDictionary) -> int:
    """Return the number of the profile that the EDS names; 0 when it names none."""
    return (dictionary.number(Index.DEVICE_TYPE) or 0) & PROFILE_MASK


def is_drive(dictionary: ObjectDictionary) -> bool:
    """Return whether 0x6040 and its like are those of CiA 402; other profiles have them, too."""
    number = profile_number(dictionary)
    if number:
        return number == DeviceProfile.DRIVE
    return bool(drive_axes(dictionary))


def drive_axes(dictionary: ObjectDictionary) -> tuple[int, ...]:
    """Return the numbers, from 0, of the axes with a controlword and a statusword."""
    words = (Index.CONTROLWORD, Index.STATUSWORD)
    return tuple(
        axis
        for axis in range(AXES_MAX)
        if all(dictionary.has_index(word + AXIS_OFFSET * axis) for word in words)
    )

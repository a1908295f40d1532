# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Codes with a meaning in words, and those of SDO aborts (CiA 301, table 22)."""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing_extensions import Self


class CodeWithText(IntEnum):
    """Codes, each with its meaning as ``text``."""

    text: str

    def __new__(cls, code: int, text: str = '') -> Self:
        """Make a member of a row; a member by its code alone has the text of its row."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member


class AbortCode(CodeWithText):
    """SDO abort codes, each with its meaning as ``text``."""

    TOGGLE_BIT = 0x0503_0000, 'toggle bit not alternated'
    TIMED_OUT = 0x0504_0000, 'SDO protocol timed out'
    COMMAND_SPECIFIER = 0x0504_0001, 'command specifier not valid or unknown'
    BLOCK_SIZE = 0x0504_0002, 'invalid block size'
    SEQUENCE_NUMBER = 0x0504_0003, 'invalid sequence number'
    CRC = 0x0504_0004, 'CRC error'
    OUT_OF_MEMORY = 0x0504_0005, 'out of memory'
    UNSUPPORTED_ACCESS = 0x0601_0000, 'unsupported access to an object'
    WRITE_ONLY = 0x0601_0001, 'attempt to read a write-only object'
    READ_ONLY = 0x0601_0002, 'attempt to write a read-only object'
    NO_OBJECT = 0x0602_0000, 'object does not exist in the object dictionary'
    NOT_MAPPABLE = 0x0604_0041, 'object cannot be mapped to the PDO'
    PDO_LENGTH = 0x0604_0042, 'mapped objects would exceed the PDO length'
    PARAMETER_INCOMPATIBLE = 0x0604_0043, 'general parameter incompatibility'
    INTERNAL_INCOMPATIBLE = 0x0604_0047, 'general internal incompatibility in the device'
    HARDWARE = 0x0606_0000, 'access failed due to a hardware error'
    LENGTH = 0x0607_0010, 'data type does not match, length does not match'
    LENGTH_HIGH = 0x0607_0012, 'data type does not match, length too high'
    LENGTH_LOW = 0x0607_0013, 'data type does not match, length too low'
    NO_SUBINDEX = 0x0609_0011, 'sub-index does not exist'
    VALUE_RANGE = 0x0609_0030, 'invalid value for parameter'
    VALUE_HIGH = 0x0609_0031, 'value of parameter written too high'
    VALUE_LOW = 0x0609_0032, 'value of parameter written too low'
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036, 'maximum value is less than minimum value'
    RESOURCE_UNAVAILABLE = 0x060A_0023, 'resource not available: SDO connection'
    GENERAL = 0x0800_0000, 'general error'
    DATA_TRANSFER = 0x0800_0020, 'data cannot be transferred or stored to the application'
    LOCAL_CONTROL = 0x0800_0021, 'data cannot be transferred because of local control'
    DEVICE_STATE = 0x0800_0022, 'data cannot be transferred in the present device state'
    NO_DICTIONARY = 0x0800_0023, 'object dictionary not present'
    NO_DATA = 0x0800_0024, 'no data available'


def abort_text(code: int) -> str:
    """Describe an abort code."""
    try:
        return f'{AbortCode(code).text} (0x{code:08X})'
    except ValueError:
        return f'unknown abort code 0x{code:08X}'

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO abort codes and their texts (CiA 301, table 22)."""

from __future__ import annotations

from enum import IntEnum


class AbortCode(IntEnum):
    """SDO abort codes (CiA 301, table 22)."""

    TOGGLE_BIT = 0x0503_0000
    TIMED_OUT = 0x0504_0000
    COMMAND_SPECIFIER = 0x0504_0001
    BLOCK_SIZE = 0x0504_0002
    SEQUENCE_NUMBER = 0x0504_0003
    CRC = 0x0504_0004
    OUT_OF_MEMORY = 0x0504_0005
    UNSUPPORTED_ACCESS = 0x0601_0000
    WRITE_ONLY = 0x0601_0001
    READ_ONLY = 0x0601_0002
    NO_OBJECT = 0x0602_0000
    NOT_MAPPABLE = 0x0604_0041
    PDO_LENGTH = 0x0604_0042
    PARAMETER_INCOMPATIBLE = 0x0604_0043
    INTERNAL_INCOMPATIBLE = 0x0604_0047
    HARDWARE = 0x0606_0000
    LENGTH = 0x0607_0010
    LENGTH_HIGH = 0x0607_0012
    LENGTH_LOW = 0x0607_0013
    NO_SUBINDEX = 0x0609_0011
    VALUE_RANGE = 0x0609_0030
    VALUE_HIGH = 0x0609_0031
    VALUE_LOW = 0x0609_0032
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036
    RESOURCE_UNAVAILABLE = 0x060A_0023
    GENERAL = 0x0800_0000
    DATA_TRANSFER = 0x0800_0020
    LOCAL_CONTROL = 0x0800_0021
    DEVICE_STATE = 0x0800_0022
    NO_DICTIONARY = 0x0800_0023
    NO_DATA = 0x0800_0024


ABORT_TEXTS: dict[AbortCode, str] = {
    AbortCode.TOGGLE_BIT: 'toggle bit not alternated',
    AbortCode.TIMED_OUT: 'SDO protocol timed out',
    AbortCode.COMMAND_SPECIFIER: 'command specifier not valid or unknown',
    AbortCode.BLOCK_SIZE: 'invalid block size',
    AbortCode.SEQUENCE_NUMBER: 'invalid sequence number',
    AbortCode.CRC: 'CRC error',
    AbortCode.OUT_OF_MEMORY: 'out of memory',
    AbortCode.UNSUPPORTED_ACCESS: 'unsupported access to an object',
    AbortCode.WRITE_ONLY: 'attempt to read a write-only object',
    AbortCode.READ_ONLY: 'attempt to write a read-only object',
    AbortCode.NO_OBJECT: 'object does not exist in the object dictionary',
    AbortCode.NOT_MAPPABLE: 'object cannot be mapped to the PDO',
    AbortCode.PDO_LENGTH: 'mapped objects would exceed the PDO length',
    AbortCode.PARAMETER_INCOMPATIBLE: 'general parameter incompatibility',
    AbortCode.INTERNAL_INCOMPATIBLE: 'general internal incompatibility in the device',
    AbortCode.HARDWARE: 'access failed due to a hardware error',
    AbortCode.LENGTH: 'data type does not match, length does not match',
    AbortCode.LENGTH_HIGH: 'data type does not match, length too high',
    AbortCode.LENGTH_LOW: 'data type does not match, length too low',
    AbortCode.NO_SUBINDEX: 'sub-index does not exist',
    AbortCode.VALUE_RANGE: 'invalid value for parameter',
    AbortCode.VALUE_HIGH: 'value of parameter written too high',
    AbortCode.VALUE_LOW: 'value of parameter written too low',
    AbortCode.MAXIMUM_BELOW_MINIMUM: 'maximum value is less than minimum value',
    AbortCode.RESOURCE_UNAVAILABLE: 'resource not available: SDO connection',
    AbortCode.GENERAL: 'general error',
    AbortCode.DATA_TRANSFER: 'data cannot be transferred or stored to the application',
    AbortCode.LOCAL_CONTROL: 'data cannot be transferred because of local control',
    AbortCode.DEVICE_STATE: 'data cannot be transferred in the present device state',
    AbortCode.NO_DICTIONARY: 'object dictionary not present',
    AbortCode.NO_DATA: 'no data available',
}
"""Meaning of the abort codes (CiA 301, table 22)."""


def abort_text(code: int) -> str:
    """Say an abort code in words."""
    try:
        return f'{ABORT_TEXTS[AbortCode(code)]} (0x{code:08X})'
    except ValueError:
        return f'unknown abort code 0x{code:08X}'

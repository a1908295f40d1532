# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the layer setting services (CiA 305, 6), for master, slave and monitor alike."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
import struct
from typing import NamedTuple

from .sdo_abort import CodeWithText

REQUEST = 0x7E5  # COB-ID from the master
RESPONSE = 0x7E4  # COB-ID from the slaves
MESSAGE_BYTES = 8  # [byte]
UNCONFIGURED = 255  # node id of a device that has none

BIT_RATES: dict[int, int] = {
    0: 1_000_000,
    1: 800_000,
    2: 500_000,
    3: 250_000,
    4: 125_000,
    5: 100_000,
    6: 50_000,
    7: 20_000,
    8: 10_000,
}
"""Bit rates in [bit/s] by their index in the standard table (CiA 301, table 1).

Newer issues of CiA 305 reserve index 5; a device that does not have it refuses it.
"""
BIT_RATES_KBIT = tuple(sorted(rate // 1000 for rate in BIT_RATES.values()))
"""The same in [kbit/s], as bus.yml and EDS files (``BaudRate_...``) name them."""
STANDARD_TABLE = 0  # the table selector of BIT_RATES

WHOLE_NUMBER = 0x80  # BitCheck of fast scan: all unconfigured devices answer, and begin anew
ADDRESS_BITS = 32  # of each of the four numbers


class Command(CodeWithText):
    """Command specifiers, each with its service in words as ``text``."""

    SWITCH_GLOBAL = 0x04, 'switch state global'
    CONFIGURE_NODE_ID = 0x11, 'configure node id'
    CONFIGURE_BIT_TIMING = 0x13, 'configure bit timing'
    ACTIVATE_BIT_TIMING = 0x15, 'activate bit timing'
    STORE = 0x17, 'store configuration'
    SELECT_VENDOR = 0x40, 'switch state selective: vendor id'
    SELECT_PRODUCT = 0x41, 'switch state selective: product code'
    SELECT_REVISION = 0x42, 'switch state selective: revision number'
    SELECT_SERIAL = 0x43, 'switch state selective: serial number'
    SELECTED = 0x44, 'switch state selective: done'
    IDENTIFY_VENDOR = 0x46, 'identify remote slave: vendor id'
    IDENTIFY_PRODUCT = 0x47, 'identify remote slave: product code'
    IDENTIFY_REVISION_LOW = 0x48, 'identify remote slave: lowest revision number'
    IDENTIFY_REVISION_HIGH = 0x49, 'identify remote slave: highest revision number'
    IDENTIFY_SERIAL_LOW = 0x4A, 'identify remote slave: lowest serial number'
    IDENTIFY_SERIAL_HIGH = 0x4B, 'identify remote slave: highest serial number'
    IDENTIFY_UNCONFIGURED = 0x4C, 'identify non-configured remote slave'
    IDENTIFIED = 0x4F, 'identify slave'
    UNCONFIGURED_IDENTIFIED = 0x50, 'identify non-configured slave'
    FAST_SCAN = 0x51, 'fastscan'
    INQUIRE_VENDOR = 0x5A, 'inquire vendor id'
    INQUIRE_PRODUCT = 0x5B, 'inquire product code'
    INQUIRE_REVISION = 0x5C, 'inquire revision number'
    INQUIRE_SERIAL = 0x5D, 'inquire serial number'
    INQUIRE_NODE_ID = 0x5E, 'inquire node id'


class State(IntEnum):
    """Whether a device takes configuration commands."""

    WAITING = 0
    CONFIGURATION = 1


class Address(NamedTuple):
    """What makes a device unique: its identity object (0x1018) with all four numbers."""

    vendor: int
    product: int
    revision: int
    serial: int

    def __str__(self) -> str:
        """Write it as the command line takes it."""
        return ' '.join(f'0x{number:08X}' for number in self)


@dataclass(frozen=True, slots=True)
class Message:
    """A message of either direction."""

    command: int  # command specifier; others than those of :class:`Command` are reserved
    parameters: bytes = bytes(MESSAGE_BYTES - 1)  # the 7 bytes behind it

    @property
    def byte(self) -> int:
        """The first parameter as UNSIGNED8: a mode, a node id, an error code."""
        return self.parameters[0]

    @property
    def number(self) -> int:
        """The first parameter as UNSIGNED32: a part of an LSS address."""
        return int.from_bytes(self.parameters[:4], 'little')

    @property
    def text(self) -> str:
        """The service in words."""
        try:
            return Command(self.command).text
        except ValueError:
            return f'unknown command 0x{self.command:02X}'

    def encode(self) -> bytes:
        """Return the 8 bytes of the frame."""
        return bytes((self.command,)) + self.parameters.ljust(MESSAGE_BYTES - 1, b'\0')


def decode(data: bytes) -> Message | None:
    """Read a message, None when it is none: each has 8 bytes."""
    return Message(data[0], data[1:]) if len(data) == MESSAGE_BYTES else None


def with_bytes(command: int, *parameters: int) -> Message:
    """Return a message whose parameters are bytes."""
    return Message(command, bytes(parameters).ljust(MESSAGE_BYTES - 1, b'\0'))


def with_number(command: int, number: int) -> Message:
    """Return a message whose parameter is an UNSIGNED32."""
    return Message(command, struct.pack('<I3x', number))


@dataclass(frozen=True, slots=True)
class FastScan:
    """A step of fast scan: devices answer whose number agrees down to a bit (CiA 305, 6.6)."""

    number: int = 0  # what is compared
    bit: int = WHOLE_NUMBER  # lowest bit that is compared, or WHOLE_NUMBER for all devices
    part: int = 0  # which number of the address: 0 vendor to 3 serial
    # part that devices take next when all bits agree; below ``part`` they are found
    following: int = 0

    def message(self) -> Message:
        """Return the question of this step, as it goes over the bus (CiA 305, fast scan)."""
        parameters = struct.pack('<IBBB', self.number, self.bit, self.part, self.following)
        return Message(Command.FAST_SCAN, parameters)


def fast_scan(message: Message) -> FastScan:
    """Read the parameters of a fast scan."""
    return FastScan(*struct.unpack('<IBBB', message.parameters))

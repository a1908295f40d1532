# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Emergency messages and their error codes (CiA 301, 7.2.7; CiA 402-1, error codes)."""

from __future__ import annotations

from dataclasses import dataclass
import struct

from ..exceptions import CodecError

ERROR_CODES: dict[int, str] = {
    0x0000: 'no error',
    0x1000: 'generic error',
    0x2110: 'short circuit or earth leakage at input',
    0x2120: 'earth leakage at input',
    0x2130: 'short circuit at input',
    0x2211: 'internal current no. 1',
    0x2214: 'over current in ramp function',
    0x2220: 'continuous over current inside the device',
    0x2230: 'short circuit or earth leakage inside the device',
    0x2310: 'continuous over current at output',
    0x2311: 'over current at output, no. 1',
    0x2312: 'over current at output, no. 2',
    0x2320: 'short circuit or earth leakage at output',
    0x2330: 'earth leakage at output',
    0x2340: 'short circuit at output',
    0x2350: 'load level fault (I2t, thermal state)',
    0x2351: 'load level warning (I2t, thermal state)',
    0x3110: 'mains over-voltage',
    0x3120: 'mains under-voltage',
    0x3130: 'phase failure',
    0x3210: 'DC link over-voltage',
    0x3220: 'DC link under-voltage',
    0x3310: 'output over-voltage',
    0x3320: 'armature circuit',
    0x3330: 'field circuit interrupted',
    0x4110: 'excess ambient temperature',
    0x4120: 'too low ambient temperature',
    0x4210: 'excess device temperature',
    0x4220: 'too low device temperature',
    0x4310: 'excess drive temperature',
    0x4320: 'too low drive temperature',
    0x5110: 'supply fault',
    0x5112: '24 V supply fault',
    0x5113: '5 V supply fault',
    0x5200: 'control circuit',
    0x5220: 'computing circuit',
    0x5300: 'operating unit',
    0x5400: 'power section',
    0x5430: 'input stages',
    0x5440: 'contacts',
    0x5441: 'safe torque off (STO) active',
    0x5530: 'non-volatile data memory',
    0x6010: 'software reset (watchdog)',
    0x6100: 'internal software',
    0x6200: 'user software',
    0x6300: 'data record',
    0x6310: 'loss of parameters',
    0x6320: 'parameter error',
    0x7100: 'power module',
    0x7110: 'brake chopper',
    0x7121: 'motor blocked',
    0x7122: 'motor error or commutation malfunction',
    0x7300: 'sensor',
    0x7303: 'resolver 1 fault',
    0x7305: 'incremental sensor 1 fault',
    0x7306: 'incremental sensor 2 fault',
    0x7310: 'speed sensor',
    0x7320: 'position sensor',
    0x7500: 'communication',
    0x7510: 'serial interface no. 1',
    0x8100: 'communication error',
    0x8110: 'CAN overrun (objects lost)',
    0x8120: 'CAN in error passive mode',
    0x8130: 'life guard or heartbeat error',
    0x8140: 'recovered from bus off',
    0x8150: 'CAN-ID collision',
    0x8210: 'PDO not processed, length error',
    0x8220: 'PDO length exceeded',
    0x8230: 'DAM MPDO not processed, destination object not available',
    0x8240: 'unexpected SYNC data length',
    0x8250: 'RPDO timeout',
    0x8311: 'excess torque',
    0x8331: 'torque fault',
    0x8400: 'velocity speed controller',
    0x8480: 'velocity speed monitoring',
    0x8500: 'position controller',
    0x8600: 'positioning controller',
    0x8611: 'following error',
    0x8612: 'reference limit',
    0x8700: 'sync controller',
    0x8A00: 'homing not completed',
    0x9000: 'external error',
    0xF001: 'deceleration',
    0xF002: 'sub-synchronous run',
    0xF004: 'control',
}
"""Error codes of 0x603F and EMCY (CiA 301, table 26; CiA 402-1, table 8)."""

ERROR_CLASSES: dict[int, str] = {
    0x00: 'no error',
    0x10: 'generic error',
    0x20: 'current',
    0x21: 'current at the input side',
    0x22: 'current inside the device',
    0x23: 'current at the output side',
    0x30: 'voltage',
    0x31: 'mains voltage',
    0x32: 'voltage inside the device',
    0x33: 'output voltage',
    0x40: 'temperature',
    0x41: 'ambient temperature',
    0x42: 'device temperature',
    0x43: 'drive temperature',
    0x50: 'device hardware',
    0x51: 'supply',
    0x60: 'device software',
    0x61: 'internal software',
    0x62: 'user software',
    0x63: 'data set',
    0x70: 'additional modules',
    0x71: 'power module',
    0x73: 'sensor',
    0x80: 'monitoring',
    0x81: 'communication',
    0x82: 'protocol error',
    0x83: 'torque control',
    0x84: 'velocity control',
    0x86: 'positioning control',
    0x90: 'external error',
    0xF0: 'additional functions',
    0xFF: 'device specific',
}
"""Classes of error codes by their high byte (CiA 301, table 26)."""

ERROR_REGISTER_BITS: tuple[str, ...] = (
    'generic',
    'current',
    'voltage',
    'temperature',
    'communication',
    'device profile specific',
    'reserved',
    'manufacturer specific',
)
"""Bits of 0x1001 (CiA 301, table 48)."""


def error_code_text(code: int) -> str:
    """Describe an error code of 0x603F or EMCY."""
    known = ERROR_CODES.get(code)
    if known is None:
        family = ERROR_CLASSES.get(code >> 8) or ERROR_CLASSES.get(code >> 8 & 0xF0)
        known = f'{family}, vendor code' if family else 'vendor code'
    return f'0x{code:04X} {known}'


def error_register_text(register: int) -> str:
    """Name the bits of the error register 0x1001."""
    names = [name for bit, name in enumerate(ERROR_REGISTER_BITS) if register >> bit & 1]
    return ', '.join(names) or 'none'


@dataclass(frozen=True, slots=True)
class Emergency:
    """An EMCY message."""

    code: int  # emergency error code; 0x00xx reports the end of an error
    register: int  # error register 0x1001
    vendor: bytes = bytes(5)  # five manufacturer-specific bytes

    @property
    def is_reset(self) -> bool:
        """The message reports that the error is gone (CiA 301, 7.2.7.1)."""
        return self.code >> 8 == 0

    def encode(self) -> bytes:
        """Return the 8 bytes of the message."""
        return struct.pack('<HB5s', self.code, self.register, self.vendor)

    @classmethod
    def decode(cls, data: bytes) -> Emergency:
        """Read a message.

        Raises:
            CodecError: It is not 8 bytes long.
        """
        if len(data) != 8:
            raise CodecError(f'an EMCY message has 8 bytes, got {len(data)}')
        return cls(*struct.unpack('<HB5s', data))

    def __str__(self) -> str:
        """Describe it."""
        vendor = f', vendor {self.vendor.hex()}' if any(self.vendor) else ''
        register = error_register_text(self.register)
        return f'{error_code_text(self.code)} (register: {register}{vendor})'

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT, TIME and EMCY messages and the identifiers of all services (CiA 301)."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta, timezone
from enum import IntEnum
from functools import partial
import struct
from typing import NamedTuple

from ..exceptions import CodecError


class NmtCommand(IntEnum):
    """Command specifier of an NMT node control frame (CiA 301, 7.2.8.3.1)."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """NMT state as a heartbeat carries it (CiA 301, 7.2.8.3.2.2)."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class ConsumerHeartbeatTime(NamedTuple):
    """An entry of 0x1016: monitored node, and its heartbeat time-out (CiA 301, 7.5.2.17)."""

    node_id: int  # node id of the producer, bits 16 to 23
    time_ms: int  # time after which it counts as lost in [ms], bits 0 to 15

    @classmethod
    def parse(cls, word: int) -> ConsumerHeartbeatTime:
        """Split the value of an entry."""
        return cls(word >> 16 & 0xFF, word & 0xFFFF)

    @property
    def word(self) -> int:
        """The value of the entry."""
        return self.node_id << 16 | self.time_ms

    @property
    def used(self) -> bool:
        """Whether it monitors a node; an entry without a time or a node id is unused."""
        return bool(self.time_ms) and NODE_ID_MIN <= self.node_id <= NODE_ID_MAX


ALL_NODES = 0

RESETS = frozenset({NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION})
"""Commands after which a device sends its boot-up message."""

COMMANDED_STATES: dict[NmtCommand, NmtState] = {
    NmtCommand.START: NmtState.OPERATIONAL,
    NmtCommand.STOP: NmtState.STOPPED,
    NmtCommand.ENTER_PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
"""States in which a device stays after a command (CiA 301, figure 48)."""


def nmt_frame(command: NmtCommand, node_id: int = ALL_NODES) -> bytes:
    """Return the data of an NMT command for one node, or for all with id 0."""
    return bytes((command, node_id))


def parse_nmt(data: bytes) -> tuple[NmtCommand, int] | None:
    """Return command and node id (0 for all) of an NMT frame; None if it is invalid."""
    if len(data) != 2:
        return None
    try:
        return NmtCommand(data[0]), data[1]
    except ValueError:
        return None


def nmt_addressee(node_id: int) -> str:
    """Describe the addressee of an NMT command."""
    return 'all nodes' if node_id == ALL_NODES else f'node {node_id}'


def parse_heartbeat(data: bytes) -> NmtState | None:
    """Return the state in a heartbeat or boot-up frame; None if it is invalid.

    Bit 7 (the toggle bit of node guarding) is ignored.
    """
    if len(data) != 1:
        return None
    try:
        return NmtState(data[0] & 0x7F)
    except ValueError:
        return None


NODE_ID_MIN = 1
NODE_ID_MAX = 127

COB_ID_INVALID = 0x8000_0000  # bit 31 of a COB-ID object: the service does not exist
COB_ID_EXTENDED = 0x2000_0000  # bit 29: 29-bit identifier
SYNC_PRODUCER = 0x4000_0000  # bit 30 of 0x1005: the device generates SYNC
TIME_PRODUCER = 0x4000_0000  # bit 30 of 0x1012: the device generates TIME
TIME_CONSUMER = 0x8000_0000  # bit 31 of 0x1012: the device takes TIME
RTR_FORBIDDEN = 0x4000_0000  # bit 30 of a TPDO's COB-ID: no remote frame may request it
PREDEFINED_MAX = 4  # PDOs of each direction with a pre-defined COB-ID
CAN_ID_MASK = 0x7FF  # 11-bit identifier

BIT_RATES_KBIT = (10, 20, 50, 100, 125, 250, 500, 800, 1000)
"""Bit rates in [kbit/s], as bus.yml and EDS files (``BaudRate_...``) name them.

Newer issues of the standard reserve 100 kbit/s, which older devices support.
"""


class CobId(IntEnum):
    """Function codes, each as the COB-ID for node 0."""

    NMT = 0x000
    SYNC = 0x080
    EMCY = 0x080
    TIME = 0x100
    TPDO1 = 0x180
    RPDO1 = 0x200
    SDO_RESPONSE = 0x580  # server to client
    SDO_REQUEST = 0x600  # client to server
    HEARTBEAT = 0x700


PREDEFINED: dict[tuple[int, int], int] = {
    (0x1014, 0): CobId.EMCY,
    **{(0x1400 + n, 1): CobId.RPDO1 + 0x100 * n for n in range(PREDEFINED_MAX)},
    **{(0x1800 + n, 1): CobId.TPDO1 + 0x100 * n for n in range(PREDEFINED_MAX)},
}
"""Function code of each configurable COB-ID, by index and sub-index."""


def _pdo_default(first: CobId, number: int, node_id: int) -> int:
    """Return the pre-defined COB-ID of PDO 1 to 4 of a node; ``first`` gives the direction.

    Raises:
        ValueError: The number is not 1 to 4; other PDOs have no pre-defined identifier.
    """
    if not 1 <= number <= PREDEFINED_MAX:
        raise ValueError(f'PDO {number} has no pre-defined COB-ID; only PDOs 1 to 4 have one')
    return first + 0x100 * (number - 1) + node_id


tpdo_default, rpdo_default = partial(_pdo_default, CobId.TPDO1), partial(_pdo_default, CobId.RPDO1)


def own_cob_id(
    address: tuple[int, int], cob_id: int, node_id: int, file_node_id: int | None
) -> int:
    """Return the COB-ID of a device whose file may give that of another node id.

    Many EDS files leave out ``$NODEID``, and a DCF may be written for another device. In the
    pre-defined connection set, a device uses the identifier of its own node id. ``file_node_id``
    is None if the file names none.
    """
    base = PREDEFINED.get(address)
    if base is None or cob_id & COB_ID_EXTENDED:
        return cob_id
    offset = (cob_id & CAN_ID_MASK) - base
    if cob_id & CAN_ID_MASK == 0 and base == CobId.EMCY:
        offset = 0
    others = range(NODE_ID_MAX + 1) if file_node_id is None else (0, file_node_id)
    if offset not in others:
        return cob_id
    return cob_id & ~CAN_ID_MASK | base + node_id


EPOCH = datetime(1984, 1, 1, tzinfo=timezone.utc)
TIME_OF_DAY = struct.Struct('<IH')  # milliseconds after midnight in 28 bits, days since 1984
MILLISECONDS_MASK = 0x0FFF_FFFF  # the upper four bits are reserved


def encode_time_of_day(moment: datetime) -> bytes:
    """Encode a date and time in 6 bytes, to the millisecond.

    Raises:
        CodecError: The date is before 1984 or after 2163.
    """
    elapsed = moment - EPOCH
    milliseconds = elapsed.seconds * 1000 + elapsed.microseconds // 1000
    try:
        return TIME_OF_DAY.pack(milliseconds, elapsed.days)
    except struct.error:
        raise CodecError(f'TIME_OF_DAY holds 1984 to 2163, not {moment:%Y-%m-%d}') from None


def decode_time_of_day(data: bytes) -> datetime:
    """Decode date and time from 6 bytes; the time zone is that of the network, UTC by default.

    Raises:
        CodecError: The data are not 6 bytes.
    """
    if len(data) != TIME_OF_DAY.size:
        raise CodecError(f'no time of day: it has 6 bytes, got {len(data)}')
    milliseconds, days = TIME_OF_DAY.unpack(data)
    return EPOCH + timedelta(days=days, milliseconds=milliseconds & MILLISECONDS_MASK)


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
        """Whether the message says that an error is gone (CiA 301, 7.2.7.1); others may remain."""
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
        """Describe the message."""
        vendor = f', vendor {self.vendor.hex()}' if any(self.vendor) else ''
        register = error_register_text(self.register)
        remain = '; others remain' if self.is_reset and self.register else ''
        return f'{error_code_text(self.code)}{remain} (register: {register}{vendor})'

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""COB-IDs of the generic pre-defined connection set (CiA 301, 7.3.3, tables 37 and 38)."""

from __future__ import annotations

from enum import IntEnum
from functools import partial

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

Newer issues of the standard reserve 100 kbit/s, which older devices have.
"""


class CobId(IntEnum):
    """Function codes as the COB-ID of node 0."""

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
"""Function code of the COB-IDs that devices may change, by index and sub-index."""


def _pdo_default(first: CobId, number: int, node_id: int) -> int:
    """Return the pre-defined COB-ID of PDO 1 to 4 of a node; the first is that of its direction.

    Raises:
        ValueError: The number is not 1 to 4; others have no pre-defined identifier.
    """
    if not 1 <= number <= PREDEFINED_MAX:
        raise ValueError(f'PDO {number} has no pre-defined COB-ID; only PDOs 1 to 4 have one')
    return first + 0x100 * (number - 1) + node_id


tpdo_default, rpdo_default = partial(_pdo_default, CobId.TPDO1), partial(_pdo_default, CobId.RPDO1)


def own_cob_id(
    address: tuple[int, int], cob_id: int, node_id: int, file_node_id: int | None
) -> int:
    """Return the COB-ID of a device whose file may give that of another node id.

    Many EDS files leave out ``$NODEID``, and a DCF may have been made for another device: of the
    pre-defined connection set a device has the identifier that its own node id gives. A file
    that names no node id has None.
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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which COB-IDs a client may write (CiA 301, 7.3.5 and 7.5.2.14, 7.5.2.35, 7.5.2.37)."""

from __future__ import annotations

from arm_canopen.standard import (
    AbortCode,
    CAN_ID_MASK,
    COB_ID_EXTENDED,
    COB_ID_INVALID,
    ObjectEntry,
)
from arm_canopen.standard.datatypes import Value

from .object_store import Integer, refusal

RESTRICTED_CAN_IDS: tuple[tuple[int, int], ...] = (
    (0x000, 0x07F),  # NMT, and reserved
    (0x101, 0x180),
    (0x581, 0x5FF),  # SDO, server to client
    (0x601, 0x67F),  # SDO, client to server
    (0x6E0, 0x6FF),
    (0x701, 0x7FF),  # NMT error control, and reserved
)
"""First and last identifier of the ranges that no configurable service may use (7.3.5)."""

FRAME_BITS = COB_ID_EXTENDED | 0x1FFF_FFFF  # bits 0 to 29: the identifier and its length


def check_can_id(entry: ObjectEntry, value: Value) -> None:
    """Refuse an identifier that is extended or set aside for other services.

    Args:
        entry: The object that shall hold the COB-ID.
        value: What a client wants to write.

    Raises:
        SdoAbortError: It is.
    """
    can_id = int(value) & FRAME_BITS if isinstance(value, int) else 0
    if can_id > CAN_ID_MASK or any(first <= can_id <= last for first, last in RESTRICTED_CAN_IDS):
        raise refusal(AbortCode.VALUE_RANGE, entry)


def check_cob_id(variable: Integer, value: Value) -> None:
    """Refuse a COB-ID that the service behind an object cannot take.

    An identifier may only be changed while the service does not exist (bit 31 is set).

    Args:
        variable: The object that holds the COB-ID.
        value: What a client wants to write.

    Raises:
        SdoAbortError: The identifier is restricted, extended, or in use.
    """
    word = int(value) if isinstance(value, int) else 0
    if word & COB_ID_INVALID:
        return
    in_use = not variable.value & COB_ID_INVALID
    if in_use and (word ^ variable.value) & FRAME_BITS:
        raise refusal(AbortCode.VALUE_RANGE, variable.entry)
    check_can_id(variable.entry, value)

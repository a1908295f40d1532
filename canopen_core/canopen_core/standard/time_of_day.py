# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The data type TIME_OF_DAY, as the TIME message carries it (CiA 301, 7.1.6.6)."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
import struct

from ..exceptions import CodecError

EPOCH = datetime(1984, 1, 1, tzinfo=timezone.utc)
TIME_OF_DAY = struct.Struct('<IH')  # milliseconds after midnight in 28 bits, days since 1984
MILLISECONDS_MASK = 0x0FFF_FFFF  # the upper four bits are reserved


def encode_time_of_day(moment: datetime) -> bytes:
    """Return the 6 bytes of a moment, to the millisecond.

    Raises:
        CodecError: It is before 1984 or after 2163.
    """
    elapsed = moment - EPOCH
    milliseconds = elapsed.seconds * 1000 + elapsed.microseconds // 1000
    try:
        return TIME_OF_DAY.pack(milliseconds, elapsed.days)
    except struct.error:
        raise CodecError(f'TIME_OF_DAY holds 1984 to 2163, not {moment:%Y-%m-%d}') from None


def decode_time_of_day(data: bytes) -> datetime:
    """Return the moment in 6 bytes; the time zone is that of the network, UTC by default.

    Raises:
        CodecError: It has not 6 bytes.
    """
    if len(data) != TIME_OF_DAY.size:
        raise CodecError(f'no time of day: it has 6 bytes, got {len(data)}')
    milliseconds, days = TIME_OF_DAY.unpack(data)
    return EPOCH + timedelta(days=days, milliseconds=milliseconds & MILLISECONDS_MASK)

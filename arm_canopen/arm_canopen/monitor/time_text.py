# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The TIME message in words (CiA 301, 7.2.6 and 7.1.6.6)."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
import struct

_EPOCH = datetime(1984, 1, 1, tzinfo=timezone.utc)
_TIME_OF_DAY = struct.Struct('<IH')  # milliseconds after midnight in 28 bits, days since 1984
_MILLISECONDS_MASK = 0x0FFF_FFFF


def time_of_day_text(data: bytes) -> str:
    """Say a TIME_OF_DAY as date and time, as far as its bytes are there."""
    if len(data) != _TIME_OF_DAY.size:
        return f'no time of day: it has 6 bytes, got {len(data)}'
    milliseconds, days = _TIME_OF_DAY.unpack(data)
    moment = _EPOCH + timedelta(days=days, milliseconds=milliseconds & _MILLISECONDS_MASK)
    return moment.strftime('%Y-%m-%d %H:%M:%S.') + f'{moment.microsecond // 1000:03d}'

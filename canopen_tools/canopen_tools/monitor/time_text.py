# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The TIME message in words (CiA 301, 7.2.6)."""

from __future__ import annotations

from arm_canopen.exceptions import CodecError
from arm_canopen.standard.time_of_day import decode_time_of_day


def time_of_day_text(data: bytes) -> str:
    """Return a TIME_OF_DAY as date and time, or why it is none."""
    try:
        moment = decode_time_of_day(data)
    except CodecError as error:
        return str(error)
    return moment.strftime('%Y-%m-%d %H:%M:%S.') + f'{moment.microsecond // 1000:03d}'

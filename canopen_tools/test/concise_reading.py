# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading concise DCFs back, for tests of what writes them."""

from __future__ import annotations

import struct

from arm_canopen.config.model import SdoWrite

COUNT = struct.Struct('<I')
ENTRY = struct.Struct('<HBI')


class IncompleteError(ValueError):
    """The bytes are no concise DCF."""


def decode_concise(data: bytes) -> list[SdoWrite]:
    """Read a concise DCF.

    Raises:
        IncompleteError: It ends too early, or goes on behind its end.
    """
    if len(data) < COUNT.size:
        raise IncompleteError(f'a concise DCF has at least {COUNT.size} bytes, got {len(data)}')
    (count,) = COUNT.unpack_from(data)
    position = COUNT.size
    writes: list[SdoWrite] = []
    while len(writes) < count:
        start = position + ENTRY.size
        if start > len(data):
            raise IncompleteError(
                f'the concise DCF ends within entry {len(writes) + 1} of {count}'
            )
        index, subindex, size = ENTRY.unpack_from(data, position)
        position = start + size
        if position > len(data):
            raise IncompleteError(f'the concise DCF ends within the data of 0x{index:04X}')
        writes.append(SdoWrite(index, subindex, data[start:position]))
    if position != len(data):
        raise IncompleteError(
            f'{len(data) - position} bytes stand behind the last of {count} entries'
        )
    return writes

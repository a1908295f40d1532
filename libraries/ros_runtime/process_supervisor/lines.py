# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bytes of a pipe to lines of text."""

from __future__ import annotations

LONGEST_LINE = 16384
"""Bytes after which a line is cut: a process that never ends a line must not eat the memory."""


class LineSplitter:
    """Collects bytes and gives back whole lines."""

    def __init__(self) -> None:
        self._rest = b''

    def feed(self, data: bytes) -> list[str]:
        """Take in bytes.

        Args:
            data: As they were read; may end anywhere, also inside a character.
        """
        *lines, rest = (self._rest + data).split(b'\n')
        while len(rest) > LONGEST_LINE:
            lines.append(rest[:LONGEST_LINE])
            rest = rest[LONGEST_LINE:]
        self._rest = rest
        return [_decode(line) for line in lines]

    def flush(self) -> list[str]:
        """Give back what is left when the pipe has ended: a line without an end, or nothing."""
        rest, self._rest = self._rest, b''
        return [_decode(rest)] if rest else []


def _decode(line: bytes) -> str:
    return line.decode(errors='replace').rstrip('\r')

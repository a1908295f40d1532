# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Follows SDO block transfers, whose segments have no command byte (CiA 301, 7.2.4.3.9 to 18).

Without this their payload would be read as commands.
"""

from __future__ import annotations

from .object_names import ObjectNames

_DOWNLOAD_CLIENT, _UPLOAD_CLIENT = 6, 5  # client command specifiers
_DOWNLOAD_SERVER, _UPLOAD_SERVER = 5, 6  # server command specifiers
_ABORT = 0x80  # as a segment it would have number 0, which there is not
_LAST = 0x80
_FRAME_SIZE = 8  # [byte]


class BlockFollower:
    """Describes block transfers of one device; frames of others it ignores."""

    def __init__(self, names: ObjectNames) -> None:
        self._names = names
        self._title = ''
        self._block_size = 0
        self._last_number: int | None = None  # of the segment that is marked as the last
        self._client_streams = False
        self._server_streams = False

    def request(self, data: bytes) -> str | None:
        """Put a frame to the device into words; None when it is of no block transfer."""
        if len(data) != _FRAME_SIZE:
            return None
        if self._client_streams and data[0] != _ABORT:
            text, self._client_streams = self._segment(data)
            return text
        specifier, sub = data[0] >> 5, data[0] & 0x03
        if specifier == _DOWNLOAD_CLIENT:
            if sub & 0x01:
                return f'end of block write {self._title}'
            self._begin(data)
            size = f', {int.from_bytes(data[4:], "little")} bytes' if sub & 0x02 else ''
            return f'block write {self._title}{size}'
        if specifier != _UPLOAD_CLIENT:
            self._stop()
            return None
        return self._upload_request(data, sub)

    def _upload_request(self, data: bytes, sub: int) -> str:
        if sub == 0:
            self._begin(data)
            self._block_size = data[4]
            return f'block read {self._title}, {data[4]} segments a block'
        if sub == 1:
            return f'end of block read {self._title}'
        self._server_streams = sub == 3 or not self._is_complete(data[1])
        if sub == 3:
            return f'start block read {self._title}'
        self._block_size = data[2]
        return f'block taken up to segment {data[1]}, {data[2]} segments next'

    def response(self, data: bytes) -> str | None:
        """Put a frame from the device into words; None when it is of no block transfer."""
        if len(data) != _FRAME_SIZE:
            return None
        if self._server_streams and data[0] != _ABORT:
            text, self._server_streams = self._segment(data)
            return text
        specifier, sub = data[0] >> 5, data[0] & 0x03
        if specifier == _DOWNLOAD_SERVER:
            return self._download_response(data, sub)
        if specifier != _UPLOAD_SERVER:
            self._stop()
            return None
        if sub & 0x01:
            return f'end of block read {self._title}'
        size = f', {int.from_bytes(data[4:], "little")} bytes' if sub & 0x02 else ''
        return f'block read {self._title}{size}'

    def _download_response(self, data: bytes, sub: int) -> str:
        if sub == 0:
            self._block_size, self._client_streams = data[4], True
            return f'block write {self._title}, {data[4]} segments a block'
        if sub == 1:
            return f'accepts block write {self._title}'
        self._client_streams = not self._is_complete(data[1])
        self._block_size = data[2]
        return f'block taken up to segment {data[1]}, {data[2]} segments next'

    def _begin(self, data: bytes) -> None:
        self._stop()
        self._title = self._names.title(int.from_bytes(data[1:3], 'little'), data[3])

    def _stop(self) -> None:
        self._client_streams = self._server_streams = False
        self._last_number = None

    def _segment(self, data: bytes) -> tuple[str, bool]:
        """Return the text of a segment, and whether more come before an answer."""
        number, is_last = data[0] & 0x7F, bool(data[0] & _LAST)
        self._last_number = number if is_last else None
        text = f'{"last " if is_last else ""}block segment {number} of {self._title}'
        return text, not is_last and number < self._block_size

    def _is_complete(self, acknowledged: int) -> bool:
        return self._last_number is not None and acknowledged == self._last_number

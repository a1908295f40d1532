# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Follows the SDO transfers of one device, so that segments and answers are shown with the object.

CiA 301, 7.2.4.3. A device has one default SDO channel, so one transfer is on at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

from canopen_core import CodecError
from canopen_core.standard import abort_text, sdo

from .object_names import ObjectNames
from .value_text import data_text

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


@dataclass(frozen=True, slots=True)
class SdoText:
    """A frame of a transfer in words."""

    text: str  # the words
    is_abort: bool = False  # somebody ended the transfer


class _Transfer:
    """A segmented transfer on its way."""

    def __init__(self, index: int, subindex: int, size: int | None) -> None:
        self.index = index
        self.subindex = subindex
        self.size = size
        self.data = b''

    def take(self, segment: sdo.Segment) -> str:
        """Add a segment and return how far it is."""
        self.data += segment.data
        total = f' of {self.size}' if self.size is not None else ''
        return f'{len(segment.data)} bytes ({len(self.data)}{total})'


class SdoFollower:
    """Puts the SDO frames of one device into words."""

    def __init__(self, names: ObjectNames) -> None:
        self._names = names
        self._transfer: _Transfer | None = None
        self._block = BlockFollower(names)

    def request(self, data: bytes) -> SdoText:
        """Put a frame to the device into words."""
        block = self._block.request(data)
        if block is not None:
            return SdoText(block)
        try:
            message = sdo.decode_request(data)
        except CodecError as error:
            return SdoText(str(error))
        match message:
            case sdo.UploadRequest(index, subindex):
                self._transfer = None
                return SdoText(f'read {self._names.title(index, subindex)}')
            case sdo.DownloadRequest(index, subindex, content, size):
                return SdoText(f'write {self._initiated(index, subindex, content, size)}')
            case sdo.Segment():
                return SdoText(self._segment(message))
            case sdo.UploadSegmentRequest():
                return SdoText(f'next segment{self._of_transfer()}')
            case sdo.Abort():
                return self._abort(message)

    def response(self, data: bytes) -> SdoText:
        """Put a frame from the device into words."""
        block = self._block.response(data)
        if block is not None:
            return SdoText(block)
        try:
            message = sdo.decode_response(data)
        except CodecError as error:
            return SdoText(str(error))
        step = self._answer(message)
        if len(data) == sdo.FRAME_BYTES:
            return step
        return SdoText(f'{step.text} ({len(data)} bytes instead of 8)', step.is_abort)

    def _answer(self, message: sdo.Response) -> SdoText:
        match message:
            case sdo.UploadResponse(index, subindex, content, size):
                return SdoText(self._initiated(index, subindex, content, size))
            case sdo.DownloadResponse(index, subindex):
                return SdoText(f'accepts {self._names.title(index, subindex)}')
            case sdo.Segment():
                return SdoText(self._segment(message))
            case sdo.DownloadSegmentResponse():
                return SdoText(f'segment taken{self._of_transfer()}')
            case sdo.Abort():
                return self._abort(message)

    def _initiated(
        self, index: int, subindex: int, content: bytes | None, size: int | None
    ) -> str:
        title = self._names.title(index, subindex)
        if content is not None:
            self._transfer = None
            return f'{title} = {self._value(index, subindex, content)}'
        self._transfer = _Transfer(index, subindex, size)
        return f'{title}, {size} bytes in segments' if size is not None else f'{title} in segments'

    def _segment(self, segment: sdo.Segment) -> str:
        transfer = self._transfer
        if transfer is None:
            return f'segment of a transfer whose start was not seen, {len(segment.data)} bytes'
        progress = transfer.take(segment)
        if not segment.last:
            return f'segment{self._of_transfer()}, {progress}'
        self._transfer = None
        value = self._value(transfer.index, transfer.subindex, transfer.data)
        return f'last segment, {self._names.title(transfer.index, transfer.subindex)} = {value}'

    def _of_transfer(self) -> str:
        if self._transfer is None:
            return ''
        return f' of {self._names.title(self._transfer.index, self._transfer.subindex)}'

    def _value(self, index: int, subindex: int, data: bytes) -> str:
        return data_text(index, subindex, self._names.data_type(index, subindex), data)

    def _abort(self, message: sdo.Abort) -> SdoText:
        self._transfer = None
        title = self._names.title(message.index, message.subindex)
        return SdoText(f'abort {title}: {abort_text(message.code)}', is_abort=True)

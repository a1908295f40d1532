# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Follows the SDO transfers of one device, so that segments and answers are shown with the object.

CiA 301, 7.2.4.3. A device has one default SDO channel, so one transfer is on at a time.
"""

from __future__ import annotations

from dataclasses import dataclass

from arm_canopen import CodecError
from arm_canopen.standard import (
    abort_text,
    decode_request,
    decode_response,
    DownloadRequest,
    DownloadResponse,
    DownloadSegmentResponse,
    FRAME_BYTES,
    UploadRequest,
    UploadResponse,
    UploadSegmentRequest,
)
from arm_canopen.standard.sdo import Abort, Response, Segment

from .object_names import ObjectNames
from .sdo_block import BlockFollower
from .value_text import data_text


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

    def take(self, segment: Segment) -> str:
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
            message = decode_request(data)
        except CodecError as error:
            return SdoText(str(error))
        match message:
            case UploadRequest(index, subindex):
                self._transfer = None
                return SdoText(f'read {self._names.title(index, subindex)}')
            case DownloadRequest(index, subindex, content, size):
                return SdoText(f'write {self._initiated(index, subindex, content, size)}')
            case Segment():
                return SdoText(self._segment(message))
            case UploadSegmentRequest():
                return SdoText(f'next segment{self._of_transfer()}')
            case Abort():
                return self._abort(message)

    def response(self, data: bytes) -> SdoText:
        """Put a frame from the device into words."""
        block = self._block.response(data)
        if block is not None:
            return SdoText(block)
        try:
            message = decode_response(data)
        except CodecError as error:
            return SdoText(str(error))
        step = self._answer(message)
        if len(data) == FRAME_BYTES:
            return step
        return SdoText(f'{step.text} ({len(data)} bytes instead of 8)', step.is_abort)

    def _answer(self, message: Response) -> SdoText:
        match message:
            case UploadResponse(index, subindex, content, size):
                return SdoText(self._initiated(index, subindex, content, size))
            case DownloadResponse(index, subindex):
                return SdoText(f'accepts {self._names.title(index, subindex)}')
            case Segment():
                return SdoText(self._segment(message))
            case DownloadSegmentResponse():
                return SdoText(f'segment taken{self._of_transfer()}')
            case Abort():
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

    def _segment(self, segment: Segment) -> str:
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

    def _abort(self, message: Abort) -> SdoText:
        self._transfer = None
        title = self._names.title(message.index, message.subindex)
        return SdoText(f'abort {title}: {abort_text(message.code)}', is_abort=True)

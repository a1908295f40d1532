# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Text for objects, their values and SDO transfers.

Transfers are tracked, so that segments and answers are shown with the object (CiA 301, 7.2.4.3).
A device has one default SDO channel, so only one transfer runs at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from canopen_core import CodecError
from canopen_core.standard import (
    abort_text,
    CAN_ID_MASK,
    COB_ID_INVALID,
    ConsumerHeartbeatTime,
    Controlword,
    DataType,
    decode,
    drive_state,
    error_code_text,
    error_register_text,
    Index,
    is_signed,
    mapped_place,
    mode_title,
    object_address,
    ObjectDictionary,
    pdo_object,
    sdo,
    Value,
)

_STANDARD_NAMES: dict[int, str] = {
    index: index.name.replace('_', ' ').capitalize() for index in Index
}


class ObjectNames:
    """Names and types of the objects of one device."""

    def __init__(self, dictionary: ObjectDictionary | None = None) -> None:
        """Use names from a dictionary; without one those of the standard."""
        self._dictionary = dictionary

    def name(self, index: int, subindex: int) -> str:
        """Return the name of an object; empty if unknown."""
        entry = self._dictionary.get(index, subindex) if self._dictionary else None
        return entry.name if entry else _standard_name(index)

    def title(self, index: int, subindex: int) -> str:
        """Return address and name, e.g. ``0x6041:00 Statusword``."""
        return f'{object_address(index, subindex)} {self.name(index, subindex)}'.rstrip()

    def data_type(self, index: int, subindex: int) -> DataType | None:
        """Return the type of an object; None if unknown."""
        entry = self._dictionary.get(index, subindex) if self._dictionary else None
        return entry.data_type if entry else None


def _standard_name(index: int) -> str:
    if pdo := pdo_object(index):
        what = 'mapping' if pdo.is_mapping else 'communication'
        return f'{pdo.direction.upper()}{pdo.number} {what}'
    return _STANDARD_NAMES.get(index, '')


CONTROLWORD_COMMANDS: tuple[tuple[int, int, str], ...] = (
    (0x80, 0x80, 'Fault reset'),
    (0x02, 0x00, 'Disable voltage'),
    (0x06, 0x02, 'Quick stop'),
    (0x07, 0x06, 'Shutdown'),
    (0x0F, 0x07, 'Switch on'),
    (0x0F, 0x0F, 'Enable operation'),
)
"""Mask, value and command; the first match applies (CiA 402-2, table 26)."""

_SIGNED_TYPES = {1: DataType.INTEGER8, 2: DataType.INTEGER16, 4: DataType.INTEGER32}
_UNSIGNED_TYPES = {1: DataType.UNSIGNED8, 2: DataType.UNSIGNED16, 4: DataType.UNSIGNED32}
_SIGNED_OBJECTS = frozenset(
    {
        Index.QUICK_STOP_OPTION,
        Index.MODE_OF_OPERATION,
        Index.MODE_OF_OPERATION_DISPLAY,
        Index.POSITION_DEMAND,
        Index.VELOCITY_DEMAND,
        Index.HOME_OFFSET,
        Index.SOFTWARE_POSITION_LIMIT,
        Index.HOMING_METHOD,
        Index.FOLLOWING_ERROR,
    }
)
"""Signed objects other than targets and actual values, used without EDS (CiA 402-2)."""

_COB_ID_SUBINDEX = 1  # in PDO communication parameters (CiA 301, 7.5.2.35)


def controlword_text(word: int) -> str:
    """Return a controlword as text: its command, halt, and mode-specific bits."""
    command = next(
        (text for mask, value, text in CONTROLWORD_COMMANDS if word & mask == value), ''
    )
    extra = [f'bit {bit}' for bit in (4, 5, 6, 9) if word >> bit & 1]
    if word & Controlword.HALT:
        extra.append('halt')
    return ', '.join([f'0x{word:04X} {command}'.rstrip(), *extra])


def _cob_id_text(cob_id: int) -> str:
    disabled = ' disabled' if cob_id & COB_ID_INVALID else ''
    return f'0x{cob_id & CAN_ID_MASK:03X}{disabled}'


def _mapping_text(word: int) -> str:
    index, subindex, bits = mapped_place(word)
    return f'{object_address(index, subindex)} ({bits} bit)'


def _mode_text(number: int) -> str:
    return f'{number} {mode_title(number)}'


def _hex_text(number: int) -> str:
    return f'0x{number:08X}'


def _consumer_text(word: int) -> str:
    entry = ConsumerHeartbeatTime.parse(word)
    return f'node {entry.node_id}, {entry.time_ms} ms'


_TEXTS: dict[int, Callable[[int], str]] = {
    Index.CONTROLWORD: controlword_text,
    Index.STATUSWORD: lambda word: f'0x{word:04X} {drive_state(word).title}',
    Index.MODE_OF_OPERATION: _mode_text,
    Index.MODE_OF_OPERATION_DISPLAY: _mode_text,
    Index.ERROR_CODE: error_code_text,
    Index.ERROR_REGISTER: lambda bits: f'0x{bits:02X} {error_register_text(bits)}',
    Index.DEVICE_TYPE: _hex_text,
    Index.SYNC_COB_ID: _cob_id_text,
    Index.EMCY_COB_ID: _cob_id_text,
}
_RECORD_TEXTS: dict[int, Callable[[int], str]] = {
    Index.PREDEFINED_ERROR_FIELD: lambda code: error_code_text(code & 0xFFFF),
    Index.IDENTITY: _hex_text,
    Index.CONSUMER_HEARTBEAT: _consumer_text,
}
"""The same for sub-indices from 1."""


def value_text(index: int, subindex: int, value: Value) -> str:
    """Format a decoded value as text."""
    if isinstance(value, bytes):
        return value.hex(' ') or 'nothing'
    if isinstance(value, str):
        # escape line breaks and terminal control codes; devices may send anything
        text = value.rstrip(chr(0))
        shown = (c if c.isprintable() else c.encode('unicode_escape').decode() for c in text)
        return f'"{"".join(shown)}"'
    if isinstance(value, float):
        return f'{value:.7g}'
    words = _text_of(index, subindex)
    return words(value) if words else str(value)


def _text_of(index: int, subindex: int) -> Callable[[int], str] | None:
    pdo = pdo_object(index)
    if pdo is not None and not pdo.is_mapping:
        return _cob_id_text if subindex == _COB_ID_SUBINDEX else None
    if not subindex:
        return _TEXTS.get(index)
    return _RECORD_TEXTS.get(index) if pdo is None else _mapping_text


def data_text(index: int, subindex: int, data_type: DataType | None, data: bytes) -> str:
    """Format the bytes of an SDO as text; expedited data may be longer than their type.

    data_type is None if the EDS does not have the object.
    """
    if data_type is None:
        signed = index in _SIGNED_OBJECTS or is_signed(index, subindex)
        data_type = (_SIGNED_TYPES if signed else _UNSIGNED_TYPES).get(len(data))
    if data_type is None:
        return data.hex(' ') or 'nothing'
    try:
        value = decode(data_type, sdo.fitted(data_type, data))
    except CodecError as error:
        return f'{data.hex(" ")} ({error})'
    return value_text(index, subindex, value)


_BLOCK_SENDER, _BLOCK_RECEIVER = 6, 5  # command specifiers of the sides of a block transfer
_ABORT = 0x80  # no segment: their numbers start at 1
_LAST = 0x80
_FRAME_SIZE = 8  # [byte]


@dataclass(frozen=True, slots=True)
class SdoText:
    """Text for one frame of a transfer."""

    text: str  # the words
    is_abort: bool = False  # one side aborted the transfer


class SdoFollower:
    """Describes the SDO frames of one device as text."""

    def __init__(self, names: ObjectNames) -> None:
        self._names = names
        self._object: tuple[int, int] | None = None  # of the current segmented transfer
        self._size: int | None = None  # its size in [byte], if announced
        self._data = b''  # its data so far
        self._block_title = ''  # object of a block transfer
        self._block_size = 0  # segments per acknowledgement
        self._block_last: int | None = None  # number of the segment marked as last
        self._sends_block: bool | None = None  # True: client sends segments, False: device

    def request(self, data: bytes) -> SdoText:
        """Describe a frame to the device."""
        if block := self._block(data, from_client=True):
            return SdoText(block)
        try:
            message = sdo.decode_request(data)
        except CodecError as error:
            return SdoText(str(error))
        match message:
            case sdo.UploadRequest(index, subindex):
                self._object = None
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
        """Describe a frame from the device."""
        if block := self._block(data, from_client=False):
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

    def _block(self, data: bytes, *, from_client: bool) -> str:
        """Describe a frame of a block transfer; return an empty text for other frames."""
        if len(data) != _FRAME_SIZE:
            return ''
        if self._sends_block is from_client and data[0] != _ABORT:
            number, is_last = data[0] & ~_LAST, bool(data[0] & _LAST)
            self._block_last = number if is_last else None
            if is_last or number >= self._block_size:
                self._sends_block = None
            return f'{"last " * is_last}block segment {number} of {self._block_title}'
        specifier, sub = data[0] >> 5, data[0] & 0x03
        if specifier not in {_BLOCK_SENDER, _BLOCK_RECEIVER}:
            self._sends_block = None
            return ''
        verb = 'write' if (specifier == _BLOCK_SENDER) is from_client else 'read'
        if from_client and (sub == 0 or (sub == 2 and specifier == _BLOCK_SENDER)):
            self._sends_block = self._block_last = None
            self._block_title = self._names.title(int.from_bytes(data[1:3], 'little'), data[3])
        what = f'block {verb} {self._block_title}'
        if specifier == _BLOCK_SENDER:
            size = f', {int.from_bytes(data[4:], "little")} bytes' if sub & 0x02 else ''
            return f'end of {what}' if sub & 0x01 else f'{what}{size}'
        if sub == 1:
            return f'{"end of" if from_client else "accepts"} {what}'
        if sub == 0:
            self._block_size = data[4]
            self._sends_block = None if from_client else True
            return f'{what}, {data[4]} segments a block'
        if sub == 3 and from_client:
            self._sends_block = False
            return f'start {what}'
        self._sends_block = None if data[1] == self._block_last else not from_client
        self._block_size = data[2]
        return f'block taken up to segment {data[1]}, {data[2]} segments next'

    def _initiated(
        self, index: int, subindex: int, content: bytes | None, size: int | None
    ) -> str:
        title = self._names.title(index, subindex)
        if content is not None:
            self._object = None
            return f'{title} = {self._value(index, subindex, content)}'
        self._object, self._size, self._data = (index, subindex), size, b''
        return f'{title}, {size} bytes in segments' if size is not None else f'{title} in segments'

    def _segment(self, segment: sdo.Segment) -> str:
        size = len(segment.data)
        if self._object is None:
            return f'segment of a transfer whose start was not seen, {size} bytes'
        self._data += segment.data
        if not segment.last:
            total = f' of {self._size}' if self._size is not None else ''
            return f'segment{self._of_transfer()}, {size} bytes ({len(self._data)}{total})'
        index, subindex = self._object
        self._object = None
        value = self._value(index, subindex, self._data)
        return f'last segment, {self._names.title(index, subindex)} = {value}'

    def _of_transfer(self) -> str:
        return f' of {self._names.title(*self._object)}' if self._object else ''

    def _value(self, index: int, subindex: int, data: bytes) -> str:
        return data_text(index, subindex, self._names.data_type(index, subindex), data)

    def _abort(self, message: sdo.Abort) -> SdoText:
        self._object = None
        title = self._names.title(message.index, message.subindex)
        return SdoText(f'abort {title}: {abort_text(message.code)}', is_abort=True)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO servers of a device: expedited, segmented and block transfers (CiA 301, 7.2.4.3).

One transfer at a time, as in the standard for one SDO channel: initiating another transfer ends
the first one. A frame that is invalid in the present state raises SdoAbortError.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
import struct

from canopen_core import CodecError, SdoAbortError
from canopen_core.can import Frame
from canopen_core.standard import AbortCode, CAN_ID_MASK, COB_ID_INVALID, CobId, Index, sdo

from .object_store import check_cob_id, NEVER, ObjectStore, refusal, STRING_BYTES_MAX


class BlockDownload:
    """A block transfer in which a client writes."""

    def __init__(self, request: bytes) -> None:
        command, self.index, self.subindex, size = struct.unpack('<BHBI', request)
        self.size: int | None = size if command & sdo.SIZE_BIT else None
        self.streaming = True  # the client sends segments, which have no command byte
        self.data = bytearray()  # what has come, after :meth:`end` without padding
        self._with_crc = bool(command & sdo.CRC_BIT)
        self._sequence = 0
        self._finished = False

    def initiated(self) -> bytes:
        """Return the response to the initiation."""
        return struct.pack(
            '<BHBB3x',
            sdo.DOWNLOAD_INITIATED | sdo.CRC_BIT,
            self.index,
            self.subindex,
            sdo.BLOCK_SEGMENTS_MAX,
        )

    def segment(self, frame: bytes) -> bytes | None:
        """Receive a segment; after the last of a block, acknowledge those received in order."""
        number, last = frame[0] & ~sdo.LAST, bool(frame[0] & sdo.LAST)
        if number == 0:
            raise refusal(AbortCode.SEQUENCE_NUMBER, 'SDO block')
        in_order = number == self._sequence + 1
        if in_order:
            self._sequence = number
            self.data += frame[1:]
            limit = STRING_BYTES_MAX if self.size is None else self.size
            if len(self.data) - sdo.SEGMENT_BYTES >= max(limit, 1):
                raise refusal(AbortCode.LENGTH_HIGH, 'SDO block')
        if not last and number < sdo.BLOCK_SEGMENTS_MAX:
            return None
        self._finished = last and in_order
        self.streaming = not self._finished
        taken, self._sequence = self._sequence, 0
        return struct.pack('<BBB5x', sdo.DOWNLOAD_ACKNOWLEDGED, taken, sdo.BLOCK_SEGMENTS_MAX)

    def end(self, request: bytes) -> bytes:
        """Process the client's end frame; check length and checksum, and return the response."""
        if not self._finished:
            raise refusal(AbortCode.COMMAND_SPECIFIER, 'SDO block')
        command, crc = struct.unpack_from('<BH', request)
        unused = command >> 2 & 0x07
        del self.data[len(self.data) - unused :]
        if self._with_crc and crc != sdo.checksum(bytes(self.data)):
            raise refusal(AbortCode.CRC, 'SDO block')
        if self.size is not None and len(self.data) != self.size:
            low = len(self.data) < self.size
            raise refusal(AbortCode.LENGTH_LOW if low else AbortCode.LENGTH_HIGH, 'SDO block')
        return bytes((sdo.DOWNLOAD_ENDED,)) + bytes(7)


class BlockUpload:
    """A block transfer in which a client reads."""

    def __init__(self, request: bytes, data: bytes) -> None:
        """Start from the client's initiation, with the data of the object."""
        command, self.index, self.subindex, segments = struct.unpack_from('<BHBB', request)
        self.finished = False  # the client has confirmed the end
        self._data = data
        self._with_crc = bool(command & sdo.CRC_BIT)
        self._position = 0  # [byte] up to which the client has everything
        self._sent = 0  # segments of the present block
        self._segments = 0
        self._ended = False
        self._set_block(segments)

    def initiated(self) -> bytes:
        """Return the response to the initiation."""
        command = sdo.UPLOAD_INITIATED | sdo.SIZE_BIT | sdo.CRC_BIT
        return struct.pack('<BHBI', command, self.index, self.subindex, len(self._data))

    def proceed(self, request: bytes) -> list[bytes]:
        """Process a frame of the client within the transfer; return the response."""
        subcommand = request[0] & 0x03
        if subcommand == sdo.START_UPLOAD and not self._sent and not self._position:
            return self._block()
        if subcommand == sdo.ACKNOWLEDGE_UPLOAD and self._sent:
            return self._acknowledged(request[1], request[2])
        if subcommand == sdo.END_UPLOAD and self._ended:
            self.finished = True
            return []
        raise refusal(AbortCode.COMMAND_SPECIFIER, 'SDO block')

    def _acknowledged(self, taken: int, segments: int) -> list[bytes]:
        if taken > self._sent:
            raise refusal(AbortCode.SEQUENCE_NUMBER, 'SDO block')
        self._position += taken * sdo.SEGMENT_BYTES
        complete = taken == self._sent and self._position >= len(self._data)
        self._sent = 0
        if complete:
            self._ended = True
            return [sdo.end_frame(sdo.UPLOAD_END, self._data, with_crc=self._with_crc)]
        self._set_block(segments)
        return self._block()

    def _set_block(self, segments: int) -> None:
        if not 1 <= segments <= sdo.BLOCK_SEGMENTS_MAX:
            raise refusal(AbortCode.BLOCK_SIZE, 'SDO block')
        self._segments = segments

    def _block(self) -> list[bytes]:
        frames = sdo.block_frames(self._data, self._position, self._segments)
        self._sent = len(frames)
        return frames


FRAME_BYTES = 8  # [byte] shorter frames are no SDO
ABORT = 0x80  # command byte of an abort
CHANNELS_MAX = 128  # SDO servers of a device (CiA 301, 7.5.2.33)
SILENCE_MAX = 1.0  # [s] how long a client may pause within a transfer

Answer = (
    sdo.Abort
    | sdo.DownloadResponse
    | sdo.DownloadSegmentResponse
    | sdo.Segment
    | sdo.UploadResponse
)


@dataclass(slots=True)
class Transfer:
    """A segmented transfer under way."""

    index: int  # object index
    subindex: int  # sub-index
    is_download: bool  # the client writes
    data: bytearray = field(default_factory=bytearray)  # what is sent, or was received so far
    # announced length of a download in [byte], None when it was not announced
    size: int | None = None
    position: int = 0  # number of bytes of an upload that were sent
    toggle: bool = False  # toggle bit of the next segment


class SdoServer:
    """Serves one SDO channel of a device."""

    def __init__(
        self, can_id: int, response_id: int, store: ObjectStore, send: Callable[[Frame], None]
    ) -> None:
        self.can_id = can_id  # identifier of the requests
        self.response_id = response_id  # identifier of the answers
        self.deadline = NEVER  # steady time in [s] at which a silent client's transfer is aborted
        self._store = store
        self._send = send
        self._transfer: Transfer | BlockDownload | BlockUpload | None = None

    def reset(self) -> None:
        """Drop the transfer under way."""
        self._transfer = None
        self.deadline = NEVER

    def receive(self, frame: Frame, now: float) -> None:
        """Respond to a request."""
        if len(frame.data) < FRAME_BYTES:
            return
        answers = self._answer(frame.data, now)
        self.deadline = now + SILENCE_MAX if self._transfer else NEVER
        for answer in answers:
            self._send(Frame(self.response_id, answer))

    def advance(self, now: float) -> None:
        """Abort the transfer of a client that timed out."""
        if now < self.deadline:
            return
        transfer = self._transfer
        self.reset()
        if transfer is not None:
            abort = sdo.Abort(transfer.index, transfer.subindex, AbortCode.TIMED_OUT)
            self._send(Frame(self.response_id, abort.encode()))

    def _answer(self, data: bytes, now: float) -> list[bytes]:
        """Return the response; an abort names the object of the request, else of the transfer."""
        transfer, specifier = self._transfer, data[0] >> 5
        is_block = specifier in (sdo.CLIENT_UPLOAD, sdo.CLIENT_DOWNLOAD)
        names_none = specifier in (0, 3) or (is_block and data[0] & 0x03)
        index, subindex = struct.unpack_from('<xHB', data)
        streams = isinstance(transfer, BlockDownload) and transfer.streaming
        if names_none or streams:
            index, subindex = (transfer.index, transfer.subindex) if transfer else (0, 0)
        try:
            if isinstance(transfer, BlockDownload) and streams and data[0] != ABORT:
                answer = transfer.segment(data)
                return [answer] if answer is not None else []
            if is_block:
                return self._block(data, now)
            response = self._dispatch(data, now)
        except SdoAbortError as error:
            self._transfer = None
            return [sdo.Abort(index, subindex, error.code).encode()]
        return [response.encode()] if response is not None else []

    def _block(self, data: bytes, now: float) -> list[bytes]:
        if data[0] >> 5 == sdo.CLIENT_DOWNLOAD:
            return [self._block_download(data, now)]
        if not data[0] & 0x03:
            return [self._start_block_upload(data)]
        transfer = self._transfer
        if not isinstance(transfer, BlockUpload):
            raise refusal(AbortCode.COMMAND_SPECIFIER, 'SDO')
        answers = transfer.proceed(data)
        if transfer.finished:
            self._transfer = None
        return answers

    def _block_download(self, data: bytes, now: float) -> bytes:
        """Start a block download, or end one whose segments have all arrived."""
        transfer = self._transfer
        if not data[0] & 0x01:
            transfer = BlockDownload(data)
            self._transfer = None
            variable = self._store.writable(transfer.index, transfer.subindex)
            if transfer.size is not None:
                variable.check_length(transfer.size)
            self._transfer = transfer
            return transfer.initiated()
        if not isinstance(transfer, BlockDownload):
            raise refusal(AbortCode.COMMAND_SPECIFIER, 'SDO')
        answer = transfer.end(data)
        self._transfer = None
        self._store.write(transfer.index, transfer.subindex, bytes(transfer.data), now)
        return answer

    def _start_block_upload(self, data: bytes) -> bytes:
        index, subindex, threshold = struct.unpack_from('<xHBxB', data)
        self._transfer = None
        value = self._store.read(index, subindex)
        upload = BlockUpload(data, value)
        if 0 < len(value) <= threshold:  # the client prefers the other protocol for so little
            return self._start_upload(sdo.UploadRequest(index, subindex)).encode()
        self._transfer = upload
        return upload.initiated()

    def _dispatch(self, data: bytes, now: float) -> Answer | None:
        try:
            request = sdo.decode_request(data)
        except CodecError as error:
            raise refusal(AbortCode.COMMAND_SPECIFIER, 'SDO') from error
        match request:
            case sdo.UploadRequest():
                return self._start_upload(request)
            case sdo.UploadSegmentRequest():
                return self._send_segment(request)
            case sdo.DownloadRequest():
                return self._start_download(request, now)
            case sdo.Segment():
                return self._take_segment(request, now)
            case sdo.Abort():
                self._transfer = None
        return None

    def _start_upload(self, request: sdo.UploadRequest) -> sdo.UploadResponse:
        index, subindex = request.index, request.subindex
        self._transfer = None
        value = self._store.read(index, subindex)
        if 0 < len(value) <= sdo.EXPEDITED_MAX:
            return sdo.UploadResponse(index, subindex, value, len(value))
        self._transfer = Transfer(index, subindex, is_download=False, data=bytearray(value))
        return sdo.UploadResponse(index, subindex, None, len(value))

    def _send_segment(self, request: sdo.UploadSegmentRequest) -> sdo.Segment:
        transfer = self._expect(request.toggle, is_download=False)
        part = bytes(transfer.data[transfer.position : transfer.position + sdo.SEGMENT_MAX])
        transfer.position += len(part)
        last = transfer.position >= len(transfer.data)
        if last:
            self._transfer = None
        return sdo.Segment(request.toggle, part, last)

    def _start_download(self, request: sdo.DownloadRequest, now: float) -> sdo.DownloadResponse:
        index, subindex = request.index, request.subindex
        self._transfer = None
        variable = self._store.writable(index, subindex)
        if request.data is None:
            if request.size is not None:
                variable.check_length(request.size)
            self._transfer = Transfer(index, subindex, is_download=True, size=request.size)
        else:
            data = request.data
            if request.size is None:  # the client leaves the length to us
                data = data[: variable.size or sdo.EXPEDITED_MAX]
            self._store.write(index, subindex, data, now)
        return sdo.DownloadResponse(index, subindex)

    def _take_segment(self, request: sdo.Segment, now: float) -> sdo.DownloadSegmentResponse:
        transfer = self._expect(request.toggle, is_download=True)
        transfer.data += request.data
        received = len(transfer.data)
        limit = STRING_BYTES_MAX if transfer.size is None else transfer.size
        if received > limit:
            raise refusal(AbortCode.LENGTH_HIGH, 'SDO')
        if request.last:
            if transfer.size is not None and received < transfer.size:
                raise refusal(AbortCode.LENGTH_LOW, 'SDO')
            self._transfer = None
            self._store.write(transfer.index, transfer.subindex, bytes(transfer.data), now)
        return sdo.DownloadSegmentResponse(request.toggle)

    def _expect(self, toggle: bool, *, is_download: bool) -> Transfer:
        """Return the transfer that a segment belongs to, and flip its toggle bit."""
        transfer = self._transfer
        if not isinstance(transfer, Transfer) or transfer.is_download is not is_download:
            raise refusal(AbortCode.COMMAND_SPECIFIER, 'SDO')
        if toggle is not transfer.toggle:
            raise refusal(AbortCode.TOGGLE_BIT, 'SDO')
        transfer.toggle = not transfer.toggle
        return transfer


class SdoServers:
    """The SDO servers of a device, each with its own transfer."""

    def __init__(
        self,
        node_id: int,
        store: ObjectStore,
        send: Callable[[Frame], None],
        changed: Callable[[], None],
    ) -> None:
        """Bind 0x1201 and the following objects, as far as the dictionary has them.

        ``changed`` is called when the identifiers of requests have changed.
        """
        self._store = store
        self._send = send
        self._changed = changed
        # the server of the pre-defined connection set
        self.default = SdoServer(
            CobId.SDO_REQUEST + node_id, CobId.SDO_RESPONSE + node_id, store, send
        )
        first = int(Index.SDO_SERVER) + 1
        self._objects = [
            (store.integer(index, 1), store.integer(index, 2))
            for index in range(first, first + CHANNELS_MAX - 1)
            if store.dictionary.has_index(index)
        ]
        for pair in self._objects:
            for variable in pair:
                variable.check = partial(check_cob_id, variable)
                variable.listener = self._reconfigure
        self._channels: dict[int, SdoServer] = {}
        self.configure()

    @property
    def can_ids(self) -> tuple[int, ...]:
        """Identifiers of the requests."""
        return tuple(self._channels)

    @property
    def response_ids(self) -> tuple[int, ...]:
        """Identifiers of the answers."""
        return tuple(server.response_id for server in self._channels.values())

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which the next transfer times out."""
        return min((server.deadline for server in self._channels.values()), default=NEVER)

    def configure(self) -> None:
        """Serve the enabled channels; unchanged channels keep their transfer."""
        channels = {self.default.can_id: self.default}
        for request, response in self._objects:
            if not (request.value | response.value) & COB_ID_INVALID:
                ids = request.value & CAN_ID_MASK, response.value & CAN_ID_MASK
                old = self._channels.get(ids[0])
                same = old is not None and old.response_id == ids[1]
                new = SdoServer(*ids, self._store, self._send)
                channels.setdefault(ids[0], old if old is not None and same else new)
        self._channels = channels

    def reset(self) -> None:
        """Drop the transfers under way."""
        for server in self._channels.values():
            server.reset()

    def receive(self, frame: Frame, now: float) -> None:
        """Respond to a request."""
        server = self._channels.get(frame.can_id)
        if server is not None:
            server.receive(frame, now)

    def advance(self, now: float) -> None:
        """Abort the transfers of clients that timed out."""
        for server in self._channels.values():
            server.advance(now)

    def _reconfigure(self, _now: float) -> None:
        self.configure()
        self._changed()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO block transfers as the server sees them (CiA 301, 7.2.4.3.8 to 7.2.4.3.17)."""

from __future__ import annotations

import struct

from canopen_core.standard import AbortCode, sdo

from ..objects.object_store import refusal, STRING_BYTES_MAX


class BlockDownload:
    """A block transfer by which a client writes.

    Attributes:
        index: Object index.
        subindex: Sub-index.
    """

    def __init__(self, request: bytes) -> None:
        command, self.index, self.subindex, size = struct.unpack('<BHBI', request)
        self.size: int | None = size if command & sdo.SIZE_BIT else None
        self.streaming = True  # the client sends segments, which have no command byte
        self.data = bytearray()  # what has come, after :meth:`end` without padding
        self._with_crc = bool(command & sdo.CRC_BIT)
        self._sequence = 0
        self._finished = False

    def initiated(self) -> bytes:
        """Return the answer to the initiation."""
        return struct.pack(
            '<BHBB3x',
            sdo.DOWNLOAD_INITIATED | sdo.CRC_BIT,
            self.index,
            self.subindex,
            sdo.BLOCK_SEGMENTS_MAX,
        )

    def segment(self, frame: bytes) -> bytes | None:
        """Receive a segment; after the last one of a block return how far they came in order.

        Raises:
            SdoAbortError: The sequence number is 0, or the data are longer than announced.
        """
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
        """Process the client's end; check length and checksum, and return the answer.

        Raises:
            SdoAbortError: A check failed, or the client has not sent everything.
        """
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
    """A block transfer by which a client reads.

    Attributes:
        index: Object index.
        subindex: Sub-index.
    """

    def __init__(self, request: bytes, data: bytes) -> None:
        """Begin with the client's initiation, for the data of the object.

        Raises:
            SdoAbortError: The client requests blocks of no length.
        """
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
        """Return the answer to the initiation."""
        command = sdo.UPLOAD_INITIATED | sdo.SIZE_BIT | sdo.CRC_BIT
        return struct.pack('<BHBI', command, self.index, self.subindex, len(self._data))

    def proceed(self, request: bytes) -> list[bytes]:
        """Process a frame of the client within the transfer; return the answer.

        Raises:
            SdoAbortError: It makes no sense at this point.
        """
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
            return [self._end()]
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

    def _end(self) -> bytes:
        return sdo.end_frame(sdo.UPLOAD_END, self._data, with_crc=self._with_crc)

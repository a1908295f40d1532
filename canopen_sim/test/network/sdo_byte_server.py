# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An SDO server written from the byte tables of CiA 301, 7.2.4.3, without the package's codecs."""

from __future__ import annotations

from dataclasses import dataclass, field

NO_OBJECT = 0x0602_0000
TOGGLE_BIT = 0x0503_0000
OF_WRITES = (0x0601_0002, 0x0609_0030, 0x0609_0031, 0x0609_0032)
"""Abort codes that only a download gets: read-only, and values out of range."""
COMMAND_SPECIFIER = 0x0504_0001


@dataclass
class SdoByteServer:
    """Answers requests of 8 bytes from values of bytes.

    Attributes:
        values: The objects by index and sub-index; what is written is kept there.
        announces_size: Initiate responses of uploads carry the length.
        expedites: Uploads of up to 4 bytes fit into the initiate response.
        refuses: Abort codes by index and sub-index.
    """

    values: dict[tuple[int, int], bytes] = field(default_factory=dict)
    announces_size: bool = True
    expedites: bool = True
    refuses: dict[tuple[int, int], int] = field(default_factory=dict)
    _address: tuple[int, int] = (0, 0)
    _rest: bytes = b''
    _received: bytearray = field(default_factory=bytearray)
    _toggle: int = 0

    def answer(self, request: bytes) -> bytes | None:
        """Return the answer to a frame of a client; None to an abort."""
        assert len(request) == 8
        specifier = request[0] >> 5
        if specifier in (1, 2, 5, 6):
            self._address = (request[1] | request[2] << 8, request[3])
            self._toggle = 0
            code = self.refuses.get(self._address)
            if code is not None and (specifier in (1, 6) or code not in OF_WRITES):
                return self._abort(code)
        if specifier == 1:
            return self._initiate_download(request)
        if specifier == 2:
            return self._initiate_upload()
        if specifier == 0:
            return self._download_segment(request)
        if specifier == 3:
            return self._upload_segment(request)
        return None if specifier == 4 else self._abort(COMMAND_SPECIFIER)

    def _multiplexer(self) -> bytes:
        index, subindex = self._address
        return bytes((index & 0xFF, index >> 8, subindex))

    def _abort(self, code: int) -> bytes:
        return b'\x80' + self._multiplexer() + code.to_bytes(4, 'little')

    def _initiate_download(self, request: bytes) -> bytes:
        self._received = bytearray()
        if request[0] & 2:
            count = 4 - (request[0] >> 2 & 3) if request[0] & 1 else 4
            self.values[self._address] = request[4 : 4 + count]
        return b'\x60' + self._multiplexer() + bytes(4)

    def _download_segment(self, request: bytes) -> bytes:
        if (request[0] >> 4 & 1) != self._toggle:
            return self._abort(TOGGLE_BIT)
        self._received += request[1 : 8 - (request[0] >> 1 & 7)]
        if request[0] & 1:
            self.values[self._address] = bytes(self._received)
        answer = bytes((0x20 | self._toggle << 4,)) + bytes(7)
        self._toggle ^= 1
        return answer

    def _initiate_upload(self) -> bytes:
        if self._address not in self.values:
            return self._abort(NO_OBJECT)
        value = self.values[self._address]
        if self.expedites and 1 <= len(value) <= 4:
            command = 0x43 | (4 - len(value)) << 2 if self.announces_size else 0x42
            return bytes((command,)) + self._multiplexer() + value.ljust(4, b'\0')
        self._rest = value
        size = len(value).to_bytes(4, 'little') if self.announces_size else bytes(4)
        return bytes((0x41 if self.announces_size else 0x40,)) + self._multiplexer() + size

    def _upload_segment(self, request: bytes) -> bytes:
        if (request[0] >> 4 & 1) != self._toggle:
            return self._abort(TOGGLE_BIT)
        part, self._rest = self._rest[:7], self._rest[7:]
        last = not self._rest
        answer = bytes((self._toggle << 4 | (7 - len(part)) << 1 | last,)) + part.ljust(7, b'\0')
        self._toggle ^= 1
        return answer

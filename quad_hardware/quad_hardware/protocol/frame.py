# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of both protocols as values, and their bytes."""

from __future__ import annotations

from dataclasses import dataclass

from ..exceptions import CodecError
from .schema import Kind, Protocol

HEADER = b'\x55\x00'
TAIL = b'\x00\xaa'
LENGTH_AT, KIND_AT, ADDRESS_AT = 2, 3, 4  # [B] from the start of a frame


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame."""

    kind: Kind  # what it is for
    address: int  # register (v1), or ``main << 8 | sub`` (v2)
    payload: bytes = b''  # data; of a READ of protocol v1, one byte: how many to read

    def encode(self, protocol: Protocol) -> bytes:
        """Return the bytes on the wire.

        Raises:
            CodecError: The payload is too long, the address too large, or the protocol has no
                such kind of frame.
        """
        length = protocol.overhead + len(self.payload)
        if length > protocol.max_length:
            raise CodecError(
                f'payload of {len(self.payload)} bytes: a frame of protocol {protocol.name} '
                f'takes {protocol.max_length - protocol.overhead}; send it in parts'
            )
        if self.kind not in protocol.kinds:
            raise CodecError(f'protocol {protocol.name} has no frame of kind {self.kind.name}')
        try:
            address = self.address.to_bytes(protocol.address_size, 'big')
        except OverflowError as error:
            raise CodecError(
                f'address {self.address:#x} does not fit protocol {protocol.name}'
            ) from error
        body = bytes((length, self.kind)) + address + self.payload
        return HEADER + body + bytes((checksum(body),)) + TAIL


def checksum(body: bytes | bytearray | memoryview) -> int:
    """Return the checksum of what stands between header and checksum."""
    return 255 - sum(body) % 256

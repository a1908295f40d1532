# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The datagram of python-can's ``udp_multicast`` interface: one frame as a msgpack map.

The map has eleven keys in a fixed order, of which only the identifier, the length and the payload
differ between the data frames of a CANopen bus. So those are joined from ready-made pieces, and
read by comparing the pieces; every other order, key or type goes through msgpack itself. The bytes
are those that python-can 4 writes for the same frame.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgpack

from ..exceptions import CodecError
from .frame import checked, Frame, PAYLOAD_MAX, STANDARD_ID_MAX

_ENTRIES = 11
_MAP_HEADER = bytes((0x80 | _ENTRIES,))  # msgpack's of a map with fewer than 16 entries
_BINARY_HEADER = 2  # [byte] of msgpack before a short binary: kind and length


def _pack(value: object) -> bytes:
    return bytes(msgpack.packb(value))


def _entries(**entries: object) -> bytes:
    """Return the entries of a map without its header."""
    return _pack(entries)[len(_MAP_HEADER) :]


def _flags(is_extended: bool, is_remote: bool, is_error: bool) -> bytes:
    return _entries(
        is_extended_id=is_extended,
        is_remote_frame=is_remote,
        is_error_frame=is_error,
        channel=None,
    ) + _pack('dlc')


# the time is 0.0, because receivers stamp for themselves
_HEAD = _MAP_HEADER + _entries(timestamp=0.0) + _pack('arbitration_id')
_ID_AT = len(_HEAD)
_LENGTHS = tuple(
    _pack(size) + _pack('data') + _pack(bytes(size))[:_BINARY_HEADER]
    for size in range(PAYLOAD_MAX + 1)
)
"""Length code, key and header of the payload, by its length in [byte]."""
_LENGTH_SIZE = len(_LENGTHS[0])
_TAIL = _entries(is_fd=False, bitrate_switch=False, error_state_indicator=False)
_TAIL_SIZE = len(_TAIL)
_PLAIN_FLAGS = _flags(is_extended=False, is_remote=False, is_error=False)
_PLAIN_HEADS = tuple(_HEAD + _pack(can_id) + _PLAIN_FLAGS for can_id in range(STANDARD_ID_MAX + 1))
"""Everything before the length of a data frame, by its 11-bit identifier."""
_PLAIN_IDS = {head: can_id for can_id, head in enumerate(_PLAIN_HEADS)}
_HEAD_SIZES = [0] * 0x100
"""Length of such a head in [byte] by the first byte of its identifier, 0 for none of them."""
for _head in _PLAIN_HEADS:
    _HEAD_SIZES[_head[_ID_AT]] = len(_head)


def encode(frame: Frame) -> bytes:
    """Return the datagram of a frame.

    Raises:
        ValueError: The identifier or the payload does not fit a classic CAN frame.
    """
    can_id, data, _, is_extended, is_remote, is_error, remote_length = checked(frame)
    if is_extended or is_remote or is_error:
        head = _HEAD + _pack(can_id) + _flags(is_extended, is_remote, is_error)
    else:
        head = _PLAIN_HEADS[can_id]
    length = _LENGTHS[len(data)]
    if remote_length:
        length = _pack(remote_length) + length[1:]
    return b''.join((head, length, data, _TAIL))


def decode(datagram: bytes, timestamp: float) -> Frame:
    """Read a datagram; the frame has the steady time in [s], since the one inside is the sender's.

    Raises:
        CodecError: It is no classic CAN frame.
    """
    frame = _decode_plain(datagram, timestamp)
    return _decode_any(datagram, timestamp) if frame is None else frame


def _decode_plain(datagram: bytes, timestamp: float) -> Frame | None:
    """Read a data frame with an 11-bit identifier in the usual layout; None for all others."""
    if len(datagram) <= _ID_AT:
        return None
    length_at = _HEAD_SIZES[datagram[_ID_AT]]
    can_id = _PLAIN_IDS.get(datagram[:length_at])
    data = datagram[length_at + _LENGTH_SIZE : -_TAIL_SIZE]
    if (
        can_id is None
        or len(data) > PAYLOAD_MAX
        or not datagram.startswith(_LENGTHS[len(data)], length_at)
        or not datagram.endswith(_TAIL)
    ):
        return None
    return Frame(can_id, data, timestamp)


def _decode_any(datagram: bytes, timestamp: float) -> Frame:
    try:
        fields = msgpack.unpackb(datagram, raw=False)
    except (ValueError, TypeError) as error:
        raise CodecError(f'datagram of {len(datagram)} bytes is no msgpack: {error}') from error
    if not isinstance(fields, dict):
        raise CodecError(f'datagram holds a {type(fields).__name__}, not the map of a CAN frame')
    if _flag(fields, 'is_fd', default=False):
        raise CodecError('CAN FD frames are not supported')
    is_extended = _flag(fields, 'is_extended_id', default=True)
    is_remote = _flag(fields, 'is_remote_frame', default=False)
    can_id = fields.get('arbitration_id', 0)
    data = fields.get('data') or b''
    if type(can_id) is not int or not isinstance(data, bytes):
        raise CodecError(f'CAN frame with identifier {can_id!r} and payload {data!r}')
    is_error = _flag(fields, 'is_error_frame', default=False)
    data = b'' if is_remote else data
    length = (fields.get('dlc') or 0) if is_remote else 0
    if type(length) is not int:
        raise CodecError(f'remote request of {length!r} bytes')
    try:
        return checked(Frame(can_id, data, timestamp, is_extended, is_remote, is_error, length))
    except ValueError as error:
        raise CodecError(str(error)) from error


def _flag(fields: Mapping[object, object], name: str, *, default: bool) -> bool:
    """Return a flag of the map; the defaults are those of python-can's message."""
    value = fields.get(name, default)
    if not isinstance(value, bool):
        raise CodecError(f'{name} of a CAN frame is {value!r}, not true or false')
    return value

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Our datagrams against python-can's own packing, and against everything that is none."""

from __future__ import annotations

import can
from can.interfaces.udp_multicast.utils import pack_message, unpack_message
from can_strategies import frames
from hypothesis import example, given
from hypothesis import strategies as st
import msgpack
import pytest

from arm_canopen import CodecError
from arm_canopen.can import Frame, STANDARD_ID_MAX
from arm_canopen.can.adapter import from_message, to_message
from arm_canopen.can.multicast import decode, encode


def packed(**changes: object) -> bytes:
    """Return the map of a small frame with some keys changed."""
    message = {'arbitration_id': 0x181, 'is_extended_id': False, 'data': b'\x27\x06'}
    return bytes(msgpack.packb(message | changes))


@given(frames())
def test_bytes_equal_those_of_python_can(frame: Frame) -> None:
    """The hand-joined pieces are exactly what python-can writes for the same message."""
    assert encode(frame) == pack_message(to_message(frame))


def test_every_standard_identifier_and_length_equals_python_can() -> None:
    """The ready-made pieces are right for all identifiers; the lengths for one of them."""
    for can_id in range(STANDARD_ID_MAX + 1):
        assert encode(Frame(can_id, b'\x05')) == pack_message(to_message(Frame(can_id, b'\x05')))
    for size in range(9):
        frame = Frame(0x181, bytes(size))
        assert encode(frame) == pack_message(to_message(frame))


@given(frames(), st.floats(0.0, 1e9))
def test_decode_inverts_encode(frame: Frame, stamp: float) -> None:
    """What was encoded comes back, with the receiver's stamp."""
    assert decode(encode(frame), stamp) == frame._replace(timestamp=stamp)


@given(frames())
def test_python_can_reads_ours(frame: Frame) -> None:
    """python-can's unpacking gives the same frame, and accepts it in its strict check."""
    message = unpack_message(encode(frame), check=True)
    assert from_message(message, 0.0) == frame


@given(frames(), st.floats(0.0, 2e9), st.one_of(st.none(), st.text(), st.integers(0, 9)))
def test_messages_with_a_time_and_a_channel_are_read(
    frame: Frame, stamp: float, channel: str | int | None
) -> None:
    """Replayed python-can messages carry more than ours and mean the same."""
    message = to_message(frame, stamp)
    message.channel = channel
    assert decode(pack_message(message), 0.0) == frame


@given(frames(), st.randoms())
def test_the_order_of_the_keys_means_nothing(frame: Frame, shuffler: st.DataObject) -> None:
    """Another implementation may write the map in another order, or leave defaults out."""
    fields = list(msgpack.unpackb(encode(frame)).items())
    shuffler.shuffle(fields)  # type: ignore[attr-defined]  # a random.Random
    assert decode(msgpack.packb(dict(fields)), 0.0) == frame
    needed = {'arbitration_id', 'is_extended_id', 'is_remote_frame', 'dlc', 'data'}
    assert decode(msgpack.packb({k: v for k, v in fields if k in needed}), 0.0) == frame


@given(st.binary(max_size=200))
@example(b'')
@example(b'\x8b')
@example(encode(Frame(0x181, bytes(8)))[:-1])
@example(encode(Frame(0x181, bytes(8))) + b'\0')
@example(b'\x93' * 200)
def test_garbage_is_refused_and_never_crashes(datagram: bytes) -> None:
    """Any bytes either are a frame or raise the one error that the bus counts."""
    try:
        frame = decode(datagram, 0.0)
    except CodecError:
        return
    assert isinstance(frame, Frame)


@given(frames(), st.integers(0), st.integers(0, 255))
def test_a_changed_byte_never_gives_an_impossible_frame(
    frame: Frame, place: int, value: int
) -> None:
    """A damaged datagram is refused or still within what a CAN frame can be."""
    damaged = bytearray(encode(frame))
    damaged[place % len(damaged)] = value
    try:
        read = decode(bytes(damaged), 0.0)
    except CodecError:
        return
    encode(read)


@pytest.mark.parametrize(
    ('datagram', 'reason'),
    [
        (packed(is_fd=True), 'CAN FD'),
        (packed(arbitration_id=0x800), 'out of range'),
        (packed(arbitration_id=-1), 'out of range'),
        (packed(arbitration_id='x'), "identifier 'x'"),
        (packed(arbitration_id=True), 'identifier True'),
        (packed(data=bytes(9)), 'at most 8'),
        (packed(data='text'), "payload 'text'"),
        (packed(is_extended_id=1), 'is_extended_id'),
        (packed(is_remote_frame='no'), 'is_remote_frame'),
        (bytes(msgpack.packb([1, 2])), 'a list'),
        (b'\xc1', 'no msgpack'),
    ],
)
def test_what_is_no_classic_frame_is_named(datagram: bytes, reason: str) -> None:
    """Each way to be wrong has its own message."""
    with pytest.raises(CodecError, match=reason):
        decode(datagram, 0.0)


def test_an_fd_message_of_python_can_is_refused() -> None:
    """A CAN FD frame of 64 bytes on the group is not taken for a classic one."""
    message = can.Message(is_fd=True, data=bytes(64), is_extended_id=False)
    with pytest.raises(CodecError, match='CAN FD'):
        decode(pack_message(message), 0.0)

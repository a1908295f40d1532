# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of SDO frames and PDOs (CiA 301, 7.2.4.3, 7.5.2.36), and transcripts of the figures."""

from collections.abc import Sequence
from contextlib import suppress
import struct

from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core import CodecError
from canopen_core.standard import (
    AbortCode,
    DataType,
    FIXED_BITS,
    integer_range,
    MappedObject,
    Number,
    PDO_BITS_MAX,
    PdoCodec,
    REAL_FORMATS,
    sdo,
)
from canopen_core.standard.sdo import Request

INDEX = st.integers(0, 0xFFFF)
SUBINDEX = st.integers(0, 0xFF)
EXPEDITED = st.binary(min_size=1, max_size=4)
SEGMENTS = st.builds(sdo.Segment, st.booleans(), st.binary(max_size=7), st.booleans())
ABORTS = st.builds(sdo.Abort, INDEX, SUBINDEX, st.integers(0, 0xFFFF_FFFF))
SIZES = st.none() | st.integers(0, 0xFFFF_FFFF)


def _expedited_download(index: int, subindex: int, data: bytes) -> sdo.DownloadRequest:
    return sdo.DownloadRequest(index, subindex, data, len(data))


def _expedited_upload(index: int, subindex: int, data: bytes) -> sdo.UploadResponse:
    return sdo.UploadResponse(index, subindex, data, len(data))


REQUESTS: st.SearchStrategy[Request] = st.one_of(
    st.builds(_expedited_download, INDEX, SUBINDEX, EXPEDITED),
    st.builds(sdo.DownloadRequest, INDEX, SUBINDEX, st.none(), SIZES),
    st.builds(sdo.UploadRequest, INDEX, SUBINDEX),
    SEGMENTS,
    st.builds(sdo.UploadSegmentRequest, st.booleans()),
    ABORTS,
)
RESPONSES: st.SearchStrategy[sdo.Response] = st.one_of(
    st.builds(_expedited_upload, INDEX, SUBINDEX, EXPEDITED),
    st.builds(sdo.UploadResponse, INDEX, SUBINDEX, st.none(), SIZES),
    st.builds(sdo.DownloadResponse, INDEX, SUBINDEX),
    SEGMENTS,
    st.builds(sdo.DownloadSegmentResponse, st.booleans()),
    ABORTS,
)


@given(request=REQUESTS, response=RESPONSES)
def test_messages_survive_the_round_trip(request: Request, response: sdo.Response) -> None:
    """Each has 8 bytes and is read as what it was."""
    frames = request.encode(), response.encode()
    assert (sdo.decode_request(frames[0]), sdo.decode_response(frames[1])) == (request, response)
    assert [len(frame) for frame in frames] == [8, 8]


@given(data=st.binary(max_size=10))
def test_reading_fails_with_codec_error_only(data: bytes) -> None:
    """Whatever a peer sends is a message or a CodecError."""
    for decode in (sdo.decode_request, sdo.decode_response):
        try:
            message = decode(data)
        except CodecError:
            continue
        assert len(data) == 8 or (decode is sdo.decode_response and len(data) < 8)
        assert len(message.encode()) == 8


@given(message=RESPONSES)
def test_an_answer_without_its_unused_bytes_is_read(message: sdo.Response) -> None:
    """As far as it is complete; one byte less is none."""
    frame = message.encode()
    sizes = []
    for size in range(9):
        with suppress(CodecError):
            if sdo.decode_response(frame[:size]) == message:
                sizes.append(size)
    assert sizes == list(range(sizes[0], 9))
    assert not any(frame[sizes[0] :])


def test_an_expedited_value_is_cut_to_its_type() -> None:
    """What is too short, or came in segments, is left for the codec to refuse."""
    for data_type, data, value in (
        (DataType.INTEGER8, b'\xfd\xa5\xa5\xa5', b'\xfd'),
        (DataType.UNSIGNED16, b'\x37\x06\0\0', b'\x37\x06'),
        (DataType.UNSIGNED32, b'\1\2\3\4', b'\1\2\3\4'),
        (DataType.UNSIGNED16, b'\1', b'\1'),
        (DataType.UNSIGNED16, b'12345', b'12345'),
        (DataType.VISIBLE_STRING, b'abc', b'abc'),
    ):
        assert sdo.fitted(data_type, data) == value


TRANSCRIPTS: tuple[tuple[Request | sdo.Response, str], ...] = (
    (sdo.UploadRequest(0x1000, 0), '40 00 10 00 00 00 00 00'),
    (sdo.DownloadRequest(0x6040, 0, b'\x0f\x00', 2), '2B 40 60 00 0F 00 00 00'),
    (sdo.DownloadRequest(0x6060, 0, b'\x08', 1), '2F 60 60 00 08 00 00 00'),
    (sdo.DownloadRequest(0x607A, 0, b'\x01\x02\x03\x04', 4), '23 7A 60 00 01 02 03 04'),
    (sdo.DownloadRequest(0x1008, 0, None, 10), '21 08 10 00 0A 00 00 00'),
    (sdo.Segment(False, b'abcdefg', False), '00 61 62 63 64 65 66 67'),
    (sdo.Segment(True, b'abc', True), '19 61 62 63 00 00 00 00'),
    (sdo.UploadSegmentRequest(False), '60 00 00 00 00 00 00 00'),
    (sdo.UploadSegmentRequest(True), '70 00 00 00 00 00 00 00'),
    (sdo.Abort(0x1000, 0, AbortCode.NO_OBJECT), '80 00 10 00 00 00 02 06'),
    (sdo.UploadResponse(0x1000, 0, b'\x92\x01\x02\x00', 4), '43 00 10 00 92 01 02 00'),
    (sdo.UploadResponse(0x6041, 0, b'\x37\x06', 2), '4B 41 60 00 37 06 00 00'),
    (sdo.UploadResponse(0x1008, 0, None, 26), '41 08 10 00 1A 00 00 00'),
    (sdo.DownloadResponse(0x6040, 0), '60 40 60 00 00 00 00 00'),
    (sdo.DownloadSegmentResponse(False), '20 00 00 00 00 00 00 00'),
    (sdo.DownloadSegmentResponse(True), '30 00 00 00 00 00 00 00'),
)


def test_messages_are_those_of_the_standard() -> None:
    """The bytes of well-known requests and responses, as bus analysers show them."""
    for message, frame in TRANSCRIPTS:
        assert message.encode() == bytes.fromhex(frame)


def test_what_no_frame_carries_is_refused() -> None:
    """Data that would corrupt the command byte: 1 to 4 bytes expedited, 7 at most in a segment.

    Of frames, the specifiers of the block protocol; expedited data without a size are four bytes.
    """
    for data in (b'', b'12345'):
        for kind in (sdo.DownloadRequest, sdo.UploadResponse):
            with pytest.raises(CodecError, match='1 to 4'):
                kind(0x2000, 0, data, len(data)).encode()
    with pytest.raises(CodecError, match='7 bytes'):
        sdo.Segment(False, bytes(8), True).encode()
    for specifier in (5, 6, 7):
        frame = bytes((specifier << 5, 0, 0x10, 0, 0, 0, 0, 0))
        for decode in (sdo.decode_request, sdo.decode_response):
            with pytest.raises(CodecError, match=str(specifier)):
                decode(frame)
    message = sdo.decode_request(bytes.fromhex('22 40 60 00 0F 00 00 00'))
    assert message == sdo.DownloadRequest(0x6040, 0, b'\x0f\x00\x00\x00', None)


MAPPABLE = sorted(FIXED_BITS)


@st.composite
def mappings(draw: st.DrawFn) -> list[MappedObject]:
    """Draw a mapping that fills a PDO more or less."""
    mapping: list[MappedObject] = []
    free = PDO_BITS_MAX
    for data_type in draw(st.lists(st.sampled_from(MAPPABLE), max_size=12)):
        if FIXED_BITS[data_type] <= free:
            free -= FIXED_BITS[data_type]
            index = draw(st.integers(0x2000, 0xFFFF))
            mapping.append(MappedObject(index, draw(st.integers(0, 255)), data_type))
    return mapping


def value_of(data_type: DataType) -> st.SearchStrategy[Number]:
    """Draw a value that a type can hold."""
    if data_type in REAL_FORMATS:
        return st.floats(width=32, allow_nan=False)
    low, high = integer_range(data_type) or (0, (1 << FIXED_BITS[data_type]) - 1)
    return st.integers(low, high)


def bits_of(data_type: DataType, value: Number) -> str:
    """Write a value as text of zeros and ones, least significant bit first: the oracle."""
    if data_type in REAL_FORMATS:
        raw = struct.pack(REAL_FORMATS[data_type], value)
        pattern = int.from_bytes(raw, 'little')
    else:
        pattern = int(value) % (1 << FIXED_BITS[data_type])
    return f'{pattern:0{FIXED_BITS[data_type]}b}'[::-1]


def bytes_of(bits: str) -> bytes:
    """Cut a text of bits, least significant first, into bytes."""
    padded = bits + '0' * (-len(bits) % 8)
    return bytes(int(padded[i : i + 8][::-1], 2) for i in range(0, len(padded), 8))


@pytest.mark.slow
@given(mapping=mappings(), data=st.data())
def test_the_payload_is_the_bits_one_behind_the_other(
    mapping: Sequence[MappedObject], data: st.DataObject
) -> None:
    """Packing is bit-exact: the first object in the lowest bits, unused bits zero.

    Unpacking gives the packed values, also when bytes follow the mapped ones.
    """
    codec = PdoCodec(mapping)
    values = tuple(data.draw(value_of(mapped.data_type)) for mapped in mapping)
    payload = codec.pack(values)
    objects = zip(mapping, values, strict=True)
    assert payload == bytes_of(''.join(bits_of(each.data_type, value) for each, value in objects))
    surplus = data.draw(st.binary(max_size=8 - codec.size))
    assert codec.unpack(payload) == codec.unpack(payload + surplus) == values


@pytest.mark.slow
@given(mapping=mappings(), data=st.data())
def test_a_payload_is_long_enough_or_refused(
    mapping: Sequence[MappedObject], data: st.DataObject
) -> None:
    """Bytes shorter than the mapping are refused; all others are values of the types."""
    codec = PdoCodec(mapping)
    payload = data.draw(st.binary(max_size=8))
    if len(payload) < codec.size:
        with pytest.raises(CodecError, match='shorter'):
            codec.unpack(payload)
        return
    for mapped, value in zip(mapping, codec.unpack(payload), strict=True):
        limits = integer_range(mapped.data_type)
        assert limits is None or limits[0] <= value <= limits[1]


@pytest.mark.slow
@given(mapping=mappings(), data=st.data())
def test_a_value_out_of_range_is_refused(
    mapping: Sequence[MappedObject], data: st.DataObject
) -> None:
    """No value is cut to its length silently, on either path; nor is one too many or too few."""
    integers = [place for place, mapped in enumerate(mapping) if integer_range(mapped.data_type)]
    if not integers:
        return
    values: list[Number] = [0 for _ in mapping]
    place = data.draw(st.sampled_from(integers))
    low, high = integer_range(mapping[place].data_type) or (0, 0)
    values[place] = data.draw(st.sampled_from((low - 1, high + 1, 0.5)))
    with pytest.raises(CodecError):
        PdoCodec(mapping).pack(values)
    for wrong in ([0, *[0 for _ in mapping]], [0 for _ in mapping[1:]]):
        with pytest.raises(CodecError, match='values'):
            PdoCodec(mapping).pack(wrong)


@given(
    index=st.integers(0, 0xFFFF),
    subindex=st.integers(0, 0xFF),
    data_type=st.sampled_from(MAPPABLE),
)
def test_the_mapping_word_holds_index_subindex_and_length(
    index: int, subindex: int, data_type: DataType
) -> None:
    """The word that 0x1600 and 0x1A00 hold is index, sub-index and bits, big end first."""
    word = MappedObject(index, subindex, data_type).word
    assert struct.pack('>I', word) == struct.pack('>HBB', index, subindex, FIXED_BITS[data_type])


def test_mappings_that_cannot_be_are_refused() -> None:
    """64 bits fit, one more does not; strings and domains have no place in a PDO."""
    eight = [MappedObject(0x2000, 0, DataType.UNSIGNED64)]
    assert PdoCodec(eight).size == 8
    with pytest.raises(CodecError, match='65'):
        PdoCodec([*eight, MappedObject(0x2001, 0, DataType.BOOLEAN)])
    with pytest.raises(CodecError, match='VISIBLE_STRING'):
        PdoCodec([MappedObject(0x1008, 0, DataType.VISIBLE_STRING)])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""EDS and DCF files: careful and sloppy ones, their values as text, and another reader."""

import math
from pathlib import Path
import re
import struct
import textwrap

import canopen
from eds_samples import eds_text
from hypothesis import example, given
from hypothesis import strategies as st
import pytest

from canopen_core import CodecError, ConfigError
from canopen_core.eds import bytes_from_text, Eds, load_eds, parse_integer, text_from_bytes
from canopen_core.eds.ini import BYTE_TYPES, EdsValue, parse_value
from canopen_core.standard import (
    AccessType,
    byte_length,
    DataType,
    decode,
    encode,
    integer_range,
    ObjectEntry,
    REAL_FORMATS,
    Value,
)


def read(folder: Path, text: str | bytes) -> Eds:
    """Write and read a file; indentation common to all lines does not count."""
    path = folder / 'x.eds'
    data = textwrap.dedent(text).encode() if isinstance(text, str) else text
    path.write_bytes(data)
    return load_eds(path)


SLOPPY = """\
    garbage before the first section

    ; a comment
    # another one
    [ deviceinfo ]
    vendorname = Werkstätten
    [1000]
    PARAMETERNAME=Device type
    datatype = 0x7
    AccessType=RO
    DefaultValue=0x192
    PdoMapping=
    [6040]
    ParameterName=Controlword
    ObjectType=
    DataType=006
    AccessType=RWW
    PDOMapping=0x1
    LowLimit=
    HighLimit=0xFFFF
    [60fe Sub0]
    ParameterName=Number of entries
    DataType=5
    AccessType=const
    DefaultValue=2
    [60FE]
    ParameterName=Digital outputs
    ObjectType=8
    SubNumber=2
    [60FESUB1]
    ParameterName=Outputs
    DataType=7
    AccessType=rw
"""


@pytest.mark.parametrize('line_end', ['\n', '\r\n', '\r'], ids=['LF', 'CRLF', 'CR'])
@pytest.mark.parametrize(
    'encoding', ['utf-8', 'utf-8-sig', 'latin-1', 'utf-16', 'utf-16-le', 'utf-16-be']
)
def test_sloppy_files_are_read(tmp_path: Path, line_end: str, encoding: str) -> None:
    """Case, blanks, padding, empty keys, line ends and encodings do not matter."""
    text = textwrap.dedent(SLOPPY).replace('\n', line_end)
    eds = read(tmp_path, text.encode(encoding))
    dictionary = eds.dictionary
    device_type, controlword = dictionary.get(0x1000), dictionary.get(0x6040)
    assert device_type is not None
    assert controlword is not None
    assert device_type.default == 0x192
    assert device_type.access is AccessType.READ_ONLY
    assert controlword.data_type is DataType.UNSIGNED16
    assert controlword.access is AccessType.READ_WRITE_RPDO
    assert controlword.pdo_mappable
    assert (controlword.low_limit, controlword.high_limit) == (None, 0xFFFF)
    assert [entry.subindex for entry in dictionary.subindices(0x60FE)] == [0, 1]


NUMBER = 'DataType=5|AccessType=rw'

ODDITIES: list[tuple[str, int, str]] = [
    ('[2000]|DataType 5|AccessType=rw', 2, 'neither a section nor a value'),
    (f'[2000|{NUMBER}', 1, 'no closing bracket'),
    (f'[2000]|{NUMBER}|[2000]', 4, 'already opened in line 1'),
    (f'[2000]|{NUMBER}|DataType=6', 4, 'already given in line 2'),
    ('[2000]|DataType=0x99|AccessType=rw', 2, 'unknown DataType 0x0099'),
    ('[2000]|AccessType=rw', 1, 'no DataType, taken as DOMAIN'),
    ('[2000]|DataType=5|AccessType=maybe', 3, "unknown AccessType 'maybe'"),
    ('[2000]|DataType=5', 1, 'no AccessType, taken as rw'),
    (f'[2000]|ObjectType=0x42|{NUMBER}', 2, 'unknown ObjectType 66'),
    (f'[2000]|{NUMBER}|DefaultValue=abc', 4, "'abc' is not a whole number"),
    (f'[2000]|{NUMBER}|DefaultValue=1Fh', 4, "'1Fh' is not a whole number: write 0x1F"),
    (f'[2000]|{NUMBER}|DefaultValue=300', 4, '300 does not fit UNSIGNED8'),
    (f'[2000]|{NUMBER}|LowLimit=9|HighLimit=1', 4, 'LowLimit 9 is above HighLimit 1'),
    ('[2000]|ObjectType=9', 1, 'RECORD without sub-indices'),
    (f'[2000sub1]|{NUMBER}', 1, r'without the section \[2000\]'),
    ('[2000]|ObjectType=9|CompactSubObj=255', 3, 'not 1 to 254'),
    ('[OptionalObjects]|1=0x2000', 0, 'listed, but without a section: 0x2000'),
]


def test_oddities_are_warnings_with_their_line(tmp_path: Path) -> None:
    """What is wrong is reported with its line, and the rest of the file is read."""
    for text, line, message in ODDITIES:
        lines = [*text.split('|'), '[1000]', 'DataType=7', 'AccessType=ro']
        eds = read(tmp_path, '\n'.join(lines))
        assert (0x1000, 0) in eds.dictionary, text
        found = [problem for problem in eds.warnings if problem.line == line]
        assert any(re.search(message, problem.message) for problem in found), (text, eds.warnings)


ARRAY = f'[2000]|ObjectType=8|{NUMBER}|DefaultValue=7|CompactSubObj=3'
DERIVED = f'[A0sub1]|{NUMBER}|DefaultValue=6|[2000]|DataType=0xA0|AccessType=rw|DefaultValue=300'
VALUES: list[tuple[str, str, int, Value | None]] = [
    ('compact default', ARRAY, 3, 7),
    ('compact count', ARRAY, 0, 3),
    ('compact value', f'{ARRAY}|[2000Value]|NrOfEntries=1|2=9', 2, 9),
    ('DCF value', f'[2000]|{NUMBER}|DefaultValue=7|ParameterValue=8', 0, 8),
    ('empty DCF value', f'[2000]|{NUMBER}|DefaultValue=7|ParameterValue=', 0, 7),
    ('bad DCF value', f'[2000]|{NUMBER}|DefaultValue=7|ParameterValue=bad', 0, 7),
    ('domain', '[2000]|ObjectType=2|AccessType=rw|DefaultValue=0x1234', 0, None),
    ("two's complement", '[2000]|DataType=2|AccessType=rw|DefaultValue=0xFF', 0, -1),
    ('derived type', DERIVED, 0, 300),
]


def test_values_after_a_reset(tmp_path: Path) -> None:
    """Compact arrays, DCF values and special types give the value that the device starts with."""
    for case, text, subindex, value in VALUES:
        entry = read(tmp_path, text.replace('|', '\n')).dictionary.get(0x2000, subindex)
        assert entry is not None, case
        assert entry.default == value, case


COMPACT_PDOS = """
[DeviceInfo]
CompactPDO=0x13
NrOfRXPDO=1
NrOfTXPDO=5
[OptionalObjects]
SupportedObjects=3
1=0x1400
2=0x1600
3=0x1804
[1800]
ObjectType=9
SubNumber=2
[1800sub0]
DataType=5
AccessType=const
DefaultValue=1
[1800sub1]
DataType=7
AccessType=rw
DefaultValue=0x80000000
"""


def test_compact_pdos_are_written_out(tmp_path: Path) -> None:
    """By their number and the mask of sub-indices; what has a section keeps it.

    Of a compact array [2000Name] names single elements, the others are numbered.
    """
    eds = read(tmp_path, COMPACT_PDOS)
    dictionary = eds.dictionary.for_node(3)
    assert not [problem for problem in eds.warnings if 'without a section' in problem.message]
    for index in (0x1400, 0x1801, 0x1804):
        assert [entry.subindex for entry in dictionary.subindices(index)] == [0, 1, 2, 5]
    defaults = {(0x1400, 0): 5, (0x1400, 1): 0x203, (0x1801, 1): 0x283}
    defaults |= {(0x1804, 1): 0x8000_0000, (0x1800, 1): 0x8000_0000, (0x1A04, 0): 0}
    for address, default in defaults.items():
        entry = dictionary.get(*address)
        assert entry is not None
        assert entry.default == default
    assert len(dictionary.subindices(0x1600)) == len(dictionary.subindices(0x1A00)) == 65
    assert not dictionary.has_index(0x1401)
    assert not dictionary.has_index(0x1805)
    array = (
        '[2000]\nParameterName=Field\nObjectType=8\nDataType=5\nAccessType=rw\nCompactSubObj=2\n'
        '[2000Name]\nNrOfEntries=1\n2=Second'
    )
    names = [entry.name for entry in read(tmp_path, array).dictionary.subindices(0x2000)]
    assert names == ['NrOfObjects', 'Field1', 'Second']


OBJECT = '\n[1000]\nDataType=7\nAccessType=ro'


def test_sections_beside_the_objects(tmp_path: Path) -> None:
    """A DCF gives the node id, under either spelling; an invalid one does not count.

    In PDOs only the gaps that the device takes are allowed; without that section, all.
    """
    for section, node_id in (
        ('[DeviceComissioning]\nNodeID=0x05', 5),
        ('[DeviceCommissioning]\nNodeID=7', 7),
        ('[DeviceComissioning]\nNodeID=', None),
        ('[DeviceComissioning]\nNodeID=200', None),
        ('', None),
    ):
        assert read(tmp_path, section + OBJECT).node_id == node_id, section
    assert read(tmp_path, OBJECT).dummy_types == set(range(2, 8))
    text = '[DummyUsage]\nDummy0001=1\nDummy0002=0\nDummy0005=1\nDummy0006=\nDummy0007=0x1'
    assert read(tmp_path, text + OBJECT).dummy_types == {5, 7}


def test_files_that_are_no_eds_are_refused(tmp_path: Path) -> None:
    """A missing, empty or binary file or a folder is one error with the path and a remedy."""
    empty, binary = tmp_path / 'empty.eds', tmp_path / 'binary.eds'
    empty.write_bytes(b'')
    binary.write_bytes(b'\x7fELF\0\0\xff\xfe')
    missing = {tmp_path / 'x.eds': 'no such file', tmp_path: 'no such file'}
    for path, message in (missing | {empty: 'no object', binary: 'no object'}).items():
        with pytest.raises(ConfigError, match=message) as caught:
            load_eds(path)
        (problem,) = caught.value.problems
        assert problem.file == path
        assert problem.remedy


WHOLE = {'0': 0, '001': 1, '010': 10, '42': 42, '-3': -3, '+7': 7, '0x1A': 26, '0X1a': 26}
WHOLE |= {'-0x10': -16, '0x6040 ; controlword': 0x6040}
"""Padded ones are decimal: vendors pad, nobody means octal."""
NO_NUMBERS = ('', 'abc', '0x', '1.5', '1_000', '1 2', '--1', '9' * 50, '٣')
SUMS = {
    '$NODEID+0x180': 0x180,
    '$nodeid + 0x180': 0x180,
    '0x200+$NODEID': 0x200,
    '$NODEID': 0,
    '$NODEID+0x80000000+0x280': 0x8000_0280,
    '$NODEID+384 ; TPDO 1': 384,
}
"""The node id stands on either side, in any case, with any blanks."""
OTHERS: list[tuple[DataType, str, Value]] = [
    (DataType.BOOLEAN, '1', 1),
    (DataType.BOOLEAN, 'TRUE', True),
    (DataType.BOOLEAN, 'false', False),
    (DataType.VISIBLE_STRING, 'Drive; rev. 2', 'Drive; rev. 2'),
    (DataType.OCTET_STRING, '0A 1B2c', b'\x0a\x1b\x2c'),
    (DataType.UNICODE_STRING, '00410042', 'AB'),
    (DataType.UNICODE_STRING, 'plain', 'plain'),
    (DataType.TIME_DIFFERENCE, '1', b'\x01\0\0\0\0\0'),
    (DataType.REAL32, '1.5 ; gain', 1.5),
    (DataType.REAL64, '-2e-3', -0.002),
]


def test_texts_are_values() -> None:
    """As files write them; nothing is guessed, and empty keys are common and mean nothing."""
    for text, number in WHOLE.items():
        assert parse_integer(text) == number, text
    for text in NO_NUMBERS:
        with pytest.raises(ValueError, match='not a whole number'):
            parse_integer(text)
    for text, offset in SUMS.items():
        found = parse_value(DataType.UNSIGNED32, text)
        assert found == EdsValue(offset, node_relative=True), text
    for data_type, text, value in OTHERS:
        assert parse_value(data_type, text) == EdsValue(value), (data_type, text)
    for data_type in DataType:
        assert parse_value(data_type, '') is None


TEXTS = st.one_of(
    st.text(max_size=20),
    st.text(alphabet='0123456789abcdefx$NODEIDnodeid+-.; ', max_size=20),
    st.integers(-(2**70), 2**70).map(str),
    st.floats().map(str),
)


@given(data_type=st.sampled_from(DataType), text=TEXTS)
@example(data_type=DataType.REAL32, text='3.5e38')
def test_any_text_is_a_value_of_the_type_or_refused(data_type: DataType, text: str) -> None:
    """What is read can be written to the device and read back; a refusal has a reason."""
    try:
        parsed = parse_value(data_type, text)
    except ValueError as error:
        limits = integer_range(data_type) or (0, -1)
        is_value = bool(re.fullmatch('[0-9]{1,30}', text)) and int(text) <= limits[1]
        assert (bool(str(error)), is_value) == (True, False)  # noqa: PT017  # half of the law
        return
    if parsed is None:
        assert data_type is DataType.DOMAIN or not text.partition(';')[0].strip()
        return
    if data_type is DataType.VISIBLE_STRING:
        assert parsed.value == text
        return
    decoded = decode(data_type, encode(data_type, parsed.value))
    if isinstance(decoded, float) and isinstance(parsed.value, float):
        assert decoded == pytest.approx(parsed.value, rel=1e-6, nan_ok=True)
    else:
        assert decoded == parsed.value


NODE_ID = 5
SHIPPED = sorted((Path(__file__).parents[2] / 'arm_canopen' / 'eds').glob('*.eds'))


@pytest.fixture(params=['sample', *(path.name for path in SHIPPED)])
def eds_path(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """Give the sample, then every EDS that the package ships."""
    name = str(request.param)
    if name != 'sample':
        return SHIPPED[0].parent / name
    path = tmp_path / 'sample.eds'
    path.write_text(eds_text(), encoding='utf-8')
    return path


def peer_entries(path: Path) -> dict[tuple[int, int], object]:
    """Read a file with the canopen package."""
    peer = canopen.objectdictionary.import_od(str(path), NODE_ID)
    entries: dict[tuple[int, int], object] = {}
    for index, item in peer.items():
        if isinstance(item, canopen.objectdictionary.ODVariable):
            entries[index, 0] = item
        else:
            entries.update({(index, subindex): part for subindex, part in item.subindices.items()})
    return entries


def test_both_readers_agree(eds_path: Path) -> None:
    """Both find the same objects with the same types, access, defaults and limits."""
    eds = load_eds(eds_path)
    assert not eds.warnings
    ours = {entry.address: entry for entry in eds.dictionary.for_node(NODE_ID)}
    theirs = {
        address: entry
        for address, entry in peer_entries(eds_path).items()
        if address[0] >= 0x1000  # [DummyUsage] becomes objects there
    }
    assert ours.keys() == theirs.keys()
    for address, entry in ours.items():
        assert describe(entry) == describe_peer(theirs[address]), entry


PEER_KEYS = ('name', 'data_type', 'access_type', 'pdo_mappable', 'default', 'min', 'max')


def describe(entry: ObjectEntry) -> list[object]:
    """List what is compared."""
    kinds = [entry.name, entry.data_type.value, entry.access.value, entry.pdo_mappable]
    limits = [entry.low_limit, entry.high_limit]
    # of reals the peer reads limits as integers only
    return [*kinds, entry.default, *([] if entry.data_type in REAL_FORMATS else limits)]


def describe_peer(entry: object) -> list[object]:
    """List the same of the peer's entry."""
    values = [getattr(entry, key, None) for key in PEER_KEYS]
    values[4] = None if values[4] in ('', b'') else values[4]
    return values[:5] if values[1] in [kind.value for kind in REAL_FORMATS] else values


NUMBERS = [data_type for data_type in DataType if integer_range(data_type) is not None]


@given(st.sampled_from(NUMBERS), st.data())
def test_numbers_come_back(data_type: DataType, data: st.DataObject) -> None:
    """Every value of BOOLEAN and the integers: decimal, and two's complement in hexadecimal."""
    low, high = integer_range(data_type) or (0, 0)
    value = data.draw(st.integers(low, high))
    raw = value.to_bytes(byte_length(data_type) or 0, 'little', signed=low < 0)
    shown = text_from_bytes(data_type, raw)
    assert shown == (str(value == 1).lower() if data_type is DataType.BOOLEAN else str(value))
    for text in (shown, str(value), f'0x{value % (high - low + 1):X}'):
        assert bytes_from_text(data_type, text) == raw


@given(st.sampled_from(list(REAL_FORMATS)), st.floats(width=32))
def test_reals_come_back(data_type: DataType, value: float) -> None:
    """Infinities and denormals too, and as the bits in hexadecimal (CiA 306-1)."""
    raw = struct.pack(REAL_FORMATS[data_type], value)
    shown = text_from_bytes(data_type, raw)
    if math.isnan(value):
        assert shown == 'nan'
        return
    bits = int.from_bytes(raw, 'little')
    for text in (shown, f'0x{bits:0{2 * len(raw)}X}'):
        assert bytes_from_text(data_type, text) == raw


CHARACTERS = st.text(st.characters(max_codepoint=255), min_size=1)


@given(st.sampled_from(sorted(BYTE_TYPES)), st.binary(min_size=6, max_size=6), CHARACTERS)
def test_bytes_and_strings_come_back(data_type: DataType, raw: bytes, string: str) -> None:
    """Hexadecimal digits with or without spaces; every character of a VISIBLE_STRING."""
    text = text_from_bytes(data_type, raw)
    assert bytes_from_text(data_type, text) == raw
    assert bytes_from_text(data_type, text.replace(' ', '')) == raw
    encoded = bytes_from_text(DataType.VISIBLE_STRING, string)
    assert text_from_bytes(DataType.VISIBLE_STRING, encoded) == string


def test_what_is_no_value_is_refused() -> None:
    """The reason names the text or the type."""
    for data_type, text, message in (
        (DataType.UNSIGNED8, '256', 'does not fit UNSIGNED8'),
        (DataType.INTEGER8, '-129', 'does not fit INTEGER8'),
        (DataType.INTEGER16, '', 'no INTEGER16'),
        (DataType.INTEGER16, '1.5', 'not a whole number'),
        (DataType.UNSIGNED32, '$NODEID+1', 'no UNSIGNED32'),
        (DataType.UNSIGNED32, '$NODEID+$NODEID', 'more than once'),
        (DataType.UNSIGNED32, '$NODEID-1', 'not a whole number'),
        (DataType.UNSIGNED32, '1+2', 'not a whole number'),
        (DataType.REAL32, 'much', 'could not convert'),
        (DataType.REAL32, '0x1FFFFFFFF', 'does not fit REAL32'),
        (DataType.DOMAIN, 'xyz', 'non-hexadecimal'),
        (DataType.TIME_OF_DAY, '00 01', 'TIME_OF_DAY'),
        (DataType.VISIBLE_STRING, '\u20ac', 'VISIBLE_STRING'),
    ):
        with pytest.raises(CodecError, match=message):
            bytes_from_text(data_type, text)

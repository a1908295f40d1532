# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading EDS and DCF files: what careful ones say, and what sloppy ones must not break."""

from pathlib import Path
import re
import textwrap

from config_samples import DRIVE_ROWS, eds_text
import pytest

from arm_canopen import ConfigError
from arm_canopen.config import Eds, load_eds
from arm_canopen.standard import AccessType, DataType
from arm_canopen.standard.datatypes import Value


def read(folder: Path, text: str | bytes) -> Eds:
    """Write and read a file; indentation common to all lines does not count."""
    path = folder / 'x.eds'
    data = textwrap.dedent(text).encode() if isinstance(text, str) else text
    path.write_bytes(data)
    return load_eds(path)


def test_a_careful_file_is_read_without_warnings(tmp_path: Path) -> None:
    """Every object is there with type, access, default, limits and mapping; nothing is odd."""
    text = eds_text()
    eds = read(tmp_path, text)
    assert not eds.warnings
    assert len(eds.dictionary) == len(DRIVE_ROWS)
    statusword = eds.dictionary.get(0x6041)
    assert statusword is not None
    assert text.splitlines()[statusword.line - 1] == '[6041]'
    for row in DRIVE_ROWS:
        entry = eds.dictionary.get(row.index, row.subindex)
        assert entry is not None
        assert entry.name == row.name
        assert entry.data_type == row.data_type
        assert entry.access.value == row.access
        assert entry.pdo_mappable == row.mappable
        assert entry.low_limit == (float(row.low) if row.low else None)
        assert entry.high_limit == (float(row.high) if row.high else None)


def test_defaults_with_the_node_id(tmp_path: Path) -> None:
    """``$NODEID`` sums stay open until the node id is known."""
    eds = read(tmp_path, eds_text())
    entry, resolved = eds.dictionary.get(0x1800, 1), eds.dictionary.for_node(5).get(0x1800, 1)
    assert entry is not None
    assert resolved is not None
    assert entry.node_relative
    assert resolved.default == 0x185


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
@pytest.mark.parametrize('encoding', ['utf-8', 'utf-8-sig', 'latin-1'])
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
    (f'[2000]|ObjectType=9|SubNumber=3|[2000sub0]|{NUMBER}', 3, 'SubNumber is 3, but 1'),
    (f'[OptionalObjects]|SupportedObjects=2|1=0x2000|[2000]|{NUMBER}', 2, 'is 2, but 1'),
    ('[OptionalObjects]|1=0x2000', 0, 'listed, but without a section: 0x2000'),
    (f'[OptionalObjects]|1=0x1000|[2000]|{NUMBER}', 0, 'in no list of objects: 0x2000'),
]


@pytest.mark.parametrize(('text', 'line', 'message'), ODDITIES)
def test_oddities_are_warnings_with_their_line(
    tmp_path: Path, text: str, line: int, message: str
) -> None:
    """What is wrong is reported with its line, and the rest of the file is read."""
    lines = [*text.split('|'), '[1000]', 'DataType=7', 'AccessType=ro']
    eds = read(tmp_path, '\n'.join(lines))
    assert (0x1000, 0) in eds.dictionary
    found = [problem for problem in eds.warnings if problem.line == line]
    assert any(re.search(message, problem.message) for problem in found), eds.warnings


ARRAY = f'[2000]|ObjectType=8|{NUMBER}|DefaultValue=7|CompactSubObj=3'
VALUES: list[tuple[str, str, int, Value | None]] = [
    ('compact default', ARRAY, 3, 7),
    ('compact count', ARRAY, 0, 3),
    ('compact value', f'{ARRAY}|[2000Value]|NrOfEntries=1|2=9', 2, 9),
    ('DCF value', f'[2000]|{NUMBER}|DefaultValue=7|ParameterValue=8', 0, 8),
    ('empty DCF value', f'[2000]|{NUMBER}|DefaultValue=7|ParameterValue=', 0, 7),
    ('bad DCF value', f'[2000]|{NUMBER}|DefaultValue=7|ParameterValue=bad', 0, 7),
    ('domain', '[2000]|ObjectType=2|AccessType=rw|DefaultValue=0x1234', 0, None),
    ("two's complement", '[2000]|DataType=2|AccessType=rw|DefaultValue=0xFF', 0, -1),
    (
        'derived type',
        f'[A0sub1]|{NUMBER}|DefaultValue=6|[2000]|DataType=0xA0|AccessType=rw|DefaultValue=300',
        0,
        300,
    ),
]


@pytest.mark.parametrize(
    ('text', 'subindex', 'value'),
    [case[1:] for case in VALUES],
    ids=[case[0] for case in VALUES],
)
def test_values_after_a_reset(
    tmp_path: Path, text: str, subindex: int, value: Value | None
) -> None:
    """Compact arrays, DCF values and special types give the value that the device starts with."""
    entry = read(tmp_path, text.replace('|', '\n')).dictionary.get(0x2000, subindex)
    assert entry is not None
    assert entry.default == value


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
    """By their number and the mask of sub-indices; what has a section keeps it."""
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


def test_compact_arrays_are_named(tmp_path: Path) -> None:
    """[2000Name] names single elements, the others are numbered."""
    text = (
        '[2000]\nParameterName=Field\nObjectType=8\nDataType=5\nAccessType=rw\nCompactSubObj=2\n'
        '[2000Name]\nNrOfEntries=1\n2=Second'
    )
    names = [entry.name for entry in read(tmp_path, text).dictionary.subindices(0x2000)]
    assert names == ['NrOfObjects', 'Field1', 'Second']


@pytest.mark.parametrize(
    ('section', 'node_id'),
    [
        ('[DeviceComissioning]\nNodeID=0x05', 5),
        ('[DeviceCommissioning]\nNodeID=7', 7),
        ('[DeviceComissioning]\nNodeID=', None),
        ('[DeviceComissioning]\nNodeID=200', None),
        ('', None),
    ],
)
def test_the_node_id_of_a_dcf(tmp_path: Path, section: str, node_id: int | None) -> None:
    """A DCF gives the node id, under either spelling; an invalid one does not count."""
    eds = read(tmp_path, f'{section}\n[1000]\nDataType=7\nAccessType=ro')
    assert eds.node_id == node_id


def test_dummy_usage(tmp_path: Path) -> None:
    """Only the gaps that the device takes are allowed; a file without the section allows all."""
    objects = '\n[1000]\nDataType=7\nAccessType=ro'
    assert read(tmp_path, objects).dummy_types == set(range(2, 8))
    text = '[DummyUsage]\nDummy0001=1\nDummy0002=0\nDummy0005=1\nDummy0006=\nDummy0007=0x1'
    assert read(tmp_path, text + objects).dummy_types == {5, 7}


@pytest.mark.parametrize(
    ('content', 'message'),
    [(None, 'no such file'), (b'', 'no object'), (b'\x7fELF\0\0\xff\xfe', 'no object')],
    ids=['missing', 'empty', 'binary'],
)
def test_files_that_are_no_eds_are_refused(
    tmp_path: Path, content: bytes | None, message: str
) -> None:
    """A missing, empty or binary file or a folder is one error with the path and a remedy."""
    path = tmp_path / 'x.eds'
    if content is not None:
        path.write_bytes(content)
    for each in (path, tmp_path) if content is None else (path,):
        with pytest.raises(ConfigError, match=message) as caught:
            load_eds(each)
        (problem,) = caught.value.problems
        assert problem.file == each
        assert problem.remedy

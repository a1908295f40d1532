# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Both formats of bus.yml, and devices' own values over the defaults."""

from __future__ import annotations

from pathlib import Path

from config_cases import added
from config_samples import BUS, eds_text, errors_of, load_text, write_bus
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.config import load_bus, NodeConfig, Problem
from arm_canopen.config.findings import Place
from arm_canopen.config.read.document import Item, Scalar, ScalarKind, YamlMap
from arm_canopen.config.resolve.merge import merge_device

OLD = """options: {dcf_path: "@BUS_CONFIG_PATH@"}
master: {node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}
.template: {this: is ignored}
joint1:
  node_id: 2
  dcf: drive.eds
  driver: "ros2_canopen::Cia402Driver"
  tpdo: {1: {mapping: [{index: 0x6041}]}}
  rpdo: {1: {mapping: [{index: 0x6040}]}}
"""


def test_both_formats_give_the_same_device(tmp_path: Path) -> None:
    """A device is the same in the old flat format and in the new one, but for its line."""
    (old,) = load_text(tmp_path, OLD).nodes
    (new,) = load_text(tmp_path).nodes
    fields = NodeConfig.__dataclass_fields__.keys() - {'line', 'dictionary'}
    assert [getattr(old, name) for name in fields] == [getattr(new, name) for name in fields]
    assert list(old.dictionary) == list(new.dictionary)
    assert (old.line, new.line) == (4, 21)


def problems(folder: Path, text: str) -> list[tuple[int, str, str]]:
    """List line, message and remedy of what is wrong."""
    found: tuple[Problem, ...] = errors_of(write_bus(folder, text))
    return [(problem.line, problem.message, problem.remedy) for problem in found]


NODES_LIST = BUS.replace('nodes:\n  joint1:\n    node_id: 2', 'nodes:\n  - joint1: {node_id: 2}')


@pytest.mark.parametrize(
    ('text', 'line', 'message', 'remedy'),
    [
        (NODES_LIST, 20, "'nodes' is a list", "below it 'joint1:'"),
        (BUS.partition('nodes:')[0], 0, "'defaults' but no 'nodes'", "below it 'joint1:'"),
        (BUS.partition('  joint1:')[0], 20, 'there are no devices', "below it 'joint1:'"),
        (BUS.partition('    node_id: 2')[0], 21, 'a device with its keys, got nothing', 'node_id'),
        (BUS.replace('nodes:', 'node:'), 0, "'defaults' but no 'nodes'", 'mapping'),
        (BUS.replace('nodes:', 'node:'), 20, "unknown section 'node'", "mean 'nodes'"),
        (OLD.partition('joint1')[0], 0, 'there are no devices', "below it 'joint1:'"),
        (OLD.replace('master:', 'mastr:'), 2, "unknown section 'mastr'", "mean 'master'"),
        (OLD.replace('master:', 'mastr:'), 0, "no section 'master'", 'node_id below'),
        (OLD.replace('  node_id: 2\n', ''), 4, "no 'node_id'", '1 to 127'),
        (BUS.replace('  node_id: 1\n', ''), 1, "no 'node_id'", 'node_id: 1'),
        (BUS.replace('joint1', 'joint-1'), 21, "'joint-1' is no name", 'underscores'),
        (
            added('nodes', 'joint2: {node_id: 2}'),
            23,
            'node id 2 of joint2 is also that of joint1 (line 22)',
            'an id of its own',
        ),
        (
            BUS.replace('node_id: 2', 'node_id: 1'),
            22,
            'node id 1 of joint1 is also that of the master (line 2)',
            'an id of its own',
        ),
    ],
    ids=lambda value: str(value)[-24:],
)
def test_wrong_layouts_are_refused(
    tmp_path: Path, text: str, line: int, message: str, remedy: str
) -> None:
    """Missing, doubled and misplaced sections and devices are reported with line and remedy."""
    found = problems(tmp_path, text)
    assert any(
        line == at and message in said and remedy in advice for at, said, advice in found
    ), found


def test_the_section_written_too_deep(tmp_path: Path) -> None:
    """Sections below options, as one published example has them, are taken out, and reported."""
    text = 'options:\n' + ''.join(f'  {line}\n' for line in BUS.splitlines())
    bus = load_text(tmp_path, text)
    assert [node.name for node in bus.nodes] == ['joint1']
    reported = {(warning.line, warning.key.rpartition('.')[2]) for warning in bus.warnings}
    assert reported == {(2, 'master'), (8, 'defaults'), (21, 'nodes')}


def test_all_problems_are_reported_at_once(tmp_path: Path) -> None:
    """Problems of all sections and files come together, in the order of the lines."""
    text = added('joint1', 'colour: red\nsdo: [{index: 0x6082}]\nmandatory: 7')
    text = text.replace('sync_period: 10000', 'sync_period: 1')
    lines = [line for line, *_ in problems(tmp_path, text)]
    assert lines == sorted(lines)
    assert len(lines) == 4


DEFAULTS = """
heartbeat_producer: 100
remappings: {a: b, c: d}
sdo:
  - {index: 0x6081, value: 1}
  - {index: 0x6083, value: 2}
tpdo:
  1: {transmission: 5, mapping: [{index: 0x6041}, {index: 0x6061}]}
  2: {transmission: 6, mapping: [{index: 0x6064}]}
"""


def test_own_values_beat_the_defaults(tmp_path: Path) -> None:
    """Each key of a device wins; mappings merge key by key, lists of a PDO are replaced."""
    own = """
    heartbeat_producer: 300
    remappings: {c: e}
    tpdo:
      1: {mapping: [{index: 0x6061}]}
      2: {transmission: 7}
"""
    text = added('defaults', DEFAULTS) + own.lstrip('\n')
    (node,) = load_text(tmp_path, text).nodes
    assert node.heartbeat_producer == 0.3
    assert node.remappings == {'a': 'b', 'c': 'e'}
    assert [pdo.transmission for pdo in node.tpdos[:2]] == [5, 7]
    assert [mapped.index for mapped in node.tpdos[0].mapping] == [0x6061]
    assert [mapped.index for mapped in node.tpdos[1].mapping] == [0x6064]


@pytest.mark.parametrize(
    ('own', 'expected'),
    [
        ('', [(0x6081, 1), (0x6083, 2)]),
        ('sdo: [{index: 0x6084, value: 3}]', [(0x6081, 1), (0x6083, 2), (0x6084, 3)]),
        ('sdo: [{index: 0x6081, value: 9}]', [(0x6083, 2), (0x6081, 9)]),
        ('sdo: []', []),
        ('error_behavior: {1: 2}', [(0x1029, 2), (0x6081, 1), (0x6083, 2)]),
    ],
    ids=['defaults only', 'another object', 'the same object', 'empty list', 'error behaviour'],
)
def test_lists_of_writes_merge_by_object(
    tmp_path: Path, own: str, expected: list[tuple[int, int]]
) -> None:
    """A device adds to the defaults' writes or replaces single ones; an empty list drops all."""
    text = added('defaults', DEFAULTS).replace('    node_id: 2', f'    node_id: 2\n    {own}')
    (node,) = load_text(tmp_path, text).nodes
    writes = [(write.index, int.from_bytes(write.data, 'little')) for write in node.sdo_writes]
    assert writes == expected


KEYS = st.sampled_from('abcd')
TREES = st.recursive(
    st.integers(0, 9), lambda children: st.dictionaries(KEYS, children, max_size=3), max_leaves=8
)
PLACE = Place(Path('x.yml'))


def item(tree: object) -> Item:
    """Turn nested dicts into a document."""
    if isinstance(tree, dict):
        return YamlMap(PLACE, {str(key): item(value) for key, value in tree.items()})
    return Scalar(PLACE, str(tree), ScalarKind.INTEGER)


def merged(below: object, above: object) -> object:
    """Merge nested dicts: the oracle."""
    if not isinstance(below, dict) or not isinstance(above, dict):
        return above
    return below | {
        key: merged(below[key], value) if key in below else value for key, value in above.items()
    }


@pytest.mark.slow
@given(
    below=st.dictionaries(KEYS, TREES, max_size=4), above=st.dictionaries(KEYS, TREES, max_size=4)
)
def test_merging_is_deep_and_the_upper_wins(
    below: dict[str, object], above: dict[str, object]
) -> None:
    """Merging two sections is merging nested dicts; nothing given is changed."""
    lower, upper = item(below), item(above)
    assert isinstance(lower, YamlMap)
    assert isinstance(upper, YamlMap)
    assert merge_device(lower, upper) == item(merged(below, above))
    assert (lower, upper) == (item(below), item(above))


@pytest.mark.parametrize(
    ('options', 'own', 'folder'),
    [
        ('', 'dcf: drive.eds', '.'),
        ('options: {dcf_path: "@BUS_CONFIG_PATH@"}', 'dcf: drive.eds', '.'),
        ('options: {dcf_path: "@BUS_CONFIG_PATH@/a"}', 'dcf: drive.eds', 'a'),
        ('options: {dcf_path: a}', 'dcf: drive.eds', 'a'),
        ('options: {dcf_path: nowhere}', 'dcf: drive.eds', '.'),
        ('options: {dcf_path: a}', 'dcf: drive.eds\n    dcf_path: b', 'b'),
        ('options: {dcf_path: "$EDS_OF_TEST"}', 'dcf: drive.eds', 'b'),
        ('', 'dcf: ${EDS_OF_TEST}/drive.eds', 'b'),
        ('', 'dcf: "@BUS_CONFIG_PATH@/a/drive.eds"', 'a'),
    ],
)
def test_where_the_eds_is_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: str, own: str, folder: str
) -> None:
    """In dcf_path (the device's, else that of the options), else beside the bus.yml."""
    for name in ('a', 'b'):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'drive.eds').write_text(eds_text(), encoding='utf-8')
    monkeypatch.setenv('EDS_OF_TEST', str(tmp_path / 'b'))
    text = f'{options}\n{BUS}'.replace('    node_id: 2', f'    node_id: 2\n    {own}')
    (node,) = load_text(tmp_path, text).nodes
    assert node.eds.resolve() == (tmp_path / folder / 'drive.eds').resolve()


def test_an_eds_from_elsewhere_is_named(tmp_path: Path) -> None:
    """Once for all devices, with the file that was looked for and the one that was taken."""
    text = f'options: {{dcf_path: nowhere}}\n{BUS}  joint2:\n    node_id: 3\n'
    (warning,) = load_text(tmp_path, text).warnings
    assert f'({tmp_path}/nowhere/drive.eds); taken is {tmp_path}/drive.eds' in warning.message
    assert warning.key.endswith('dcf')
    assert 'dcf_path' in warning.remedy


def test_another_folder_for_the_variable(tmp_path: Path) -> None:
    """@BUS_CONFIG_PATH@ may be made to stand for another folder."""
    other = tmp_path / 'other'
    other.mkdir()
    (other / 'drive.eds').write_text(eds_text(), encoding='utf-8')
    path = write_bus(tmp_path, f'options: {{dcf_path: "@BUS_CONFIG_PATH@"}}\n{BUS}')
    assert load_bus(path, bus_config_path=other).nodes[0].eds == other / 'drive.eds'


def test_what_a_missing_section_lacks_has_its_name(tmp_path: Path) -> None:
    """There is no line to show."""
    path = write_bus(tmp_path, OLD.replace('master:', 'mastr:'))
    keys = {
        each.key for each in errors_of(path) if each.message in {"no 'driver'", "no 'node_id'"}
    }
    assert keys == {'master'}

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML as people write and damage it, and what docs/bus_yml.md says of the keys."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from operator import attrgetter
from pathlib import Path
import random
import runpy
from typing import Any

from config_samples import (
    added,
    ARTICLE_BUS,
    BUS,
    errors_of,
    load_text,
    mutated,
    outcome,
    write_bus,
)
from eds_samples import DRIVE_ROWS, eds_text, Row
import pytest
import yaml

from arm_canopen import BusConfig, CanopenError, ConfigError, load_bus
from arm_canopen.config import check_file
from arm_canopen.config.keys import Key, Kind, Use
from arm_canopen.config.sections import (
    DEVICE_KEYS,
    DRIVE_KEYS,
    MASTER_KEYS,
    OPTION_KEYS,
    RPDO_KEYS,
    SDO_KEYS,
    TPDO_KEYS,
)
from canopen_core.eds import load_eds

PACKAGE = Path(__file__).parents[1]
MAKER = runpy.run_path(str(PACKAGE / 'tools' / 'make_key_table.py'))
"""The names of the tool that writes docs/bus_yml.md."""
TABLES = {
    'options': OPTION_KEYS,
    'master': MASTER_KEYS,
    'device': DEVICE_KEYS + DRIVE_KEYS,
    'tpdo': TPDO_KEYS,
    'rpdo': RPDO_KEYS,
    'sdo': SDO_KEYS,
}
SCALARS = [(name, key) for name, keys in TABLES.items() for key in keys if key.kind != Kind.BLOCK]
DEFAULTS = [(name, key) for name, key in SCALARS if MAKER['_default'](key)]
GUARDING = (
    Row(0x100C, 0, 'Guard time', 6, 'rw', '0'),
    Row(0x100D, 0, 'Life time factor', 5, 'rw', '0'),
)
EDS = eds_text((*DRIVE_ROWS, *GUARDING))


def bus_with(section: str = '', **keys: Any) -> dict[str, Any]:
    """Return a bus of one drive, with keys in one of its sections."""
    parts: dict[str, dict[str, Any]] = {
        'options': {},
        'master': {'node_id': 1, 'driver': 'ros2_canopen::MasterDriver'},
        'device': {'node_id': 2, 'driver': 'ros2_canopen::Cia402Driver', 'dcf': 'drive.eds'},
        'tpdo': {'mapping': [{'index': 0x6041}]},
        'rpdo': {'mapping': [{'index': 0x6040}]},
        'sdo': {'index': 0x6081, 'value': 5},
    }
    if section:
        parts[section] |= keys
    device = parts['device'] | {
        'tpdo': {1: parts['tpdo']},
        'rpdo': {1: parts['rpdo']},
        'sdo': [parts['sdo']],
    }
    return {key: parts[key] for key in ('options', 'master')} | {'nodes': {'joint1': device}}


def load(folder: Path, bus: dict[str, Any]) -> BusConfig:
    """Load a bus, without what depends on where it was read from."""
    config = load_text(folder, yaml.safe_dump(bus, sort_keys=False), eds=EDS)
    (node,) = config.nodes
    nothing: Any = None  # two dictionaries of one EDS are not equal
    return replace(config, nodes=(replace(node, dictionary=nothing, line=0),), warnings=())


def test_the_page_is_made_of_the_tables() -> None:
    """By tools/make_key_table.py, after each change of the keys."""
    assert (PACKAGE / 'docs' / 'bus_yml.md').read_text('utf-8') == MAKER['page']()


@pytest.mark.parametrize(
    ('section', 'key'), DEFAULTS, ids=lambda each: getattr(each, 'name', each)
)
def test_the_default_is_what_counts_without_the_key(
    tmp_path: Path, section: str, key: Key
) -> None:
    """A bus.yml that writes what the page says is the same bus as one that leaves it out."""
    value = yaml.safe_load(MAKER['_default'](key))
    assert load(tmp_path, bus_with(section, **{key.name: value})) == load(tmp_path, bus_with())


OTHERS: dict[str, Any] = {
    'driver': 'ros2_canopen::LifecycleMasterDriver',
    'device.driver': 'ros2_canopen::ProxyDriver',
    'namespace': 'left',
    'dcf': 'other.eds',
    'dcf_path': 'others',
    'recovery': 'auto',
    'quirks': 'some_drive',
}
"""What a text may be instead of its default."""


def other_value(section: str, key: Key) -> Any:
    """Return a value that a key may have, and that is neither its default nor its neutral one."""
    if key.kind is Kind.TEXT:
        return OTHERS.get(f'{section}.{key.name}', OTHERS.get(key.name, 'text'))
    if key.kind is Kind.BOOLEAN:
        return key.default is False
    if key.choices is not None:
        return min(key.choices)
    low, high = key.span or (0, 7)
    return min(int(low) + 7, int(high))


def bus_of(folder: Path, key: Key, section: str, **keys: Any) -> BusConfig | None:
    """Load a bus, of a drive with heartbeat for a key of heartbeats; None where it is refused."""
    bus = bus_with(section, **keys)
    if key.name.startswith('heartbeat'):
        bus['nodes']['joint1'].setdefault('heartbeat_producer', 100)
    try:
        return load(folder, bus)
    except ConfigError:
        return None


@pytest.mark.parametrize(('section', 'key'), SCALARS, ids=lambda each: getattr(each, 'name', each))
def test_a_key_counts_or_is_said_to_be_ignored(tmp_path: Path, section: str, key: Key) -> None:
    """No key is read and never used: another value makes another bus, or one that is refused."""
    for file in (tmp_path / 'other.eds', tmp_path / 'others' / 'drive.eds'):
        file.parent.mkdir(exist_ok=True)
        file.write_text(EDS)
    changed = bus_of(tmp_path, key, section, **{key.name: other_value(section, key)})
    assert (changed == bus_of(tmp_path, key, section)) == (key.use is Use.IGNORED)


def test_notations(tmp_path: Path) -> None:
    """All notations without doubt are taken."""
    for key, texts, value in (
        ('node_id', '0x10 16 "16" \'0x10\' 0b10000 1_6 +16 16.0 1.6e1', 16),
        ('node_id', '1e1', 10),
        ('node_id', '007', 7),
        ('drive.offset_pos_to_dev', '1e-5', 1e-5),  # text in YAML 1.1, as it has no point
        ('drive.offset_pos_to_dev', '"2.5" 2.5', 2.5),
        ('drive.offset_pos_to_dev', '.5', 0.5),
        ('drive.offset_pos_to_dev', '-3', -3.0),
        ('drive.offset_pos_to_dev', '0x10', 16.0),
        ('mandatory', 'true yes on True 1 Y', True),  # as dcfgen takes them
        ('mandatory', 'false no off False 0 N', False),
    ):
        for text in texts.split():
            bus = load_text(tmp_path, added('joint1', f'{key.removeprefix("drive.")}: {text}'))
            assert attrgetter(key)(bus.nodes[0]) == value, text


def test_a_device_may_be_called_on(tmp_path: Path) -> None:
    """Keys are text: YAML's booleans do not rename devices, and PDO numbers may be hexadecimal."""
    text = BUS.replace('joint1:', 'on:').replace('    1:\n', '    0x01:\n')
    bus = load_text(tmp_path, text)
    assert bus.nodes[0].name == 'on'
    assert bus.nodes[0].tpdos[0].configured


ANCHORS = """.pdos: &pdos
  1: &first
    mapping: [{index: 0x6041}]
  2:
    <<: *first
    transmission: 7
master: {node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}
.drive: &drive
  dcf: drive.eds
  driver: "ros2_canopen::Cia402Driver"
  tpdo: *pdos
  rpdo: {1: {mapping: [{index: 0x6040}]}}
  heartbeat_producer: 100
joint1:
  <<: *drive
  node_id: 2
joint2:
  node_id: 3
  <<: [{heartbeat_producer: 300}, *drive]
"""


def test_anchors_aliases_and_merge_keys(tmp_path: Path) -> None:
    """Templates work: own keys beat merged ones, of several merged mappings the first counts."""
    joint1, joint2 = load_text(tmp_path, ANCHORS).nodes
    assert joint1.tpdos[0].mapping == joint1.tpdos[1].mapping != ()
    assert (joint1.tpdos[0].transmission, joint1.tpdos[1].transmission) == (255, 7)
    assert (joint1.heartbeat_producer, joint2.heartbeat_producer) == (0.1, 0.3)


def test_a_mistake_in_a_template_is_reported_once(tmp_path: Path) -> None:
    """A wrong value that two devices share is one problem, at the line of the template."""
    path = write_bus(tmp_path, ANCHORS.replace('transmission: 7', 'transmission: 700'))
    (problem,) = errors_of(path)
    assert problem.line == 6
    assert problem.key == '.pdos.2.transmission'


@pytest.mark.slow
def test_what_is_no_good_yaml(tmp_path: Path) -> None:
    """Syntax, duplicate keys, recursion and tags are reported with their line, not a traceback."""
    for text, line, message in (
        ('', 0, 'the file is empty'),
        ('# nothing\n', 0, 'the file is empty'),
        ('- a\n- b\n', 0, 'the top level is not a mapping'),
        ('just text', 0, 'the top level is not a mapping'),
        ('a: [1\nb: 2\n', 2, 'not YAML: while parsing a flow sequence'),
        ('a: b: c\n', 1, 'not YAML: mapping values are not allowed'),
        ('a:\n\t- 1\n', 2, 'not YAML'),
        ('a: 1\n--- \nb: 2\n', 2, 'not YAML: .*another document'),
        ('a: *nobody\n', 1, "undefined alias 'nobody'"),
        ('a: "\\q"\n', 1, 'not YAML'),
        ('[' * 1500, 0, 'nested too deeply'),
        ('a: &a [*a]\n', 1, 'an alias refers to what it is part of'),
        (f'{BUS}master: 1\n', 23, "'master' appears twice, first in line 1"),
        (added('joint1', 'tpdo: {1: {}, 0x1: {}}'), 23, "'1' appears twice"),
        (added('joint1', '? [a, b]\n: 1'), 23, 'a key must be a single word'),
        (added('joint1', '<<: 5'), 23, "'<<' takes a mapping"),
        (added('joint1', 'node_id: !secret 2'), 22, "the tag '!secret' has no meaning"),
        (added('joint1', 'node_id: !!python/object:os.system 2'), 22, 'python/object'),
    ):
        path = tmp_path / 'bus.yml'
        write_bus(tmp_path).write_text(text, encoding='utf-8')
        with pytest.raises(ConfigError, match=message) as caught:
            load_bus(path)
        assert line in [problem.line for problem in caught.value.problems], text


def test_many_aliases_do_not_explode(tmp_path: Path) -> None:
    """Aliases of aliases, a billion values if written out, are refused in no time."""
    levels = [f'.l{i}: &l{i} [{", ".join([f"*l{i - 1}"] * 10)}]' for i in range(1, 10)]
    merges = [f'.m{i}: &m{i} {{<<: [{", ".join([f"*m{i - 1}"] * 10)}]}}' for i in range(1, 10)]
    text = '\n'.join(['.l0: &l0 [x]', *levels, '.m0: &m0 {x: 1}', *merges, BUS])
    assert load_text(tmp_path, text).nodes


@pytest.mark.parametrize('content', [b'\xff\xfe\x00', b'a: \x00', b'a: \xe4', None])
def test_files_that_are_no_text(tmp_path: Path, content: bytes | None) -> None:
    """Binary files and other encodings are refused with the remedy, and so is a folder."""
    path = tmp_path if content is None else tmp_path / 'bus.yml'
    if content is not None:
        path.write_bytes(content)
    (problem,) = errors_of(path)
    assert problem.file == path
    assert ('correct the path' if content is None else 'UTF-8') in problem.remedy


def test_the_error_is_what_callers_catch(tmp_path: Path) -> None:
    """ConfigError is a CanopenError and a ValueError; its text lists each problem on a line."""
    text = added('joint1', 'node_id: 0\ncolour: red')
    with pytest.raises(ConfigError) as caught:
        load_text(tmp_path, text)
    assert isinstance(caught.value, CanopenError)
    assert isinstance(caught.value, ValueError)
    lines = str(caught.value).splitlines()
    assert lines == [str(problem) for problem in caught.value.problems]
    assert len(lines) == 2
    assert lines[0].startswith(f'{tmp_path / "bus.yml"}:22: nodes.joint1.node_id: 0 is out')


SNIPPETS = (
    *('[', ']', '{', '}', ':', ' ', '    ', '- ', '*a', '&a ', '<<: *a', '!!int x', '? ', '|'),
    *('null', 'true', '-1', '0x', '08', '1:2', '.inf', '1e400', '9' * 90, '٣', '\t', '\x85', '~'),
    *('  1:', '  tpdo: 5', '  mapping: {}', '  sdo: [[]]', 'nodes:', 'defaults: 1', '[' * 200),
    *('  dcf: "\\0"', '  dcf: .', '  cob_id: auto', '    transmission: []', '  node_id: {}', '"'),
    *('  namespace: ""', '  remappings: {a: }', '  error_behavior: {1: 0, 2: x}', 'x' * 300),
    *('transmission: 252', 'sync_start: 9', '- {index: 0x1016, sub_index: 1}', 'mapping: []'),
    *('position_mode: 9', 'sync_period: 500', 'num_channels: 3', 'x: ['),
)
EDS_SNIPPETS = (
    *('[', ']', '=', ';', '0x', '-', '+', '$NODEID+', '\n', '\r', '\0', '\xff', '٣', '9' * 60),
    *('[1A00sub1]', '[2000]', 'CompactSubObj=254', 'CompactSubObj=-1', 'ObjectType=0x8'),
    *('DataType=0x000F', 'DataType=9', 'AccessType=const', 'SubNumber=x', 'SupportedObjects=-1'),
    *('DefaultValue=0xFFFFFFFF', 'DefaultValue=0x60410040', 'ParameterValue=', 'LowLimit=9e99'),
)
SAMPLE = eds_text(
    row for row in DRIVE_ROWS if not 0x1400 <= row.index < 0x1C00 or row.index % 2 == 0
)
"""An EDS with one PDO of each kind: used, with the invalid bit set, and without default COB-ID."""
TWO_JOINTS = ARTICLE_BUS.read_text('utf-8').split('  panda_joint3:', maxsplit=1)[0]
"""The bus of the article without the joints that are like the first two."""


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(2))
def test_damaged_buses_are_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Each problem has a message, a remedy, and a line within its file."""
    # the EDS files are whole, and reading them takes longer than all the rest
    monkeypatch.setattr('arm_canopen.config.read.document.load_eds', cache(load_eds))
    generator = random.Random(seed)
    path = write_bus(tmp_path)
    (tmp_path / 'cia402_slave.eds').write_text(eds_text(), encoding='utf-8')
    for _ in range(200):
        text = mutated(TWO_JOINTS if seed % 2 else BUS, SNIPPETS, generator)
        path.write_text(text, encoding='utf-8', newline='')
        report = check_file(path)
        for problem in report.errors + report.warnings:
            assert problem.message
            assert problem.remedy
            within = len(text.splitlines()) + 1 if problem.file == path else 10_000
            assert 0 <= problem.line <= within


@pytest.mark.slow
@pytest.mark.parametrize('seed', range(2))
def test_damaged_eds_files_are_read_or_refused(tmp_path: Path, seed: int) -> None:
    """By themselves, and as those of a bus."""
    generator = random.Random(seed)
    bus, path = write_bus(tmp_path), tmp_path / 'drive.eds'
    for _ in range(130):
        text = mutated(SAMPLE, EDS_SNIPPETS, generator)
        path.write_text(text, encoding='utf-8', newline='')
        lines = text.count('\n') + text.count('\r') + 1
        report = check_file(bus)
        for problem in (*outcome(lambda: load_eds(path).warnings), *report.errors):
            assert 0 <= problem.line <= lines
            assert problem.message
            assert problem.remedy

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML as people write it: traps of version 1.1, anchors, duplicate keys, files that are none."""

from __future__ import annotations

from pathlib import Path

from config_samples import added, BUS, errors_of, load_text, write_bus
import pytest

from arm_canopen import CanopenError, ConfigError, load_bus


@pytest.mark.parametrize(
    'text',
    ['0x10', '16', '"16"', "'0x10'", '0b10000', '1_6', '+16', '16.0', '1.6e1', '1e1', '007'],
)
def test_notations_of_whole_numbers(tmp_path: Path, text: str) -> None:
    """All notations without doubt are taken: 16, or 10 of 1e1, or 7 of 007."""
    expected = {'1e1': 10, '007': 7}.get(text, 16)
    bus = load_text(tmp_path, added('joint1', f'node_id: {text}'))
    assert bus.nodes[0].node_id == expected


@pytest.mark.parametrize(
    ('text', 'value'), [('1e-5', 1e-5), ('"2.5"', 2.5), ('.5', 0.5), ('-3', -3.0), ('0x10', 16.0)]
)
def test_notations_of_numbers(tmp_path: Path, text: str, value: float) -> None:
    """A number may lack its point, although YAML 1.1 then takes 1e-5 for text."""
    bus = load_text(tmp_path, added('joint1', f'offset_pos_to_dev: {text}'))
    assert bus.nodes[0].drive.offset_pos_to_dev == value


@pytest.mark.parametrize('pair', ['true false', 'yes no', 'on off', 'True False', '1 0', 'Y N'])
def test_notations_of_booleans(tmp_path: Path, pair: str) -> None:
    """The words of YAML 1.1 and 0 and 1, which dcfgen takes for truth values, count."""
    buses = [load_text(tmp_path, added('joint1', f'mandatory: {word}')) for word in pair.split()]
    assert [bus.nodes[0].mandatory for bus in buses] == [True, False]


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
@pytest.mark.parametrize(
    ('text', 'line', 'message'),
    [
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
        ('[' * 5000, 0, 'nested too deeply'),
        ('a: &a [*a]\n', 1, 'an alias refers to what it is part of'),
        (f'{BUS}master: 1\n', 23, "'master' appears twice, first in line 1"),
        (added('joint1', 'tpdo: {1: {}, 0x1: {}}'), 23, "'1' appears twice"),
        (added('joint1', '? [a, b]\n: 1'), 23, 'a key must be a single word'),
        (added('joint1', '<<: 5'), 23, "'<<' takes a mapping"),
        (added('joint1', 'node_id: !secret 2'), 22, "the tag '!secret' has no meaning"),
        (added('joint1', 'node_id: !!python/object:os.system 2'), 22, 'python/object'),
    ],
    ids=lambda value: str(value)[-20:],
)
def test_what_is_no_good_yaml(tmp_path: Path, text: str, line: int, message: str) -> None:
    """Syntax, duplicate keys, recursion and tags are reported with their line, not a traceback."""
    path = tmp_path / 'bus.yml'
    write_bus(tmp_path).write_text(text, encoding='utf-8')
    with pytest.raises(ConfigError, match=message) as caught:
        load_bus(path)
    assert line in [problem.line for problem in caught.value.problems]


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

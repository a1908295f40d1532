# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 param` over DDS."""

from __future__ import annotations

from pathlib import Path

from frontend_cli import Ros2
import pytest

pytestmark = [pytest.mark.scenario, pytest.mark.usefixtures('zoo')]

NODE = '/factory/worker'
NAMES = ['fixed', 'gain', 'label', 'limits.upper', 'loose']
NAMES += ['start_type_description_service', 'use_sim_time']
TYPED = """\
  label (type: string)
  limits.upper (type: integer array)
  loose (type: string)
"""
DESCRIPTION = """\
Parameter name: gain
  Type: double
  Description: Gain of the loop
  Constraints:
    Min value: 0.0
    Max value: 10.0
    Step: 0.5
    Additional constraints: even
Parameter name: fixed
  Type: boolean
  Constraints:
    Read only: true
"""


@pytest.mark.parametrize(
    ('words', 'answer'),
    [
        ('list NODE', ''.join(f'  {name}\n' for name in NAMES)),
        ('list NODE --param-type --filter l', TYPED),
        ('get NODE fixed', 'Boolean value is: True\n'),
        ('get NODE gain', 'Double value is: 1.5\n'),
        ('get NODE limits.upper', "Integer values are: array('q', [1, 2, 3])\n"),
        ('get factory/worker gain --hide-type', '1.5\n'),
        ('describe NODE gain fixed', DESCRIPTION),
    ],
)
def test_what_is_there_is_answered_as_by_ros2cli(ros2: Ros2, words: str, answer: str) -> None:
    """Sorted names, values with their type in words; the leading slash may be left out."""
    outcome = ros2('param', *words.replace('NODE', NODE).split())
    assert (outcome.code, outcome.out) == (0, answer)


def test_list_of_all_nodes(ros2: Ros2) -> None:
    """Each below its node's name."""
    lines = ros2('param', 'list', '--spin-time', '2').lines
    heads = [line for line in lines if not line.startswith(' ')]
    assert heads == ['/factory/worker:', '/machine:', '/talker:']
    assert lines[1 : 1 + len(NAMES)] == [f'  {name}' for name in NAMES]


def test_set_is_seen_by_get(ros2: Ros2) -> None:
    """What YAML makes of the value decides its type."""
    done = ros2('param', 'set', NODE, 'loose', '[1.5, 2.0]')
    assert (done.code, done.out) == (0, 'Set parameter successful\n')
    values = ros2('param', 'get', NODE, 'loose').out
    assert values == "Double values are: array('d', [1.5, 2.0])\n"


def test_set_that_is_refused(ros2: Ros2) -> None:
    """The node's reason on stderr; the exit code is 0, as in ros2cli."""
    outcome = ros2('param', 'set', NODE, 'gain', '11.0')
    assert (outcome.code, outcome.out) == (0, '')
    assert outcome.err.startswith('Setting parameter failed: Parameter gain out of range')


def test_delete(ros2: Ros2) -> None:
    """A parameter of any type can go; others say why not."""
    refused = ros2('param', 'delete', NODE, 'label')
    assert refused.err == 'Deleting parameter failed: Static parameter cannot be undeclared\n'
    ros2('param', 'set', NODE, 'loose', 'x')
    assert ros2('param', 'delete', NODE, 'fixed').err.startswith('Deleting parameter failed: ')


def test_dump_can_be_loaded(ros2: Ros2, tmp_path: Path) -> None:
    """Every parameter comes back with its type; those that are read-only say so."""
    dumped = ros2('param', 'dump', NODE).out
    assert '    gain: 1.5\n    label: first\n    limits:\n      upper:\n      - 1\n' in dumped
    assert dumped.endswith('false\n\n')
    file = tmp_path / 'worker.yaml'
    file.write_text(dumped.replace('label: first', "label: '5'"))
    loaded = ros2('param', 'load', NODE, str(file))
    assert 'Set parameter gain successful' in loaded.lines
    assert 'Set parameter fixed failed: Trying to set a read-only parameter' in loaded.err
    assert ros2('param', 'get', NODE, 'label').out == 'String value is: 5\n'
    file.write_text(dumped)
    assert ros2('param', 'load', NODE, str(file), '--no-use-wildcard').code == 0


@pytest.mark.parametrize(
    ('words', 'problem'),
    [
        (('get', 'factory/workr', 'gain'), "Node not found\nDid you mean '/factory/worker'?\n"),
        (('get', NODE, 'gian'), 'Parameter not set\n'),
        (('load', NODE, '/no/such/file'), "No such file or directory: '/no/such/file'\n"),
        (('list', NODE, '--filter', '['), "Invalid --filter '[': unterminated"),
        (('dump', '/nobody', '--spin-time', '0.2'), 'Node not found'),
        (('describe', '/nobody', 'x', '--spin-time', '0.2'), 'Node not found'),
        (('set', '/nobody', 'x', '1', '--spin-time', '0.2'), 'Node not found'),
        (('delete', '/nobody', 'x', '--spin-time', '0.2'), 'Node not found'),
    ],
    ids=lambda value: ' '.join(value[:1]) if isinstance(value, tuple) else '',
)
def test_what_is_not_there(ros2: Ros2, words: tuple[str, ...], problem: str) -> None:
    """The sentence of ros2cli and the nearest name, exit code 1."""
    outcome = ros2('param', *words)
    assert (outcome.code, outcome.out) == (1, '')
    assert outcome.err.startswith(problem), outcome.err

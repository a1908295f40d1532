# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 lifecycle` over DDS."""

from __future__ import annotations

from frontend_cli import Ros2
import pytest

pytestmark = [pytest.mark.scenario, pytest.mark.usefixtures('zoo')]

UNCONFIGURED = """\
- configure [1]
\tStart: unconfigured
\tGoal: configuring
- shutdown [5]
\tStart: unconfigured
\tGoal: shuttingdown
"""


def test_nodes(ros2: Ros2) -> None:
    """Only nodes with a life cycle."""
    assert ros2('lifecycle', 'nodes').lines == ['/machine']
    assert ros2('lifecycle', 'nodes', '-c', '--spin-time', '2').out == '1\n'


def test_a_node_through_its_life(ros2: Ros2) -> None:
    """States and transitions by label and number, back to where it began."""
    assert ros2('lifecycle', 'get', '/machine').out == 'unconfigured [1]\n'
    assert ros2('lifecycle', 'list', 'machine').out == UNCONFIGURED
    assert ros2('lifecycle', 'set', '/machine', 'configure').out == 'Transitioning successful\n'
    assert ros2('lifecycle', 'get').out == '/machine: inactive [2]\n'
    assert ros2('lifecycle', 'set', '/machine', '2').out == 'Transitioning successful\n'
    assert ros2('lifecycle', 'get', '/machine').out == 'unconfigured [1]\n'


def test_all_transitions(ros2: Ros2) -> None:
    """The whole state machine, with those that the node makes by itself."""
    lines = ros2('lifecycle', 'list', '/machine', '-a').lines
    assert lines[:3] == UNCONFIGURED.splitlines()[:3]
    assert len(lines) == 3 * 25
    assert '- transition_error [62]' in lines


def test_a_transition_that_is_not_possible(ros2: Ros2) -> None:
    """Those that are possible are listed."""
    outcome = ros2('lifecycle', 'set', '/machine', 'activate')
    assert outcome.code == 1
    assert outcome.err == (
        'Unknown transition requested, available ones are:\n- configure [1]\n- shutdown [5]\n'
    )


@pytest.mark.parametrize(
    'words', [('get', '/machin'), ('set', '/machin', '1'), ('list', '/machin')]
)
def test_a_node_that_is_not_there(ros2: Ros2, words: tuple[str, ...]) -> None:
    """The sentence of ros2cli."""
    outcome = ros2('lifecycle', *words, '--spin-time', '0.2')
    assert (outcome.code, outcome.out) == (1, '')
    assert outcome.err.startswith('Node not found\n')

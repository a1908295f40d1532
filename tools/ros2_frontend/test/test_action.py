# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 action` over DDS, against a server of an action that is built for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
import re
import sys

from frontend_cli import PROGRAM, Ros2, with_frontend
from isolation import reserve
from processes import RunningProcess
import pytest

pytestmark = [pytest.mark.scenario]

TYPE = 'arm_msgs/action/Home'
SUCCESS = """\
Waiting for an action server to become available...
Sending goal:
     method: 2

Goal accepted with ID: [0-9a-f]{32}

Result:
    success: false
message: counted to 2
position: 0.0

Goal finished with status: SUCCEEDED
"""


@pytest.fixture(scope='module')
def counter() -> Iterator[tuple[RunningProcess, Mapping[str, str]]]:
    """Start the action server in a domain of its own."""
    program = str(Path(__file__).with_name('frontend_counter.py'))
    with reserve() as isolation:
        env = with_frontend(isolation.env)
        with RunningProcess([sys.executable, program], env) as process:
            process.wait_for('^ready$', timeout=60.0)
            yield process, env


@pytest.fixture
def run(
    counter: tuple[RunningProcess, Mapping[str, str]], ros2: Ros2, monkeypatch: pytest.MonkeyPatch
) -> Ros2:
    """Run a command line in this process, in the domain of the server."""
    monkeypatch.setenv('ROS_DOMAIN_ID', counter[1]['ROS_DOMAIN_ID'])
    return ros2


def test_list_info_and_type(run: Ros2) -> None:
    """The action, who offers it, and its type."""
    assert run('action', 'list', '-t').out == f'/count [{TYPE}]\n'
    info = 'Action: /count\nAction clients: 0\nAction servers: 1\n'
    assert run('action', 'info', '/count', '-t').out == f'{info}    /counter [{TYPE}]\n'
    assert run('action', 'type', '/count').out == f'{TYPE}\n'


def test_node_info_names_actions(run: Ros2) -> None:
    """In the block of action servers; their topics and services are hidden."""
    out = run('node', 'info', '/counter').out
    assert f'  Action Servers:\n    /count: {TYPE}\n  Action Clients:\n' in out
    assert '/_action/' not in out


def test_a_goal_that_succeeds(run: Ros2) -> None:
    """Each step is printed, as ros2cli does."""
    outcome = run('action', 'send_goal', '/count', TYPE, '{method: 2}')
    assert (outcome.code, outcome.err) == (0, '')
    assert re.fullmatch(SUCCESS, outcome.out), outcome.out


def test_feedback_on_request(run: Ros2) -> None:
    """Steps in their order; on a busy machine DDS drops what its queue of ten does not hold."""
    out = run('action', 'send_goal', '-f', '/count', TYPE, '{method: 90}').out
    steps = [int(step) for step in re.findall(r'Feedback:\n.*\n.*\nelapsed: (\d+)\.0\n\n', out)]
    assert len(steps) > 10
    assert steps == sorted(set(steps))
    assert steps[-1] <= 90


def test_goals_that_do_not_succeed(run: Ros2) -> None:
    """A rejected and an aborted goal are reported, with exit code 0, as ros2cli."""
    rejected = run('action', 'send_goal', '/count', TYPE, '{method: -1}')
    assert (rejected.code, rejected.out.splitlines()[-1]) == (0, 'Goal was rejected.')
    aborted = run('action', 'send_goal', '/count', TYPE)  # without YAML: method 0
    assert (aborted.code, aborted.out.splitlines()[-1]) == (
        0,
        'Goal finished with status: ABORTED',
    )


def test_an_interrupt_cancels_the_goal(counter: tuple[RunningProcess, Mapping[str, str]]) -> None:
    """Ctrl-C does not leave a robot moving."""
    server, env = counter
    words = [*PROGRAM, 'action', 'send_goal', '-f', '/count', TYPE, '{method: 100}']
    with RunningProcess(words, env) as process:
        process.wait_for(r'^elapsed: \d+')  # the first ones may come before it listens
        assert process.stop() == 2
        assert 'Canceling goal...' in process.lines
        assert process.lines[-1] == 'Goal canceled.'
        assert 'Traceback' not in process.output
    server.wait_for('^cancelled$')


@pytest.mark.parametrize(
    ('words', 'problem'),
    [
        (('arm_msgs/action/Hom',), f"is invalid\nDid you mean '{TYPE}'?\n"),
        (('std_srvs/srv/Trigger',), 'The passed action type is invalid: std_srvs/srv/Trigger is'),
        ((TYPE, '{velocity: 1}'), "Failed to populate message fields: 'Home_Goal' object has no"),
        ((TYPE, 'method:1'), 'The passed value needs to be a dictionary'),
    ],
    ids=['type', 'kind', 'field', 'yaml'],
)
def test_goals_that_cannot_be(run: Ros2, words: tuple[str, ...], problem: str) -> None:
    """Refused before anything is sent."""
    outcome = run('action', 'send_goal', '/count', *words)
    assert (outcome.code, outcome.out) == (1, '')
    assert problem in outcome.err


def test_a_server_that_is_not_there_yet(counter: tuple[RunningProcess, Mapping[str, str]]) -> None:
    """It waits, says what is near, and Ctrl-C ends it."""
    words = [*PROGRAM, 'action', 'send_goal', '/cont', TYPE]
    with RunningProcess(words, counter[1]) as process:
        process.wait_for("^There is no action '/cont' yet.$")
        process.wait_for("^Did you mean '/count'")
        assert process.stop() == 2

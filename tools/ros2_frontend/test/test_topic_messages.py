# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic echo` and `pub` over DDS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import re
import time

from frontend_cli import PROGRAM, Ros2
from processes import RunningProcess
import pytest

pytestmark = [pytest.mark.scenario, pytest.mark.usefixtures('zoo')]

JOINTS = """\
header:
  stamp:
    sec: \\d+
    nanosec: \\d+
  frame_id: base
name:
- one
- two
position:
- 0.5
- -1.0
velocity: \\[\\]
effort: \\[\\]
---
"""


@pytest.mark.parametrize(
    ('words', 'printed'),
    [
        ('/joint_states --once', JOINTS),
        ('/latched --once', 'data: kept\n---\n'),  # durability is chosen by its publisher
        ("/chatter --once --filter m.data.endswith('7')", r"data: 'Hello World: \d*7'\n---\n"),
        ('/listener/input std_msgs/msg/String --timeout 0.1', ''),  # the end of the wait
    ],
)
def test_echo_prints_yaml(ros2: Ros2, words: str, printed: str) -> None:
    """One message, as ros2cli prints it; a filter, and what was published before."""
    outcome = ros2('topic', 'echo', *words.split())
    assert (outcome.code, outcome.err) == (0, '')
    assert re.fullmatch(printed, outcome.out), outcome.out


def test_echo_of_publishers_that_differ(ros2: Ros2) -> None:
    """It says so, and takes what connects to all."""
    lines = ros2('topic', 'echo', '/mixed', '--once').lines
    assert lines[0] == (
        'Some, but not all, publishers are offering QoSReliabilityPolicy.RELIABLE. Falling back '
        'to QoSReliabilityPolicy.BEST_EFFORT as it will connect to all publishers'
    )
    assert lines[1].startswith('data: ')


@pytest.mark.parametrize(
    ('words', 'out', 'problem'),
    [
        (
            ('/chater',),
            'WARNING: topic [/chater] does not appear to be published yet\n',
            "Could not determine the type for the passed topic\nDid you mean '/chatter'",
        ),
        (('/chatter', 'std_msgs/msg/Strin'), '', 'The passed message type is invalid\nDid you'),
        (('/chatter', 'std_srvs/srv/Trigger'), '', 'The passed message type is invalid'),
        (('/chatter', '--field', '.'), '', "Invalid field value '.'"),
        (('/chatter', '--field', 'dat'), '', "Invalid field 'dat': 'String' object has no"),
        (('/chatter', '--filter', 'm..'), '', "Invalid filter 'm..'"),
    ],
    ids=['topic', 'type', 'kind', 'no field', 'field', 'filter'],
)
def test_echo_of_what_is_not_there(
    ros2: Ros2, words: tuple[str, ...], out: str, problem: str
) -> None:
    """The sentence of ros2cli and the nearest name."""
    outcome = ros2('topic', 'echo', *words)
    assert (outcome.code, outcome.out) == (1, out)
    assert outcome.err.startswith(problem), outcome.err


@pytest.fixture
def received(ros2: Ros2) -> Callable[[str], None]:
    """Wait until the listener has received something."""

    def wait(text: str) -> None:
        deadline = time.monotonic() + 20.0
        while text not in (
            answer := ros2('service', 'call', '/last_received', 'std_srvs/Trigger').out
        ):
            assert time.monotonic() < deadline, answer

    return wait


def publish(zoo: Mapping[str, str], *words: str) -> RunningProcess:
    """Publish with a QoS and a life that give the listener all the time it needs."""
    qos = ('--qos-durability', 'transient_local', '--keep-alive', '60')
    return RunningProcess([*PROGRAM, 'topic', 'pub', *qos, *words], zoo)


def test_pub_once_waits_for_the_subscription(
    zoo: Mapping[str, str], received: Callable[[str], None]
) -> None:
    """It begins when the subscription matches, and says what it sends."""
    words = ('--once', '/listener/input', 'std_msgs/msg/String', '{data: foo}')
    with publish(zoo, *words) as process:
        process.wait_for('^publisher: beginning loop$')
        process.wait_for(r"^publishing #1: std_msgs\.msg\.String\(data='foo'\)$")
        received('foo;')
        assert process.stop() == 2
        assert not any('#2' in line for line in process.lines)


def test_pub_counts_and_prints_every_nth(
    zoo: Mapping[str, str], received: Callable[[str], None]
) -> None:
    """Four messages, every second is printed."""
    words = ('-t', '4', '-p', '2', '-r', '100', '/listener/input', 'std_msgs/String', 'data: a')
    with publish(zoo, *words) as process:
        received('a;a;a;a;')
        printed = [line.split()[1] for line in process.lines if '#' in line]
        assert printed == ['#2:', '#4:']


def test_pub_stamps_at_the_moment_of_sending(
    zoo: Mapping[str, str], received: Callable[[str], None]
) -> None:
    """`header: auto` arrives with the time that is printed."""
    words = ('--once', '/listener/stamped', 'sensor_msgs/msg/JointState', '{header: auto}')
    with publish(zoo, *words) as process:
        line = process.wait_for(r'Time\(sec=[1-9]\d+')
        received(f'stamp {line.split("Time(sec=")[1].split(",")[0]};')


def test_pub_once_ends_by_itself(ros2: Ros2) -> None:
    """Exit code 0 after the message."""
    words = ('/listener/input', 'std_msgs/msg/String', '{data: end}')
    outcome = ros2('topic', 'pub', '--once', '--qos-durability', 'transient_local', *words)
    assert (outcome.code, outcome.err) == (0, '')
    assert outcome.lines[-2:] == ["publishing #1: std_msgs.msg.String(data='end')", '']


def test_pub_says_when_qos_does_not_fit(zoo: Mapping[str, str]) -> None:
    """The listener wants what was sent before it came; a volatile publisher never matches."""
    words = [*PROGRAM, 'topic', 'pub', '--once', '/listener/input', 'std_msgs/msg/String']
    with RunningProcess(words, zoo) as process:
        process.wait_for('requesting incompatible QoS.*DURABILITY')
        assert process.stop() == 2


@pytest.mark.parametrize(
    ('words', 'problem'),
    [
        (('std_msgs/msg/Strin',), 'The passed message type is invalid\n'),
        (('std_msgs/msg/String', 'data'), 'The passed value needs to be a dictionary in YAML'),
        (
            ('std_msgs/msg/String', '{dat: a}'),
            "Failed to populate field: 'String' object has no attribute 'dat'\nString has the",
        ),
        (
            ('--once', '--max-wait-time-secs', '0.1', 'std_msgs/msg/String'),
            'Timed out waiting for subscribers: Expected 1 subcribers but only got 0',
        ),
        (('std_msgs/msg/String', '-n', 'not valid'), 'Invalid node name: node name must not'),
    ],
    ids=['type', 'no mapping', 'field', 'nobody', 'node name'],
)
def test_pub_of_what_cannot_be(ros2: Ros2, words: tuple[str, ...], problem: str) -> None:
    """Exit code 1 and the reason."""
    outcome = ros2('topic', 'pub', '/nobody', *words)
    assert outcome.code == 1
    assert outcome.err.startswith(problem), outcome.err

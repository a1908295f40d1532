# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic hz`, `bw` and `delay` over DDS; the talker sends 50 messages a second."""

from __future__ import annotations

from collections.abc import Mapping

from frontend_cli import PROGRAM, Ros2
from processes import RunningProcess
import pytest

pytestmark = pytest.mark.scenario

SECOND_LINE = r'^\tmin: \d+\.\d{3}s max: \d+\.\d{3}s std dev: \d+\.\d{5}s window: \d+$'


def test_rates_of_a_running_topic(zoo_env: Mapping[str, str]) -> None:
    """Each prints its two lines; Ctrl-C ends it."""
    with (
        RunningProcess([*PROGRAM, 'topic', 'hz', '/chatter'], zoo_env) as hz,
        RunningProcess([*PROGRAM, 'topic', 'bw', '/chatter'], zoo_env) as bw,
        RunningProcess([*PROGRAM, 'topic', 'delay', '/joint_states'], zoo_env) as delay,
    ):
        rate = float(hz.wait_for(r'^average rate: \d+\.\d{3}$').split()[-1])
        hz.wait_for(SECOND_LINE)
        assert 25.0 < rate < 75.0
        assert bw.wait_for('.') == 'Subscribed to [/chatter]'
        bw.wait_for(r'^\d+(\.\d\d)? K?B/s from \d+ messages$')
        bw.wait_for(r'^\tMessage size mean: \d+ B min: \d+ B max: \d+ B$|KB')
        delay.wait_for(r'^average delay: \d+\.\d{3}$')
        delay.wait_for(SECOND_LINE)
        assert [process.stop() for process in (hz, bw, delay)] == [2, 2, 2]


def test_hz_waits_for_a_topic_that_comes_later(zoo_env: Mapping[str, str]) -> None:
    """It says so, goes on when the topic appears, and an interrupt meanwhile is quiet."""
    words = [*PROGRAM, 'topic', 'pub', '-r', '50', '/later', 'std_msgs/msg/String']
    with (
        RunningProcess([*PROGRAM, 'topic', 'hz', '/later'], zoo_env) as hz,
        RunningProcess([*PROGRAM, 'topic', 'hz', '/later'], zoo_env) as interrupted,
    ):
        for each in (interrupted, hz):
            each.wait_for(r'^WARNING: topic \[/later\] does not appear to be published yet$')
        assert interrupted.stop() == 2
        assert 'Traceback' not in interrupted.output
        with RunningProcess(words, zoo_env):
            hz.wait_for('^average rate: ')


@pytest.mark.usefixtures('zoo')
@pytest.mark.parametrize(
    ('words', 'problem'),
    [('delay', 'msg does not have header\n'), ('hz --filter m.', "Invalid filter 'm.'")],
)
def test_what_cannot_be_is_refused_before_it_waits(ros2: Ros2, words: str, problem: str) -> None:
    """A type without a header, and an expression that is no Python."""
    verb, *options = words.split()
    outcome = ros2('topic', verb, '/chatter', *options)
    assert outcome.code == 1
    assert outcome.err.startswith(problem)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who moves the robot, as the page and /diagnostics say it."""

from __future__ import annotations

from concurrent.futures import Future
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time
import pytest
from sensor_msgs.msg import JointState

from robot_viewer.nodes import state
from robot_viewer.nodes.state import Judge, Watch
from robot_viewer.robot_state import Stop

PERIOD = 0.05  # [s]


class Bench:
    """A judge without DDS and browser, and its clock."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 100.0
        monkeypatch.setattr(state, 'time', SimpleNamespace(monotonic=lambda: self.now))
        self.sentences: list[str] = []
        self.live = SimpleNamespace(held='', holder=0, stop=lambda: None)
        page: Any = SimpleNamespace(live=self.live, last='', watched=False)
        clock = SimpleNamespace(now=lambda: SimpleNamespace(to_msg=Time))
        publisher = SimpleNamespace(publish=lambda m: self.sentences.append(m.status[0].message))
        node: Any = SimpleNamespace(
            create_publisher=lambda *_: publisher,
            get_clock=lambda: clock,
            get_name=lambda: 'web_viewer',
        )
        calls: Any = SimpleNamespace(running='', forget=lambda _: None)
        self.calls = calls
        self.watch = Watch()
        self.watch.listen(begins=True)
        self.judge = Judge(node, page, self.watch, calls)
        self.judge.robot = 'arm'

    def look(self, seconds: float, velocity: float, drives: str = '') -> str:
        """Let time pass with a joint at a velocity; return what is said then."""
        for _ in range(round(seconds / PERIOD)):
            self.now += PERIOD
            self.watch.take_joints(JointState(name=['a'], position=[0.0], velocity=[velocity]))
            self.judge.judge(
                {'a': 0.0}, publishes=True, limit='', battery='', drives=drives, controllers=()
            )
        return self.sentences[-1]


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    """Make one."""
    return Bench(monkeypatch)


def test_what_the_page_has_moved_is_no_program(bench: Bench) -> None:
    """Also while it brakes; a motion that begins later, or does not end, is one."""
    assert bench.look(0.5, 0.0).startswith('READY')
    bench.live.held = '1 +'
    assert '1 + is held' in bench.look(0.3, 0.0)
    bench.look(1.0, 0.2)
    bench.live.held = ''
    assert bench.look(1.0, 0.2) == 'MOVING: It comes to rest.'
    assert bench.look(1.0, 0.0).startswith('READY')
    assert bench.look(0.1, 0.2) == 'MOVING: A program moves it.'
    assert 'executed' in bench.look(1.0, 0.2, 'The plan is executed.')
    assert bench.look(state.COAST_TIME + 0.1, 0.2) == 'MOVING: A program moves it.'
    bench.calls.running = 'Home joint1'
    assert 'Home joint1 was pressed' in bench.look(0.2, 0.2)


def test_a_motion_from_before_a_stop_is_no_program(bench: Bench) -> None:
    """The robot stands when it has confirmed it; what moves after that is reported."""
    bench.look(1.0, 0.2)
    answer: Future[Stop] = Future()
    bench.judge.stop(answer, lambda order: order())
    assert bench.look(0.2, 0.2).startswith('STOPPING')
    answer.set_result(Stop(stands=True, text='stopped: all'))
    assert bench.look(PERIOD, 0.0).startswith('STOPPED')
    assert bench.look(1.0, 0.0).startswith('STOPPED')
    assert 'A program moves it after STOP' in bench.look(0.2, 0.2)

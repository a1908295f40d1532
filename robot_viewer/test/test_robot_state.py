# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""May the robot be moved? The worst that was seen counts; who moves it is said, too."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import replace
import itertools
from types import SimpleNamespace
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from hypothesis import given
from hypothesis import strategies as st
import pytest
from sensor_msgs.msg import JointState

from robot_viewer.nodes import state
from robot_viewer.nodes.state import Judge, Watch
from robot_viewer.robot_state import (
    ALLOW,
    Level,
    robot_state,
    Seen,
    SILENCE,
    STALE,
    Status,
    Stop,
    walks,
)

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


def test_what_came_before_a_silence_is_unknown(bench: Bench) -> None:
    """Nothing of a robot that is silent stays green; what comes in the silence counts."""
    bench.look(0.5, 0.0)
    good = DiagnosticStatus(name='j1: drive', message='enabled')
    bench.watch.take_statuses(DiagnosticArray(status=[good]))
    bench.look(0.1, 0.0)
    assert bench.watch.aged(bench.now)[0].level == 0
    silent = bench.now + SILENCE + 0.1
    (old,) = bench.watch.aged(silent)
    assert (old.level, old.message) == (STALE, 'unknown for 1 s; before: enabled')
    bench.now = silent
    bench.watch.take_statuses(DiagnosticArray(status=[good]))
    assert bench.watch.aged(silent + 0.1)[0].level == 0


ON = {'state': 'Operation enabled', 'mode': 'Cyclic position', 'online': 'True'}
GOOD = Status('j1: drive', 0, 'enabled', ON)
FAULT = Status('j1: drive', 2, 'x', {'state': 'Fault', 'error_code': '0x2310 over current'})
OTHER_FAULT = replace(FAULT, name='j2: drive')
LOST = Status('j1: drive', 2, 'offline, waiting for the device', {'online': 'False'})
FAULTS = (FAULT, OTHER_FAULT, LOST)
BOOTS = Status(
    'j1: drive', 2, 'offline, configuring', {'online': 'False', 'boot_phase': 'configuring'}
)
OFF = Status('j1: drive', 0, 'off', {'state': 'Switch on disabled', 'mode': 'No mode'})
NO_MODE = Status('j1: drive', 0, 'on', ON | {'mode': 'No mode'})
OLD = Status('j1: drive', 3, 'unknown for 9 s; before: enabled', ON)
SERVICES = frozenset(
    f'/{drive}/{verb}'
    for drive in ('j1', 'j2', 'xj1')
    for verb in ('recover', 'init', 'cyclic_position_mode')
) | {'/controller_node/clear_fault'}
ROBOT = Seen('panda', statuses=[GOOD], services=SERVICES)


def legs(level: int, state: str, message: str = '') -> Status:
    """Return a status of the controller of a quadruped."""
    values = {'state': state, 'goal': state, 'velocity': '0 0 0'}
    return Status('controller_node: state', level, message or state, values)


STOOD, REFUSED = Stop('stopped: j1. stand: j2', stands=True), Stop('no', stands=False)
BUS_OFF = Status('master: bus', 2, 'bus off')
CAMERA = Status('camera: frames', 2, 'no frames')
WAITS = legs(3, 'relax', 'waiting for /joint_states')
NO_CONTACT = 'NO CONTACT WITH THE ROBOT'


@pytest.mark.parametrize(
    ('changes', 'word', 'part', 'action', 'calls'),
    [
        ({'robot': ''}, 'NO ROBOT', 'Start one', '', 0),
        ({'silence': 12.0}, NO_CONTACT, 'for 12 s. STOP may', '', 0),
        ({'statuses': [OLD]}, NO_CONTACT, 'unknown for 9 s', '', 0),
        ({'statuses': [OLD, OTHER_FAULT]}, NO_CONTACT, 'emergency stop. j2 is faulty.', '', 0),
        ({'statuses': [WAITS]}, NO_CONTACT, 'waiting for', '', 0),
        ({'statuses': [FAULT], 'stop': STOOD}, 'FAULT', 'j1: 0x2310 over', 'Recover j1', 1),
        ({'statuses': [FAULT]}, 'FAULT', '. Remove the cause, then recover.', 'Recover j1', 1),
        ({'statuses': [FAULT, OTHER_FAULT]}, 'FAULT (2)', 'j1: ', 'Recover all 2', 2),
        ({'statuses': [LOST]}, 'FAULT', 'offline', 'Recover j1', 1),
        ({'statuses': [FAULT], 'acting': 'Recover j1'}, 'FAULT', 'Recover j1 ...', '', 0),
        ({'statuses': [GOOD, BUS_OFF]}, 'FAULT', 'master: bus: bus off', '', 0),
        ({'statuses': [legs(2, 'fault', 'fell')]}, 'FAULT', 'fell.', 'Clear fault', 1),
        ({'stop': Stop()}, 'STOPPING', 'not confirmed yet', ALLOW, 0),
        ({'stop': REFUSED}, 'STOP NOT CONFIRMED', 'use the emergency stop. no', ALLOW, 0),
        ({'stop': STOOD}, 'STOPPED', 'Stopped: j1; the others stand. Nothing', ALLOW, 0),
        ({'stop': STOOD, 'moving': True}, 'MOVING', 'moves it after STOP', ALLOW, 0),
        ({'statuses': [BOOTS]}, 'NOT ENABLED', 'j1: offline, configuring.', '', 0),
        ({'statuses': [OFF]}, 'NOT ENABLED', '1 of 1 drives', 'Enable j1', 2),
        ({'statuses': [NO_MODE]}, 'NOT ENABLED', 'no mode', 'Select the mode', 1),
        ({'limit': 'j2 is at its end'}, 'AT A LIMIT', 'J2 is at its end.', '', 0),
        ({'moving': True}, 'MOVING', 'A program moves it.', '', 0),
        ({}, 'READY', 'Hold a button to move.', '', 0),
        ({'statuses': []}, 'READY', 'no drives', '', 0),
        ({'statuses': [GOOD, CAMERA]}, 'READY', 'move. camera: frames reports an', '', 0),
        ({'statuses': [legs(0, 'stand')]}, 'STANDING', 'Press Walk', '', 0),
        ({'statuses': [legs(0, 'walk')]}, 'READY', 'Hold an arrow', '', 0),
        ({'statuses': [legs(0, 'walk')], 'moving': True}, 'WALKING', 'A program', '', 0),
        ({'statuses': [legs(1, 'lie', 'low')]}, 'LYING', 'low.', '', 0),
        ({'statuses': [legs(0, 'to stand')]}, 'MOVING', 'Mode to stand.', '', 0),
    ],
)
def test_the_state_is_one_word_with_one_action(
    changes: dict[str, Any], word: str, part: str, action: str, calls: int
) -> None:
    """As the page, /diagnostics and the terminal show it, of a robot with one good drive."""
    seen = replace(ROBOT, **changes)
    state = robot_state(seen)
    assert (state.word, state.action) == (word, action)
    assert part in state.sentence
    assert sum(map(len, state.calls)) == calls
    assert not any('/xj1/' in service for group in state.calls for service in group)
    assert len(state.faulty) == sum(each in FAULTS for each in seen.statuses)


@given(
    st.sampled_from([0.0, 12.0]),
    st.lists(st.sampled_from([GOOD, FAULT, OFF, NO_MODE, OLD, BOOTS, LOST]), max_size=3),
    st.sampled_from([None, Stop(), Stop('x', stands=True), Stop('x', stands=False)]),
    st.booleans(),
)
def test_motion_is_possible_only_where_nothing_speaks_against_it(
    silence: float, statuses: list[Status], stop: Stop | None, moving: bool
) -> None:
    """Green and amber mean that it may be moved; each other color has a reason."""
    named = [replace(each, name=f'j{n}: drive') for n, each in zip(itertools.count(), statuses)]
    state = robot_state(replace(ROBOT, silence=silence, statuses=named, stop=stop, moving=moving))
    wrong = silence > 0.0 or stop is not None or any(each is not GOOD for each in statuses)
    assert state.movable is not wrong
    assert (state.level is Level.WELL) is not wrong
    assert state.level.exit_code == 0 or wrong


def test_an_error_of_another_node_bars_no_motion() -> None:
    """It is shown, in amber; a fault is what keeps the robot itself from moving."""
    for robot in (ROBOT, replace(ROBOT, statuses=[legs(0, 'walk')])):
        state = robot_state(replace(robot, statuses=[*robot.statuses, CAMERA]))
        assert state.movable
        assert state.level is Level.WARNING


@pytest.mark.parametrize(
    ('state', 'velocity', 'expected'),
    [('walk', '0.100 0.000 0.000', True), ('walk', '0 0 0', False), ('stand', '0.1 0 0', False)],
)
def test_legs_walk_where_they_follow_a_velocity(state: str, velocity: str, expected: bool) -> None:
    """Their joints move while they stand up, too."""
    status = legs(0, state)
    assert walks(replace(status, values={**status.values, 'velocity': velocity})) is expected

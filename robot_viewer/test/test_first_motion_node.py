# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion between a page and a drive: what is asked, and what becomes of no answer."""

from __future__ import annotations

from collections.abc import Callable
import math
import sys
from types import SimpleNamespace
from typing import Any

import pytest
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from urdf_reader import read_urdf
from urdf_robots import ARM

from arm_msgs.srv import ReadUnits
from robot_viewer.nodes import first_motion
from robot_viewer.nodes.first_motion import (
    ANSWER_TIMEOUT,
    DISABLE_TIMEOUT,
    FirstMotion,
    READ_UNITS_TYPE,
    SETTLE_TIME,
)
from robot_viewer.page.first_motion import MotionRequest, RELEASED_AFTER, Saw
from robot_viewer.robot_state import Status

PERIOD = 1.0 / 30.0  # [s]
JOINTS = [joint.name for joint in read_urdf(ARM).movable() if joint.mimic is None][:2]
REQUEST = MotionRequest(JOINTS[0], math.radians(1.0), math.radians(0.5))
ENABLED = {'state': 'Operation enabled', 'mode': 'Cyclic position'}


class Future:
    """The answer of a service, once it is given."""

    def __init__(self) -> None:
        self._done: Callable[[Any], None] = lambda _: None
        self._response: Any = None

    def add_done_callback(self, done: Callable[[Any], None]) -> None:
        """Take who waits."""
        self._done = done

    def exception(self) -> None:
        """Nothing was raised."""

    def result(self) -> Any:
        """Return what came."""
        return self._response

    def answer(self, *, success: bool = True, message: str = '', **values: object) -> None:
        """Answer it."""
        self._response = SimpleNamespace(success=success, message=message, **values)
        self._done(self)


class Robot:
    """A node that has no DDS, a page that has no browser, and their clock."""

    def __init__(self) -> None:
        self.now = 100.0
        self.calls: list[tuple[str, Future]] = []
        self.targets: list[float] = []
        self.shown: list[str] = []
        self.preparable = True
        self.positions = dict.fromkeys(JOINTS, 0.2)
        self.statuses: dict[str, Status] = {}
        self.motion = FirstMotion(
            self,  # type: ignore[arg-type]  # a node without DDS
            None,  # type: ignore[arg-type]  # there is no page; this is its panel, too
            self.positions,
            self.statuses,
            lambda order: order(),
        )
        self.motion.describe(read_urdf(ARM))
        drives = [f'/{name}' for name in JOINTS]
        self.motion.look({f'{each}/read_units': [READ_UNITS_TYPE] for each in drives}, drives)

    # -- the node

    def create_client(self, kind: type, name: str) -> Any:
        """Make a client whose calls are answered by the test."""
        assert kind in {ReadUnits, Trigger}

        def call(_request: object) -> Future:
            self.calls.append((name, Future()))
            return self.calls[-1][1]

        return SimpleNamespace(call_async=call)

    def destroy_client(self, _client: object) -> None:
        """Nothing is left of it."""

    def create_publisher(self, _kind: type, _topic: str, _depth: int) -> Any:
        """Make a publisher that keeps what it gets."""

        def publish(message: Float64) -> None:
            self.targets.append(message.data)

        return SimpleNamespace(publish=publish)

    def get_logger(self) -> Any:
        """Return one that is silent."""
        return SimpleNamespace(info=lambda _: None, warning=lambda _: None, error=lambda _: None)

    # -- the panel

    def begin(self, text: str, *, failed: bool) -> None:
        """Show it."""
        self.preparable = True
        self.shown.append(text)

    def show_waiting(self, text: str, *, failed: bool) -> None:
        """Show it."""
        self.preparable = False
        self.shown.append(text)

    def show_ready(self, announced: list[str]) -> None:
        """Show it."""
        self.shown.append(announced[0])

    def ask(self, ended: str, _reported: float) -> None:
        """Show it."""
        self.shown.append(ended)

    def show_judgement(self, judgement: Any, *, right: bool) -> None:
        """Show it."""
        self.shown.append(judgement.verdict.value)

    # -- what happens

    def look(self, seconds: float = PERIOD, **at: float) -> None:
        """Advance the time; positions and statuses come all the while."""
        until = self.now + seconds - 1e-9
        while self.now < until:
            self.now += PERIOD
            self.positions.update(at)
            self.motion.take(self.positions)
            name = f'{REQUEST.joint}: drive'
            self.statuses[name] = Status(name, 0, '', ENABLED)
            self.motion.advance()

    def answer(self, name: str, *, success: bool = True, message: str = '') -> None:
        """Answer the last call, which is of that service."""
        asked, future = self.calls[-1]
        assert asked == f'/{REQUEST.joint}/{name}'
        future.answer(success=success, message=message)

    def prepare(self) -> None:
        """Prepare a motion."""
        self.motion.prepare(REQUEST)
        assert self.calls[-1][0].endswith('read_units')
        self.calls[-1][1].answer(
            scale_from_factor_group=False,
            scale_pos_to_dev=1e4,
            scale_pos_from_dev=1e-4,
            scale_vel_to_dev=1e4,
            scale_vel_from_dev=1e-4,
            scale_eff_to_dev=1.0,
            scale_eff_from_dev=1.0,
            offset_pos_from_dev=0.0,
            gear=0.0,
            factor_scale=0.0,
            bus_config='/none/bus.yml',
            bus_config_inode=0,
            bus_config_changed=0,
            device=REQUEST.joint,
            channel=-1,
        )
        self.answer('enable')
        self.look(RELEASED_AFTER + 2 * PERIOD)

    def hold(self, seconds: float, factor: float = 1.0) -> None:
        """Hold the button; the joint goes where it is sent, times a factor."""
        start = self.positions[REQUEST.joint]
        for _ in range(round(seconds / PERIOD)):
            self.motion.beat(self.now)
            count = len(self.targets)
            self.look()
            if len(self.targets) > count:
                self.positions[REQUEST.joint] = start + factor * (self.targets[-1] - start)


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch) -> Robot:
    """Make one, whose clock the test has; it is its own panel."""
    monkeypatch.setattr(
        first_motion, 'FirstMotionPanel', lambda _page, _joints, motion: motion._node
    )
    made = Robot()
    monkeypatch.setattr(first_motion, 'time', SimpleNamespace(monotonic=lambda: made.now))
    return made


def test_a_service_that_refuses_or_is_silent_ends_the_preparation(robot: Robot) -> None:
    """And another attempt can be made; what is answered too late counts no more."""
    robot.motion.prepare(REQUEST)
    assert not robot.preparable
    robot.answer('read_units', success=False, message='SDO abort')
    assert robot.shown[-1] == f'{REQUEST.joint}: read_units: SDO abort'
    robot.motion.prepare(REQUEST)
    late = robot.calls[-1][1]
    robot.look(ANSWER_TIMEOUT - PERIOD)
    assert not robot.preparable
    robot.look(3 * PERIOD)
    assert robot.preparable
    assert 'read_units: no answer within 20 s' in robot.shown[-1]
    count = len(robot.calls)
    late.answer()
    assert len(robot.calls) == count
    assert not robot.motion.busy


def test_what_is_no_first_motion_is_not_asked_for(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The field of the browser is no limit; and an installation may lack the service."""
    for distance, speed in ((1.0, 0.01), (math.nan, 0.01), (0.0, 0.01), (0.01, 1.0), (0.01, -1.0)):
        robot.motion.prepare(MotionRequest(REQUEST.joint, distance, speed))
        assert 'a first motion is' in robot.shown[-1]
    monkeypatch.setitem(sys.modules, 'arm_msgs.srv', None)
    robot.motion.prepare(REQUEST)
    assert 'arm_msgs' in robot.shown[-1]
    assert 'not installed' in robot.shown[-1]
    assert robot.calls == []


@pytest.mark.parametrize('position', [math.nan, None])
def test_a_joint_of_which_no_position_comes_is_not_moved(
    robot: Robot, position: float | None
) -> None:
    """Joint states may have its name alone."""
    del robot.positions[REQUEST.joint]
    if position is not None:
        robot.positions[REQUEST.joint] = position
    robot.prepare()
    robot.look(4.0)
    assert 'does not arrive on joint_states' in robot.shown[-1]
    assert robot.targets == []


def test_a_button_of_another_page_moves_nothing_until_it_is_let_go(robot: Robot) -> None:
    """It was held when this page prepared its motion."""
    robot.prepare()
    robot.hold(0.5)
    moved = len(robot.targets)
    assert moved > 5
    robot.motion.prepare(REQUEST)
    robot.hold(0.2)
    robot.motion.forget()
    robot.motion.prepare(REQUEST)
    for _ in range(3):
        robot.hold(0.1)
    assert len(robot.targets) == moved, 'asked anew'


def test_stop_ends_a_motion_and_keeps_what_was_measured(robot: Robot) -> None:
    """Before the end it has to be prepared anew; after it a person may still conclude."""
    robot.prepare()
    robot.hold(0.5)
    robot.motion.stop()
    assert robot.shown[-1] == 'ended by a stop; prepare it anew'
    count = len(robot.targets)
    robot.hold(0.5)
    assert len(robot.targets) == count
    robot.positions[REQUEST.joint] = 0.2
    robot.prepare()
    robot.hold(2.3)
    robot.look(SETTLE_TIME + 2 * PERIOD)
    assert robot.shown[-1].startswith('the drive reports that it is there')
    robot.motion.stop()
    robot.motion.conclude(Saw.LIKE_PICTURE, REQUEST.distance)
    assert robot.shown[-1] == 'direction and distance are right'


@pytest.mark.parametrize(
    ('answer', 'words'),
    [
        ({'success': True}, 'the drive is disabled'),
        ({'success': False, 'message': 'lost'}, 'use the emergency stop (lost)'),
        (None, 'use the emergency stop (no answer within 5 s)'),
    ],
)
def test_that_a_drive_is_disabled_is_said_when_it_is(
    robot: Robot, answer: dict[str, Any] | None, words: str
) -> None:
    """A joint that goes the other way; nothing hides what becomes of it."""
    robot.prepare()
    robot.hold(5.0, factor=-1.0)
    assert robot.calls[-1][0].endswith('/shutdown')
    assert 'is being disabled' in robot.shown[-1]
    assert not robot.preparable
    robot.motion.forget()
    robot.motion.prepare(REQUEST)
    robot.motion.stop()
    assert 'is being disabled' in robot.shown[-1]
    if answer is None:
        robot.look(DISABLE_TIMEOUT + 2 * PERIOD)
    else:
        robot.answer('shutdown', **answer)
    assert robot.shown[-1].endswith(words)
    assert robot.preparable


@pytest.mark.parametrize(
    ('answer', 'words'),
    [
        ({'success': True}, 'the drive is disabled, it answered late'),
        ({'success': False, 'message': 'lost'}, 'use the emergency stop (lost)'),
    ],
)
def test_a_late_answer_corrects_what_is_shown(
    robot: Robot, answer: dict[str, Any], words: str
) -> None:
    """Where nothing else has come in its place on the page."""
    robot.prepare()
    robot.hold(5.0, factor=-1.0)
    robot.look(DISABLE_TIMEOUT + 2 * PERIOD)
    assert robot.shown[-1].endswith('(no answer within 5 s)')
    robot.answer('shutdown', **answer)
    assert robot.shown[-1].endswith(words)


def test_a_late_answer_hides_nothing_newer(robot: Robot) -> None:
    """A motion that is prepared anew stays as it is."""
    robot.prepare()
    robot.hold(5.0, factor=-1.0)
    robot.look(DISABLE_TIMEOUT + 2 * PERIOD)
    late = robot.calls[-1][1]
    robot.prepare()
    shown = list(robot.shown)
    late.answer()
    assert robot.shown == shown

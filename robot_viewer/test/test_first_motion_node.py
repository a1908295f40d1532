# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion of the page: targets by heartbeats, the drive, what was seen, the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from html import unescape
import math
import re
import sys
from types import SimpleNamespace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import pytest
from std_msgs.msg import Float64
from std_srvs.srv import Trigger
from urdf_reader import read_urdf
from urdf_robots import ARM
import yaml

from arm_msgs.srv import ReadUnits
from first_motion import (
    AxisScales,
    DriveFacts,
    JointKind,
    judge,
    MotionPlan,
    Outcome,
    Sample,
    Verdict,
)
from robot_viewer.nodes import first_motion
from robot_viewer.nodes.first_motion import (
    ANSWER_TIMEOUT,
    DISABLE_TIMEOUT,
    FirstMotion,
    READ_UNITS_TYPE,
    SETTLE_TIME,
)
from robot_viewer.page.first_motion import (
    Axis,
    correction_lines,
    corrections,
    GuardedTargets,
    LEAD_TIME,
    MAX_STEP_TIME,
    motion_plan,
    MotionRequest,
    problem_of,
    RELEASED_AFTER,
    Saw,
)
from robot_viewer.page.live import HEARTBEAT, Live
from robot_viewer.robot_state import Status

PLAN = MotionPlan(start=0.5, distance=0.1, speed=0.05, increment=1e-4)
SCALES = AxisScales(False, 1000.0, 0.001, 1000.0, 0.001, 1.0, 1.0, 0.0)
AXIS = Axis(
    JointKind.TURNS,
    AxisScales(False, 1e4, 1e-4, 1e4, 1e-4, 1.0, 1.0, 0.0),
    DriveFacts(1e4),
    'bus.yml, shoulder',
)


@given(beats=st.lists(st.booleans(), min_size=1, max_size=300), sign=st.sampled_from((1, -1)))
def test_a_target_for_a_heartbeat_and_none_without(beats: list[bool], *, sign: int) -> None:
    """Whatever the button does: slow steps in one direction, and never beyond the target."""
    plan = MotionPlan(0.5, sign * 0.1, 0.05, 1e-4)
    motion, now, position = let_go(plan), 10.0, 0.5
    for beats_now in beats:
        now += HEARTBEAT
        if beats_now:
            motion.beat(now)
        target = motion.step(now, Sample(position))
        if target is None:
            continue
        assert beats_now
        assert 0.0 <= (target - position) * sign <= plan.speed * MAX_STEP_TIME + 1e-9
        assert (target - plan.start) / plan.distance <= 1.0 + 1e-9
        position = target


def let_go(plan: MotionPlan) -> GuardedTargets:
    """Prepare a motion, and look while nobody holds the button; ends at 10.0."""
    motion = GuardedTargets(plan, 9.0)
    for number in range(1, 11):
        assert motion.step(9.0 + 0.1 * number, Sample(plan.start)) is None
    return motion


@given(delays=st.lists(st.floats(0.0, RELEASED_AFTER - 0.01), min_size=1, max_size=99))
def test_a_button_that_was_held_before_moves_nothing(delays: list[float]) -> None:
    """It was pressed for another motion, perhaps on another page; let go it counts."""
    motion, now = GuardedTargets(PLAN, 10.0), 10.0
    for delay in delays:
        now += delay
        motion.beat(now)
        assert motion.step(now, Sample(0.5)) is None
        assert not motion.guard.moving
        assert motion.press_anew or now == 10.0
    now += RELEASED_AFTER
    assert motion.step(now, Sample(0.5)) is None
    motion.beat(now + 0.01)
    assert motion.step(now + 0.02, Sample(0.5)) is None
    assert motion.guard.moving
    assert not motion.press_anew


def test_a_touch_moves_nothing_and_a_late_heartbeat_no_farther() -> None:
    """And whoever lets go, or whose heartbeats stay away, commands nothing any more."""
    motion = let_go(PLAN)
    motion.beat(10.02)
    assert motion.step(10.03, Sample(0.5)) is None
    motion.beat(10.06)
    first = motion.step(10.07, Sample(0.5))
    assert first == pytest.approx(0.5 + 0.05 * 0.04)
    assert motion.step(10.1, Sample(0.5)) is None
    motion.beat(10.19)
    assert motion.step(10.2, Sample(0.5)) == pytest.approx(0.5 + 0.05 * (0.04 + MAX_STEP_TIME))
    assert motion.commanded == pytest.approx(0.05 * (0.04 + MAX_STEP_TIME))
    motion.release()
    assert motion.step(10.23, Sample(0.505)) is None
    assert not motion.guard.moving
    motion.beat(10.24)
    assert motion.step(10.25 + RELEASED_AFTER, Sample(0.505)) is None
    assert motion.guard.outcome is Outcome.RUNNING


@pytest.mark.parametrize('sign', [1, -1])
def test_the_target_of_a_stuck_joint_stays_near_it(sign: int) -> None:
    """It would jump when it comes free; that it is stuck is a result, and no error."""
    request = MotionRequest('shoulder', sign * 0.02, 0.05)
    plan = motion_plan(request, AXIS, 0.5, {'elbow': 1.0, 'lost': math.nan})
    assert plan.others == {'elbow': 1.0}
    motion, now, farthest = let_go(plan), 10.0, 0.5
    while motion.guard.outcome is Outcome.RUNNING:
        now += HEARTBEAT
        motion.beat(now)
        target = motion.step(now, Sample(0.5))
        farthest = farthest if target is None else target
        assert abs(farthest - 0.5) <= 0.05 * LEAD_TIME + plan.noise + 1e-9
    assert motion.guard.outcome is Outcome.STALLED
    assert (farthest - 0.5) * sign > 0.9 * 0.05 * LEAD_TIME


def test_a_joint_that_leaves_its_targets_ends_the_motion() -> None:
    """Before it is a quarter beyond the distance."""
    plan = motion_plan(MotionRequest('shoulder', 0.2, 0.05), AXIS, 0.5, {})
    motion, now, position = let_go(plan), 10.0, 0.5
    while motion.guard.outcome is Outcome.RUNNING:
        now += HEARTBEAT
        motion.beat(now)
        motion.step(now, Sample(position))
        position += 0.14 * HEARTBEAT  # below three times the speed
    assert motion.guard.outcome is Outcome.FOLLOWING_ERROR
    assert position < plan.target


@pytest.mark.parametrize('start', [math.nan, math.inf])
def test_a_start_that_is_no_number_is_refused(start: float) -> None:
    """No position would be too far from it."""
    with pytest.raises(ValueError, match='no motion can be guarded'):
        motion_plan(MotionRequest('shoulder', 0.2, 0.05), AXIS, start, {})


@pytest.mark.parametrize(
    ('saw', 'reported', 'verdict'),
    [
        (Saw.LIKE_PICTURE, 0.1, Verdict.RIGHT),
        (Saw.LIKE_PICTURE, -0.1, Verdict.RIGHT),
        (Saw.OTHER_WAY, -0.1, Verdict.WRONG_SIGN),
        (Saw.OTHER_WAY, 0.1, Verdict.WRONG_SIGN),
        (Saw.NOTHING, 0.1, Verdict.ENCODER_ONLY),
        (Saw.OTHER_JOINT, 0.1, Verdict.OTHER_JOINT),
        (Saw.LIKE_PICTURE, 0.0, Verdict.NOT_REPORTED),
    ],
)
def test_what_was_seen_is_compared_with_the_picture(
    saw: Saw, reported: float, verdict: Verdict
) -> None:
    """Which shows what the drive reports."""
    commanded = math.copysign(0.1, reported)
    seen = saw.seen(reported, abs(reported) or 0.1)
    facts = DriveFacts(1000.0)
    assert judge(JointKind.TURNS, commanded, reported, seen, facts).verdict is verdict


def test_each_likely_cause_has_its_correction() -> None:
    """As lines of bus.yml, with the reason; what is right needs none."""
    says = DriveFacts(1000.0, gear=50.0)
    axis = Axis(JointKind.TURNS, SCALES, says, 'bus.yml, shoulder')
    judgement = judge(JointKind.TURNS, 0.1, 0.1, Saw.OTHER_WAY.seen(0.1, 0.002), says)
    first, second = corrections(axis, judgement)  # a gear of 50, or degrees
    lines = correction_lines(axis.where, first)
    assert yaml.safe_load(lines) == first.values != second.values
    assert lines.startswith('# bus.yml, shoulder\n')
    assert 'the gear of 50 (0x6091) is missing' in lines
    assert 'per degree' in correction_lines(axis.where, second)
    odd = judge(JointKind.TURNS, 0.1, 0.1, Saw.OTHER_WAY.seen(0.1, 1.3), says)
    assert [each.reason.count('by eye') for each in corrections(axis, odd)] == [1]
    right = judge(JointKind.TURNS, 0.1, 0.1, Saw.LIKE_PICTURE.seen(0.1, 0.1), says)
    assert not list(corrections(axis, right))


@pytest.mark.parametrize(
    ('state', 'mode', 'age', 'words'),
    [
        ('Operation enabled', 'Cyclic position', 0.1, ''),
        ('Operation enabled', 'Cyclic position', 0.6, 'joint_states'),
        ('Switched on', 'Cyclic position', 0.1, 'not enabled'),
        ('Operation enabled', 'Interpolated position', 0.1, ''),
        ('Operation enabled', 'Profile position', 0.1, 'goes on when the page is lost: choose'),
        ('Operation enabled', 'Profile position', 0.1, 'a small ~/target at a low 0x6081'),
        ('Operation enabled', 'Cyclic velocity', 0.1, 'position mode below Drives'),
        ('Operation enabled', '', 0.1, 'no mode'),
        ('', '', 0.1, 'no diagnostics'),
    ],
)
def test_why_a_drive_is_not_moved(state: str, mode: str, age: float, words: str) -> None:
    """With what to do."""
    problem = problem_of({'state': state, 'mode': mode}, age)
    assert words in problem
    assert bool(problem) is bool(words)


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


class Widget:
    """A part of the page; what it says is kept."""

    def __init__(self, shown: list[str], value: object = None) -> None:
        self._shown, self.value, self.disabled = shown, value, False

    def __enter__(self) -> None:
        """Begin to fill it."""

    def __exit__(self, *_: object) -> None:
        """End that."""

    def __setattr__(self, name: str, value: Any) -> None:
        """Keep what it says, without its mark."""
        if name == 'content' and value:
            self._shown.append(unescape(re.sub('<span.*?</span> |<.*?>', '', value)))
        super().__setattr__(name, value)

    def on_click(self, _press: object) -> None:
        """Nobody presses it."""

    on_update = on_click


class Page:
    """A page without a browser."""

    before_log = 0.0

    def __init__(self, shown: list[str]) -> None:
        self._shown = shown
        self.server = SimpleNamespace(gui=self)
        self.live = Live(lambda *_: None)

    def place(self, _group: str, _panel: object) -> Widget:
        """Return the group."""
        return Widget(self._shown)

    def __getattr__(self, name: str) -> Any:
        """Return what adds a part of some kind."""
        assert name.startswith('add_')
        first = 'dropdown' in name
        return lambda _, value='', **__: Widget(self._shown, value[0] if first else value)


class Robot:
    """A node that has no DDS, and its clock."""

    def __init__(self) -> None:
        self.now = 100.0
        self.calls: list[tuple[str, Future]] = []
        self.targets: list[float] = []
        self.shown: list[str] = []
        self.positions = dict.fromkeys(JOINTS, 0.2)
        self.statuses: dict[str, Status] = {}
        self.motion = FirstMotion(
            self,  # type: ignore[arg-type]  # a node without DDS
            Page(self.shown),  # type: ignore[arg-type]
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

    @property
    def preparable(self) -> bool:
        """Whether the page lets a motion be prepared."""
        return not self.motion._prepare.disabled

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
        units: dict[str, Any] = asdict(AXIS.scales) | {'gear': 0.0, 'factor_scale': 0.0}
        units |= {'bus_config': '/none/bus.yml', 'device': REQUEST.joint, 'channel': -1}
        self.calls[-1][1].answer(**units)
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
    """Make one, whose clock the test has."""
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
        ({'success': False, 'message': 'lost'}, 'use the emergency stop (shutdown: lost)'),
        (None, 'use the emergency stop (shutdown: no answer within 5 s; does its master run?)'),
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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands that break off in motion: the robot comes down, or says why it may not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import itertools
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_description import (
    movable_joints,
    Pose,
    pose_positions,
    quadruped,
    raised_feet,
    robot_urdf,
)
from quad_hardware.commander import JointCommander, REPORT_TIMEOUT, SPEED
from quad_hardware.joints import JointMap, LimiterSettings, LossReaction, MAX_PERIOD, servo_of

JOINTS = JointMap(servo_of(joint) for joint in movable_joints(robot_urdf('lite')))
NAMES = JOINTS.names
ROBOT = quadruped(robot_urdf('lite'))
PERIOD = 0.02  # [s]
STAND = pose_positions(Pose.STAND)
STANDING = [STAND[name] for name in NAMES]
LYING = [pose_positions(Pose.LIE)[name] for name in NAMES]


def trot(tick: int, lift: float) -> list[float]:
    """Targets of a robot of which a diagonal pair of legs is lifted by an angle [rad]."""
    pair = ('fl', 'br') if tick // 7 % 2 else ('fr', 'bl')
    return [
        STAND[name] + lift * (name.split('_')[0] in pair and 'thigh' in name) for name in NAMES
    ]


class Line:
    """What a commander sends its angles to; it may be cut."""

    def __init__(
        self, reaction: LossReaction = LossReaction.LIE, joints: JointMap = JOINTS
    ) -> None:
        self.sent: list[Mapping[int, float]] = []
        self.warned: list[str] = []
        self.obstacle = ''
        self.place: dict[str, float] = dict(STAND)  # where the legs are seen
        self.commander = JointCommander(
            joints, LimiterSettings(command_loss=reaction),
            raised=lambda targets: raised_feet(ROBOT.feet(targets)),
            send=self._send, waits=lambda: False,
            obstacle=lambda: self.obstacle, warn=self.warned.append,
        )  # fmt: skip

    def _send(self, angles: Mapping[int, float]) -> bool:
        if not self.obstacle:
            self.sent.append(angles)
        return not self.obstacle

    def walk(self, duration: float, lift: float = 0.3, start: float = 0.0) -> float:
        """Command a trot on the spot for a time; return its end [s]."""
        for tick in range(round(duration / PERIOD)):
            self.stand(trot(tick, lift), start + tick * PERIOD)
        return start + duration

    def stand(self, targets: Sequence[float], now: float) -> None:
        """Command targets."""
        assert self.commander.take(targets, self.place, now) is not None

    def miss(self, tilt: float | None, now: float) -> str:
        """Return what the robot does as no command has come, a report or none."""
        commander, place = self.commander, self.place
        loss = commander.miss(place, tilt, now)
        if loss is None:
            loss = commander.miss(place, tilt, now + REPORT_TIMEOUT)
        assert loss is not None
        return loss

    def descend(self, now: float) -> list[Sequence[float]]:
        """Step until the robot is down, ten seconds at most; return its targets [rad]."""
        way: list[Sequence[float]] = []
        while self.commander.goes_down and len(way) < 500:
            now += PERIOD
            if command := self.commander.go_down(self.place, now):
                way.append(command.targets)
        assert not self.commander.goes_down
        return way


@pytest.mark.parametrize('tilt', [0.1, None], ids=['tilted', 'dead IMU'])
@pytest.mark.parametrize('lift', [0.15, 0.3])
def test_a_stream_that_breaks_off_in_a_trot_brings_the_robot_down(
    lift: float, tilt: float | None
) -> None:
    """From where the joints are, softly, to the lying pose, and then nothing is sent."""
    line = Line()
    now = line.walk(2.0, lift)
    loss = line.miss(tilt, now)
    assert 'in the air' in loss
    assert 'lies down' in loss
    way = line.descend(now)
    assert way[0] == pytest.approx(STANDING, abs=SPEED * PERIOD)
    assert way[-1] == pytest.approx(LYING)
    steps = [abs(b - a) for one, two in itertools.pairwise(way)
             for a, b in zip(one, two, strict=True)]  # fmt: skip
    assert max(steps) <= SPEED * PERIOD * 1.01
    assert line.miss(tilt, now + 20.0) == ''


@pytest.mark.parametrize(('duration', 'lift'), [(2.0, 0.0), (2.0, 0.02), (0.3, 0.3)])
def test_commands_that_end_on_all_feet_leave_a_posture(duration: float, lift: float) -> None:
    """Standing, levelling, a person who tries a servo for a moment: nothing moves by itself.

    Nor does a robot that walked, and had put down its feet when its commands ended.
    """
    line = Line()
    assert line.miss(0.0, line.walk(duration, lift) + 1.0) == ''
    walked = line.walk(2.0, start=10.0)
    assert line.miss(0.0, line.walk(0.2, 0.0, start=walked) + 1.0) == ''


def test_a_robot_that_was_just_laid_down_lies() -> None:
    """The demo and Ctrl-C end the controller as soon as it says so: nothing has broken off."""
    line = Line()
    for tick in range(50):
        share = 0.5 * (1.0 - math.cos(math.pi * tick / 49))
        line.stand(
            [stand + share * (lie - stand) for stand, lie in zip(STANDING, LYING, strict=True)],
            tick * PERIOD,
        )
    assert line.miss(0.0, 2.0) == ''


@pytest.mark.parametrize('legs', [('fl',), ('br',), ('fr', 'bl')])
def test_a_leg_that_is_held_in_the_air_is_no_rest(legs: tuple[str, ...]) -> None:
    """A controller that holds in the middle of a trot, for a fault, and then ends."""
    line = Line()
    line.place.update({f'{leg}_thigh_joint': STAND[f'{leg}_thigh_joint'] + 0.3 for leg in legs})
    for tick in range(50):
        line.stand([line.place[name] for name in NAMES], tick * PERIOD)
    loss = line.miss(0.1, 2.5)
    assert all(f'{leg}_foot' in loss for leg in legs)
    assert line.descend(2.5)[-1] == pytest.approx(LYING)


@given(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_a_body_that_leans_or_sways_stands(roll: float, height: float, pitch: float) -> None:
    """On a slope, or swaying over its feet until the end: all of them stand in a plane."""
    line = Line()
    for tick in range(50):
        place, share = dict(STAND), tick / 49
        for leg in ('fl', 'fr', 'bl', 'br'):
            way = share * (height + (pitch if leg[0] == 'f' else -pitch))
            place[f'{leg}_hip_joint'] += share * roll
            place[f'{leg}_thigh_joint'] += way
            place[f'{leg}_calf_joint'] -= 2.0 * way
        line.stand([place[name] for name in NAMES], tick * PERIOD)
    assert line.miss(0.0, 2.0) == ''


@pytest.mark.parametrize(
    ('place', 'tilt', 'reaction', 'hip', 'named'),
    [
        ({}, 0.0, LossReaction.LIE, 'fl_hip_joint', NAMES[0]),
        (STAND, 1.2, LossReaction.LIE, 'fl_hip_joint', '69 degrees'),
        (STAND, 0.0, LossReaction.HOLD, 'fl_hip_joint', 'command_loss'),
        (STAND, None, LossReaction.LIE, 'left_front_hip', 'no lying pose is known of left_fr'),
    ],
)
def test_it_says_why_it_may_not(
    place: dict[str, float], tilt: float | None, reaction: LossReaction, hip: str, named: str
) -> None:
    """No report has the legs, it lies on its side, it is not wanted, or joints are of others."""
    first, *rest = JOINTS.servos
    line = Line(reaction, JointMap([replace(first, joint=hip), *rest]))
    line.place[hip] = 0.0
    now = line.walk(2.0)
    line.place = place
    assert named in line.miss(tilt, now)
    assert not line.commander.goes_down


def test_what_breaks_off_is_sent_down_through_the_same_limits() -> None:
    """The way down is counted and limited as commands are; at its end nothing is sent."""
    line = Line()
    now = line.walk(2.0) + line.commander.timeout
    assert line.commander.miss({}, None, now) is None  # a stall holds up reports, too
    now += 0.9 * REPORT_TIMEOUT
    assert 'lies down' in (line.commander.miss(STAND, 0.0, now) or '')
    before, begun = len(line.sent), now
    while line.commander.goes_down:
        now += PERIOD
        line.commander.go_down({} if 0.3 < now - begun < 0.6 else STAND, now)
    assert line.sent[-1] == pytest.approx(JOINTS.angles(LYING))
    assert len(line.sent) > before + 40
    assert line.commander.go_down(STAND, now + PERIOD) is None
    assert line.commander.counters.loss
    assert line.commander.take(STANDING, STAND, now + 1.0) is not None
    assert not line.commander.counters.loss


def test_timers_that_are_late_behind_a_command_change_nothing() -> None:
    """An executor may call them for an expiry of before: the stream goes on, and may break off."""
    line = Line()
    now = line.walk(2.0)
    last = now - PERIOD
    assert line.commander.is_commanded(last + 0.9 * line.commander.timeout)
    assert line.commander.go_down(STAND, now) is None
    now = last + line.commander.timeout
    assert not line.commander.is_commanded(now)
    assert 'lies down' in (line.commander.miss(STAND, 0.0, now) or '')


@given(
    st.lists(st.sampled_from(['same', 'away', 'near', 'stall', 'short']), min_size=1, max_size=30)
)
def test_a_stream_of_before_does_not_raise_a_robot_that_was_let_go(steps: list[str]) -> None:
    """Whatever its targets do, nothing is sent before they were near the legs once.

    A stall is a pause that a stopped process or a busy machine makes: it is no new request.
    """
    line = Line()
    now = line.walk(0.5)
    line.commander.let_go()
    sunk = dict(zip(NAMES, LYING, strict=True))
    before, offset, is_back = len(line.sent), 0.4, False
    for step in steps:
        now += 3.0 if step == 'stall' else PERIOD
        if step == 'short':  # near the legs, but no command
            assert line.commander.take([LYING[0]], sunk, now) is None
            continue
        offset = {'away': offset + 0.4, 'near': 0.2}.get(step, offset)
        is_back = is_back or offset < 0.3
        targets = [LYING[0] + offset, *LYING[1:]]
        assert (line.commander.take(targets, sunk, now) is not None) is is_back
    assert (len(line.sent) > before) is is_back
    if not is_back and 'short' not in steps:
        assert f'{NAMES[0]} is {offset:.2f} rad from its target' in line.warned[-1]


@pytest.mark.parametrize('share', [0.1, 0.5, 0.9, 0.99])
def test_a_pause_on_the_way_down_makes_it_later_and_not_quicker(share: float) -> None:
    """A busy machine: all of the way is sent, and no step is larger for it."""
    line = Line()
    now = line.walk(2.0) + line.commander.timeout
    line.commander.miss(STAND, 0.0, now)
    place, end, pause = STAND, now + share, 0.45
    while line.commander.goes_down:
        now += PERIOD
        if now > end:
            now, pause = now + pause, 0.0
        before = place
        if command := line.commander.go_down(place, now):
            place = dict(zip(NAMES, command.targets, strict=True))
            assert not command.slowed
        assert max(abs(place[n] - before[n]) for n in NAMES) <= SPEED * MAX_PERIOD * 1.01
    assert line.sent[-1] == pytest.approx(JOINTS.angles(LYING))


@pytest.mark.parametrize('noticed', [False, True])
def test_a_pause_with_a_foot_in_the_air_does_not_begin_a_new_stream(*, noticed: bool) -> None:
    """A controller stutters, goes on for a moment and is gone: the robot comes down."""
    line = Line()
    now = line.walk(2.0) + 0.5
    if noticed:
        assert 'lies down' in line.miss(0.0, now)
        assert line.commander.go_down(STAND, now + PERIOD) is not None
    now = line.walk(0.2, 0.25, start=now + 2 * PERIOD)
    assert 'in the air' in line.miss(0.0, now + 0.5)


@pytest.mark.parametrize('cut', ['before', 'on the way', 'for long'])
def test_a_robot_that_is_lost_is_not_brought_down_later(cut: str) -> None:
    """The link fails: the way down ends, and a robot that comes back is not moved unasked."""
    line = Line()
    now = line.walk(2.0) + line.commander.timeout
    if cut == 'before':
        assert line.commander.miss({}, None, now) is None
        held = line.commander.miss({}, None, now + REPORT_TIMEOUT)
        assert 'holds as it is' in (held or '')
    else:
        line.commander.miss(STAND, 0.0, now)
        assert line.commander.go_down(STAND, now + PERIOD) is not None
        line.obstacle = 'no report'
        for _ in range(2 if cut == 'for long' else 1):
            now += REPORT_TIMEOUT
            assert line.commander.go_down({} if cut == 'for long' else STAND, now) is None
        assert 'no report' in line.warned[-1]
        line.obstacle = ''
    assert not line.commander.goes_down
    assert line.commander.go_down(STAND, now + 1.0) is None
    assert line.commander.miss(STAND, 0.0, now + 2.0) == ''


def laid_down(line: Line, now: float, descended: float) -> tuple[Mapping[str, float], float]:
    """Break commands off in a trot; return the legs [rad] after a time [s], and when it is."""
    line.commander.miss(STAND, 0.0, now)
    place, end = STAND, now + descended
    while now < end and line.commander.goes_down:
        now += PERIOD
        if command := line.commander.go_down(place, now):
            place = dict(zip(NAMES, command.targets, strict=True))
    return place, now


@pytest.mark.parametrize('descended', [0.1, 0.8, 10.0])
def test_a_controller_that_wakes_begins_softly_where_the_legs_are(descended: float) -> None:
    """It was frozen, and looks where the legs are while the robot goes down, or lies."""
    line = Line()
    place, now = laid_down(line, line.walk(2.0) + line.commander.timeout, descended)
    assert line.commander.take([place[name] for name in NAMES], place, now) is not None
    assert not line.commander.goes_down
    assert line.commander.go_down(place, now) is None
    for tick in range(1, 10):
        before = place
        command = line.commander.take([0.5, 0.2, 0.9] * 4, before, now + tick * PERIOD)
        assert command is not None
        place = dict(zip(NAMES, command.targets, strict=True))
        speed = max(abs(place[name] - before[name]) for name in NAMES) / PERIOD
        assert speed <= 2.0 + 20.0 * tick * PERIOD + 1e-9


@given(st.floats(1.0, 3.0), st.lists(st.sampled_from([PERIOD, 0.7, 3.0]), min_size=1, max_size=60))
def test_commands_that_only_did_not_arrive_raise_no_robot_that_was_laid_down(
    descended: float, gaps: list[float]
) -> None:
    """The network stalls, the controller knows nothing of it: the robot goes on down, and lies."""
    line = Line()
    place, now = laid_down(line, line.walk(2.0) + line.commander.timeout, descended)
    for tick, gap in enumerate(gaps):
        now += gap
        assert line.commander.take(trot(tick, 0.3), place, now) is None
        if command := line.commander.go_down(place, now):
            place = dict(zip(NAMES, command.targets, strict=True))
    assert 'the robot was laid down, and ' in line.warned[-1]
    while line.commander.goes_down:
        now += PERIOD
        line.commander.go_down(place, now)
    assert line.sent[-1] == pytest.approx(JOINTS.angles(LYING))
    assert line.commander.take(LYING, dict(zip(NAMES, LYING, strict=True)), now) is not None

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging: honest speed, held axes, limits that are kept, never a trap; back from a fold."""

from __future__ import annotations

import math

import core_commands
from core_commands import core_of, kept, PERIOD, Run, run
from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain, ready, robot, ROBOTS, STRAIGHT
import numpy as np
import pytest
from servo_commands import Drives, twist

from arm_model import Array, RobotModel, RobotState
from arm_servo import Cause, JointCommand, Limiter, MotionReport, PoseCommand, TwistCommand

pytestmark = pytest.mark.slow

IN_PLANE = {
    'x': [0.12, 0.0, 0.0, 0.0, 0.0, 0.0],
    'z': [0.0, 0.0, 0.12, 0.0, 0.0, 0.0],
    'about y': [0.0, 0.0, 0.0, 0.0, 0.3, 0.0],
}
"""Twists for which the Panda's arm stays in the plane that it is in when it is ready."""
SIDEWAYS = [0, 2, 4, 6]  # joints that lead out of that plane


@pytest.mark.parametrize('pause', [0, 10, 13, 20], ids='pauses of {} cycles'.format)
@pytest.mark.parametrize('axis', IN_PLANE)
def test_a_jog_in_the_plane_of_the_arm_stays_in_it(axis: str, pause: int) -> None:
    """Steady or interrupted: where the acceleration of one joint is at its limit, all are slower.

    A swing would win back the last of the asked speed, and grow from rounding errors.
    """
    arm = Drives().following(3)
    begin = arm.path[-1]
    for cycle in range(300):
        if not pause or (cycle // pause) % 2 == 0:
            twist(arm.gateway, IN_PLANE[axis], arm.now)
        arm.run()
    path = np.array(arm.path)
    assert np.abs(path[-1] - begin).max() > 0.1
    assert np.abs(path[:, SIDEWAYS] - begin[SIDEWAYS]).max() < 1e-3


# place of the elbow, and the angle at which the arm is straight
ELBOW = {
    'panda': (3, -2.0 * math.atan2(0.0825, 0.35)),
    'prbt': (2, 0.0),
    'gp110': (2, math.pi / 2 - math.atan2(0.235, 1.02)),
}

STUCK = 0.05  # share of the asked speed below which the tool has come to its end


class Jogger:
    """Jogs the tool of an arm along a line."""

    def __init__(self, name: str, period: float, down: float) -> None:
        self.model, self.period, self.now = robot(name), period, 0.0
        self.core = core_of(name)
        self.report = MotionReport()
        self.begin = self.model.pose(ready(name)).position
        ahead = np.array([*self.begin[:2], 0.0]) / np.linalg.norm(self.begin[:2])
        self.line = math.cos(down) * ahead - np.array([0.0, 0.0, math.sin(down)])

    @property
    def way(self) -> float:
        """How far the tool is along the line in [m]."""
        place = self.model.pose(self.core.state.position).position
        return float((place - self.begin) @ self.line)

    def jog(self, speed: float) -> float:
        """Jog for a cycle; return the speed along the line in [m/s]."""
        core_commands.twist(self.core, [*(speed * self.line), 0.0, 0.0, 0.0], self.now)
        self.report = self.core.step(self.now, self.period).report
        self.now += self.period
        state = self.core.state
        return float((self.model.jacobian(state.position) @ state.velocity)[:3] @ self.line)

    def rest(self) -> None:
        """Release the keys until the arm rests."""
        for _ in range(round(1.0 / self.period)):
            self.core.step(self.now, self.period)
            self.now += self.period


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize(('down', 'speed'), [(0.0, 0.1), (0.3, 0.3)])
def test_an_arm_comes_back_from_the_border_on_the_same_side(
    name: str, down: float, speed: float
) -> None:
    """Out to the border, pushing on, a rest, and all of the way back.

    While it is pushed on the tool stands still, and the report says that its speed is lost.
    """
    jogger = Jogger(name, 0.01, down)
    place, straight = ELBOW[name]
    side = np.sign(ready(name)[place] - straight)
    while jogger.jog(speed) > STUCK * speed or jogger.now < 0.5:
        if jogger.now > 12.0 and down:
            break  # it slides along the border
        assert jogger.now < 30.0
    for _ in range(round(1.5 / jogger.period)):
        pushed = jogger.jog(speed)
    if not down:
        assert abs(pushed) < 0.01
        lost = [each for each in jogger.report.limiters if each.cause is Cause.SINGULARITY]
        assert 0.0 <= max(each.factor for each in lost) < 0.15
        assert jogger.report.factor < 0.15
    jogger.rest()
    out, deadline = jogger.way, jogger.now + 3.0 * jogger.way / speed + 5.0
    while jogger.way > 0.01 and jogger.now < deadline:
        jogger.jog(-speed)
    assert jogger.way <= 0.01, f'{out - jogger.way:.3f} of {out:.3f} m'
    assert side * (jogger.core.state.position[place] - straight) > 0.1


@pytest.mark.parametrize('elbow', [1.30, 1.37, 1.42])
@pytest.mark.parametrize(
    'twist',
    [[0.04, 0, 0, 0, 0, 0], [0.16, 0, 0, 0, 0, 0], [0.4, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0.3, 0]],
)
def test_pushing_on_at_the_border_the_arm_rests(elbow: float, twist: list[float]) -> None:
    """Beside the straight pose and beyond it: it goes there, and does not hunt about it."""
    core = core_of('gp110', at=[0.0, 1.2, elbow, 0.0, -0.3, 0.0])
    places = []
    for cycle in range(round(5.0 / PERIOD)):
        core_commands.twist(core, twist, cycle * PERIOD)
        places.append(core.step(cycle * PERIOD, PERIOD).state.position)
    assert np.ptp(np.array(places[350:]), axis=0).max() < 2e-3


SPEED = np.array([0.1] * 3 + [0.3] * 3)  # [m/s], [rad/s]

TWISTS = [sign * SPEED * axis for axis in np.eye(6) for sign in (1.0, -1.0)]


AT_BOUND = 0.02
"""How near a joint is to its limit in [rad], or links in [m], when they hold a motion up."""

LOST = 0.12  # scaled singular value below which a direction is as good as lost


def holds_up(model: RobotModel, state: RobotState, limiter: Limiter) -> bool:
    """Whether what a report names is so: measured on the arm, not read from the report."""
    limits = model.limits
    if limiter.cause is Cause.COLLISION:
        pairs = model.nearest(state.position, 1.0, 100)
        distances = [each.distance for each in pairs if ' - '.join(each.links) == limiter.name]
        return min(distances) < AT_BOUND
    if limiter.cause is Cause.SINGULARITY:
        scaled = model.jacobian(state.position)
        scaled[:3] *= 3.0 / model.reach
        return float(np.linalg.svd(scaled, compute_uv=False)[-1]) < LOST
    if limiter.name not in limits.names:
        return False
    joint = limits.names.index(limiter.name)
    if limiter.cause is Cause.JOINT_VELOCITY:
        return bool(abs(state.velocity[joint]) > 0.95 * limits.velocity[joint])
    ways = np.abs(state.position[joint] - np.array((limits.lower[joint], limits.upper[joint])))
    return limiter.cause is Cause.JOINT_POSITION and bool(ways.min() < AT_BOUND)


def moves_or_reports(model: RobotModel, result: Run, twist: Array) -> bool:
    """Whether the tool moved as asked by a twentieth, or the cause that is named is so."""
    axis = int(np.argmax(np.abs(twist)))
    asked = twist[axis] * PERIOD * (len(result.states) - 1)
    return bool(
        result.moved[axis] / asked > 0.05
        or any(holds_up(model, result.states[-1], each) for each in result.limiters)
    )


@pytest.mark.parametrize('name', ROBOTS)
def test_the_asked_speed_is_the_speed(name: str) -> None:
    """Where nothing limits, the tool's speed is within one percent of what was asked."""
    model = robot(name)
    for asked in TWISTS:
        slow = asked * 0.3
        result = run(core_of(name), TwistCommand(slow), 0.6)
        state = result.states[-1]
        achieved = model.jacobian(state.position) @ state.velocity
        if result.report.factor > 0.999:
            assert achieved == pytest.approx(slow, abs=0.01 * float(np.abs(slow).max()))
        else:
            assert any(holds_up(model, state, each) for each in result.report.limiters), asked


@pytest.mark.parametrize('name', ROBOTS)
def test_a_minute_of_rotation_leaves_the_tool_in_place(name: str) -> None:
    """In 60 s of turning to and fro about each axis the tool centre stays within 1 mm."""
    model = robot(name)

    def turning(time: float) -> TwistCommand:
        twist = np.zeros(6)
        twist[3 + int(time / 20)] = 0.2 if time % 6 < 3 else -0.2
        return TwistCommand(twist)

    result = run(core_of(name), turning, 59.9, period=0.025)
    home = model.pose(ready(name)).position
    away = [
        np.linalg.norm(model.pose(state.position).position - home) for state in result.states[::20]
    ]
    assert max(away) < 1e-3


def jog_joint(name: str, start: Array, joint: int, speed: float, duration: float) -> Run:
    """Jog one joint of an arm."""
    velocity, commanded = np.zeros(len(start)), np.zeros(len(start), dtype=np.bool_)
    velocity[joint], commanded[joint] = speed, True
    return run(core_of(name, at=start), JointCommand(velocity, commanded), duration)


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('sense', [1.0, -1.0])
def test_beyond_a_limit_the_way_leads_back_only(name: str, sense: float) -> None:
    """A joint that starts beyond its limit can be jogged back, and not further out."""
    limits, start = robot(name).limits, np.array(ready(name))
    start[4] = limits.upper[4] + 0.05
    result = jog_joint(name, start, 4, 0.5 * sense, 1.0)
    end = result.states[-1].position[4]
    if sense > 0:
        assert end == pytest.approx(start[4], abs=1e-6)
        assert any(each.cause is Cause.JOINT_POSITION for each in result.report.limiters)
    else:
        assert end < limits.upper[4] - 0.2
    kept(limits, result.states, PERIOD)


CONTACTS = {
    'panda': [-1.49, 1.32, 0.5, -2.3, -0.74, 1.21, 1.08],
    'prbt': [0.19, 1.58, -1.99, -1.55, -1.63, 0.08],
    'gp110': [1.62, 1.63, -1.11, -0.74, -1.63, -1.73],
}
"""Poses with links in contact."""


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('place', ['straight', 'joint limit', 'contact'])
def test_there_is_no_trap(name: str, place: str) -> None:
    """From a singular pose, a limit, contact each direction moves, or the report names the cause.

    The straight pose can be left in more than half of the directions; one parts links in contact.
    """
    model, at_limit = robot(name), np.array(ready(name))
    at_limit[4] = model.limits.upper[4]
    poses = {'straight': STRAIGHT[name], 'joint limit': at_limit, 'contact': CONTACTS[name]}
    start = np.array(poses[place])
    before, ends, gone = model.clearance(start), [], 0
    for asked in TWISTS:
        result = run(core_of(name, at=start), TwistCommand(asked), 1.0)
        assert moves_or_reports(model, result, asked), asked
        kept(model.limits, result.states, PERIOD)
        ends.append(model.clearance(result.states[-1].position))
        axis = int(np.argmax(np.abs(asked)))
        gone += int(result.moved[axis] / asked[axis] > 0.1)
    assert min(ends) > min(before, 0.004) - 1e-3
    assert place != 'straight' or gone > 6
    if place == 'contact':
        assert before < 0.005
        assert max(ends) > before + 0.01


@pytest.mark.parametrize('name', ROBOTS)
def test_the_way_back_is_open(name: str) -> None:
    """From wherever a jog has led, to a limit or a border, the opposite one leads back."""
    for asked in TWISTS:
        core = core_of(name)
        for jogged, duration in ((4.0 * asked, 2.0), (np.zeros(6), 0.6), (-asked, 1.5)):
            back = run(core, TwistCommand(jogged), duration, 0.02)
        axis = int(np.argmax(np.abs(asked)))
        share = back.moved[axis] / -asked[axis]
        assert share > 0.05, f'{asked}: {back.report}; {back.limiters}'


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_limits_hold_over_random_commands(name: str, seed: int) -> None:
    """Whatever is jogged from wherever, no limit is broken and no contact made."""
    core, model, rng = core_of(name), robot(name), np.random.default_rng(seed)
    for _ in range(5):
        asked = rng.normal(size=6) * SPEED * 3
        command = TwistCommand(asked, link=model.tip if rng.random() < 0.5 else None)
        result = run(core, command, 0.4)
        kept(model.limits, result.states, PERIOD)
        assert model.clearance(result.states[-1].position) > 0.0


@pytest.mark.parametrize('kinds', ['zyy', 'zyyz', 'zyyzy', 'cyyzyz', 'zyzyzyz', 'zyzyzyzy'])
def test_three_to_eight_joints(kinds: str) -> None:
    """Arms of 3 to 8 joints follow a twist that they can follow, without special cases."""
    model = chain(kinds)
    start = np.array([0.3, 0.2, 1.5, 0.9, 1.1, 0.8, 0.9, 0.4][: len(kinds)])
    twist = np.array([0.0, 0.0, 0.02, 0.0, 0.0, 0.0])
    result = run(core_of(model, at=start), TwistCommand(twist), 2.0)
    assert result.moved[2] == pytest.approx(0.04, rel=0.15)
    assert np.abs(result.moved[:2]).max() < 2e-3
    kept(model.limits, result.states, PERIOD)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_blocked_axis_does_not_stop_the_other(name: str) -> None:
    """Where one commanded axis is lost the other goes on: only the lost direction slows."""
    model = robot(name)
    result = run(core_of(name), TwistCommand(np.array([0.4, 0.1, 0, 0, 0, 0])), 4.0)
    end = result.states[-1]
    achieved = model.jacobian(end.position) @ end.velocity
    assert achieved[0] < 0.2  # the commanded axis that is lost
    named = any(holds_up(model, end, limiter) for limiter in result.limiters)
    assert result.moved[1] > 0.2 or named
    kept(model.limits, result.states, PERIOD)


def test_commands_in_the_tools_frame_follow_it() -> None:
    """A twist along a link's axes turns with the link."""
    model, start, speed = robot('gp110'), ready('gp110'), np.array([0.0, 0.0, 0.05])
    command = TwistCommand(np.array([*speed, 0.0, 0.0, 0.0]), link='tool0')
    moved = run(core_of('gp110'), command, 1.0).moved[:3]
    out = model.pose(start).rotation @ speed
    assert moved @ out / 0.05 == pytest.approx(0.05, rel=0.1)


def test_a_jogged_joint_moves_alone_and_brakes_in_front_of_its_limit() -> None:
    """At the asked speed, at most its own; what limits it is named."""
    start, limits = np.array(ready('panda')), robot('panda').limits
    alone = jog_joint('panda', start, 2, 0.4, 0.5)
    assert alone.states[-1].velocity == pytest.approx([0, 0, 0.4, 0, 0, 0, 0], abs=1e-5)
    start[6] -= 2.0
    fast = jog_joint('panda', start, 6, 9.0, 0.8)
    assert fast.states[-1].velocity[6] == pytest.approx(limits.velocity[6], rel=1e-3)
    named = [(each.cause, each.name) for each in fast.report.limiters]
    assert named == [(Cause.JOINT_VELOCITY, 'panda_joint7')]
    start[6] = limits.upper[6] - 0.5
    end = jog_joint('panda', start, 6, 9.0, 2.5)
    assert end.states[-1].position[6] == pytest.approx(limits.upper[6], abs=2e-3)
    assert (Cause.JOINT_POSITION, 'panda_joint7') in [
        (each.cause, each.name) for each in end.report.limiters
    ]
    for result in (alone, fast, end):
        kept(limits, result.states, PERIOD)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_twist_that_is_too_fast_keeps_its_direction(name: str) -> None:
    """Asked for more than its joints can, the tool goes as fast as it can, and straight."""
    model = robot(name)
    joint = {Cause.JOINT_VELOCITY, Cause.JOINT_ACCELERATION, Cause.JOINT_POSITION}
    for axis in range(6):
        result = run(core_of(name), TwistCommand(np.eye(6)[axis] * 20.0), 0.25)
        end = result.states[-1]
        achieved = model.jacobian(end.position) @ end.velocity
        assert achieved[axis] > 0.1
        assert np.abs(np.delete(achieved, axis)).max() < 0.1 * achieved[axis], axis
        assert any(each.cause in joint for each in result.report.limiters)
        kept(model.limits, result.states, PERIOD)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_pose_is_reached_at_rest(name: str) -> None:
    """A pose target is approached, reached within 0.1 mm, and not overrun."""
    model = robot(name)
    goal = model.pose(ready(name) + np.linspace(-0.15, 0.15, len(model)))
    result = run(core_of(name), PoseCommand(goal), 5.0)
    end = model.pose(result.states[-1].position)
    assert end.position == pytest.approx(goal.position, abs=1e-4)
    assert end.rotation == pytest.approx(goal.rotation, abs=1e-3)
    assert np.abs(result.states[-1].velocity).max() < 1e-3
    kept(model.limits, result.states, PERIOD)

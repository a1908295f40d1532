# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arms that do not go where they are sent, and hand-overs in any order: what leaves on the bus."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import replace
import math
from typing import Any

from core_commands import kept
from hypothesis import example, given, settings
from hypothesis import strategies as st
from model_robots import robot, ROBOTS
import numpy as np
import pytest
from servo_commands import (
    Drives,
    Elsewhere,
    jog,
    jog_elsewhere,
    move_by,
    no_speed_jumps,
    outcome,
    PERIOD,
    swing,
    twist,
)

from arm_model import ArmError, JointLimits
from arm_servo import JogRequest, PauseRequest, PoseCommand, SpeedRequest, StopRequest
from arm_servo.controllers.controller import MOTIONS
from arm_servo.core.requests import ImmediateRequest
from arm_servo.motion_thread import FollowingLimits, FollowingWatch
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal

NUDGES = st.lists(st.floats(-0.3, 0.3), min_size=7, max_size=7)
TWISTS = st.lists(st.floats(-0.3, 0.3), min_size=6, max_size=6)
STEPS = st.one_of(
    st.tuples(st.just('twist'), TWISTS),
    st.tuples(st.just('jog'), NUDGES),
    st.tuples(st.just('pose'), NUDGES),
    st.tuples(st.just('target'), NUDGES),
    st.tuples(st.just('trajectory'), NUDGES),
    st.tuples(st.just('wave'), NUDGES),
    st.tuples(
        st.sampled_from(['stop', 'pause', 'resume', 'slow', 'fast', 'lose', 'find']), NUDGES
    ),
)
Plan = list[tuple[tuple[str, list[float]], int]]
PLANS: st.SearchStrategy[Plan] = st.lists(
    st.tuples(STEPS, st.integers(1, 40)), min_size=2, max_size=8
)


def wave(drives: Drives, numbers: list[float]) -> list[GoalPoint]:
    """Return so many points there and back that their preparation takes long."""
    here, sizes = np.array([axis.setpoint for axis in drives.axes]), np.array(numbers)
    shares = enumerate(np.sin(np.arange(1, 61) / 19.0) ** 2)
    return [GoalPoint(0.55 + 0.05 * n, (here + sizes * share).tolist()) for n, share in shares]


IMMEDIATE: dict[str, ImmediateRequest] = {
    'slow': SpeedRequest(0.3),
    'fast': SpeedRequest(1.0),
    'stop': StopRequest('stopped', MOTIONS),
    'pause': PauseRequest(),
    'resume': PauseRequest(is_paused=False),
}


def perform(drives: Drives, kind: str, numbers: list[float]) -> None:
    """Command a step, or let a drive drop out or come back."""
    gateway, names = drives.gateway, drives.gateway.model.joints
    here = np.array([axis.setpoint for axis in drives.axes])
    numbers = numbers if kind == 'twist' else numbers[: len(names)]
    if kind in IMMEDIATE:
        gateway.command(IMMEDIATE[kind])
    elif kind in {'lose', 'find'}:
        drives.axes[3] = replace(drives.axes[3], followable=kind == 'find')
    elif kind == 'twist':
        twist(gateway, numbers, drives.now, 0.2)
    elif kind == 'jog':
        jog(gateway, dict(zip(names, numbers, strict=True)), drives.now, 0.2)
    elif kind == 'pose':
        command = PoseCommand(gateway.model.pose(here + numbers))
        gateway.command(JogRequest(command, drives.now + 0.3))
    elif kind == 'target':
        move_by(gateway, dict(zip(names, numbers, strict=True)))
    elif kind == 'trajectory':
        gateway.request(TrajectoryGoal(names, [GoalPoint(1.0, (here + numbers).tolist())]))
    elif kind == 'wave':
        gateway.request(TrajectoryGoal(names, wave(drives, numbers)))


OUT_OF_A_JOG = [(('jog', [0.3] * 7), 15), (('wave', [0.2] * 7), 40), (('wave', [-0.2] * 7), 40)]
BRIEFLY_LOST = [(('trajectory', [0.3] * 7), 40), (('lose', []), 4), (('find', []), 20)]


@pytest.mark.parametrize('name', ROBOTS)
@given(PLANS)
@example(BRIEFLY_LOST)
@example(OUT_OF_A_JOG)
@settings(max_examples=25, deadline=None)
def test_set_points_keep_every_limit(name: str, plan: Plan) -> None:
    """Velocity, acceleration and jerk of every arm, from any source to any other.

    A drive that drops out is left alone: its own set-points end there, wherever they are. When it
    comes back before the others rest, it waits for them; no speed jumps.
    """
    drives = Drives(name).following()
    begin, losses, states = len(drives.path), [], []
    for (kind, numbers), cycles in [*plan, (('stop', []), 300)]:
        if kind == 'lose':
            losses.append(len(drives.path) - begin)
        perform(drives, kind, numbers)
        for _ in range(cycles):
            drives.run()
            point = drives.gateway.snapshot.set_point
            states += [] if point is None else [point.state]
    if not losses:
        kept(robot(name).limits, states, PERIOD)
        assert not states[-1].moving
    rates = np.abs(np.diff(np.array(drives.path)[begin - 1 :], 2, axis=0)) / PERIOD**2
    for loss in losses:  # an ideal drive stands still at once when it is not commanded
        rates[max(loss - 1, 0) : loss + 1, 3] = 0.0
    assert (rates.max(axis=0) <= 1.02 * robot(name).limits.acceleration + 1e-6).all()


def test_a_refused_command_changes_nothing() -> None:
    """A jog that is under way goes on as if there had been no other."""
    drives, alone = Drives().following(), Drives().following()
    for each in (drives, alone):
        jog(each.gateway, {'panda_joint1': 0.2}, each.now, 5.0)
        each.run(20)
    gateway, nan = drives.gateway, math.nan
    there = [GoalPoint(1.0, [axis.setpoint + 9.0 for axis in drives.axes])]
    refused: list[Future[Any]] = [
        twist(gateway, [nan] * 6, drives.now),
        jog(gateway, {'panda_joint2': 0.1}, drives.now, nan),
        move_by(gateway, {'panda_joint1': nan}).future,
        move_by(gateway, {'panda_joint1': 9.0}).future,
        gateway.request(TrajectoryGoal(gateway.model.joints, there)).future,
    ]
    for each in (drives, alone):
        each.run(30)
    assert all(isinstance(each.exception(0.0), ArmError) for each in refused)
    assert drives.path[-1].tolist() == alone.path[-1].tolist()
    assert drives.axes[0].velocity == pytest.approx(0.2, abs=1e-3)


pytestmark = pytest.mark.slow


def test_jogging_an_arm_that_stands_still_runs_no_further_than_the_limit() -> None:
    """Set-points stop a little ahead of the arm, smoothly, and the joint is named.

    Who lets go and commands again begins where the arm is; a pause is not letting go.
    """
    arm, limits, speed = Elsewhere().following(), FollowingLimits(), 0.5
    begin = np.array(arm.at)
    arm.moves = False
    refusals = jog_elsewhere(arm, 400, speed)
    stop = 0.06  # [rad]
    ahead = limits.following_error_limit + speed * limits.following_delay + stop
    assert (arm.path()[:, 0] - begin[0]).max() < ahead
    assert 'joint_1_s does not follow' in refusals[0]
    no_speed_jumps(arm.path(), arm.gateway.model.limits.acceleration)
    sent = len(arm.points)
    assert len(jog_elsewhere(arm, 100)) == 100
    assert len(arm.points) == sent
    arm.run(40)
    assert arm.gateway.snapshot.blocked == ''
    arm.moves = True
    before = np.array(arm.at)
    assert len(jog_elsewhere(arm, 50)) == 50
    assert len(arm.points) == sent
    arm.run(40)
    assert jog_elsewhere(arm, 1, 0.0) == []
    assert jog_elsewhere(arm, 50) == []
    assert np.abs(arm.path()[sent] - before).max() < 1e-3
    assert arm.at[0] > before[0] + 0.1


def test_a_trajectory_of_an_arm_that_stands_still_ends_with_the_joint() -> None:
    """It is no success; the joint, its distance and the remedy are in the outcome."""
    arm = Elsewhere().following()
    arm.moves = False
    command = arm.gateway.request(swing(arm, 0.4))
    arm.run(300)
    assert outcome(command).code is GoalCode.PATH_TOLERANCE_VIOLATED
    assert 'does not follow: it is 0.2' in outcome(command).reason


@pytest.mark.parametrize('delay', [0, 5, 18])
def test_an_arm_that_is_late_follows(delay: int) -> None:
    """A delay, however fast the arm, is no following error; neither is what it ends with."""
    arm = Elsewhere(FollowingLimits(0.01, 0.2)).following()
    arm.delay = delay
    assert jog_elsewhere(arm, 200, 2.0) == []
    arm.run(30)
    assert np.ptp(arm.path()[:, 0]) > 1.0
    assert arm.gateway.snapshot.blocked == ''


def test_a_jog_is_not_stopped_for_what_is_no_following_error() -> None:
    """A limit of 0 switches it off; joint states that are lost are named as such."""
    endless = Elsewhere(FollowingLimits(0.0)).following()
    endless.moves = False
    assert jog_elsewhere(endless, 200) == []
    silent = Elsewhere(FollowingLimits(0.01, 0.0)).following()
    jog_elsewhere(silent, 50, 2.0)
    silent.is_published = False
    refusals = jog_elsewhere(silent, 60, 2.0)
    assert refusals
    assert all('no joint states' in refusal for refusal in refusals)


def test_continuous_joints_may_be_whole_turns_off() -> None:
    """A driver that reports angles between -pi and pi follows, too."""
    endless, one = np.array([math.inf]), np.ones(1)
    limits = JointLimits(('wheel',), -endless, endless, one, one, one)
    watch = FollowingWatch(limits, FollowingLimits(0.1, 0.0), PERIOD)
    watch.begin(np.array([3.2]))
    assert watch.problem(np.array([3.2 - 2 * math.pi])) == ''
    assert 'wheel' in watch.problem(np.array([3.5 - 2 * math.pi]))


@pytest.mark.parametrize('noise', [0.0, 0.0005, 0.003, 0.006])
def test_a_noisy_arm_at_rest_was_not_moved(noise: float) -> None:
    """Encoder noise resets nothing, so displacements are carried out; a real motion is seen."""
    arm, rng = Elsewhere(), np.random.default_rng(1)

    def run(cycles: int) -> None:
        for _ in range(cycles):
            arm.now += PERIOD
            noisy = arm.at + rng.normal(0.0, noise, len(arm.at))
            arm.feedback.receive(arm.gateway.model.joints, noisy.tolist(), [], arm.now)
            arm.cycle.step(arm.now, PERIOD)

    run(100)
    for _ in range(10):
        begin = arm.at[0]
        command = move_by(arm.gateway, {'joint_1_s': 0.02})
        run(60)
        assert command.future.done()
        assert command.future.exception() is None
        assert arm.at[0] - begin == pytest.approx(0.02, abs=8.0 * noise + 1e-6)
    arm.at = arm.at + 0.2
    run(3)
    sent = len(arm.points)
    move_by(arm.gateway, {'joint_1_s': 0.02})
    run(5)
    assert np.abs(arm.path()[sent] - arm.at).max() < 8.0 * noise + 0.01

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arms elsewhere that do not go where they are sent."""

from __future__ import annotations

import math

import numpy as np
import pytest
from servo_commands import move_by, outcome
from servo_elsewhere import Elsewhere, jog, PERIOD, swing

from arm_model import JointLimits
from arm_servo.io.following import FollowingLimits, FollowingWatch
from arm_trajectory import GoalCode

pytestmark = pytest.mark.slow


def test_jogging_an_arm_that_stands_still_runs_no_further_than_the_limit() -> None:
    """Set-points stop a little ahead of the arm, smoothly, and the joint is named."""
    arm = Elsewhere()
    arm.run(5)
    begin = np.array(arm.at)
    arm.moves = False
    refusals = jog(arm, 400)
    ahead = arm.path()[:, 0] - begin[0]
    limits, speed = FollowingLimits(), 0.5
    assert ahead.max() < limits.error + speed * limits.delay + 0.06  # the stop
    assert 'joint_1_s does not follow' in refusals[0]
    speeds = np.diff(arm.path(), axis=0) / PERIOD
    jumps = np.abs(np.diff(speeds, axis=0)) / PERIOD
    assert (jumps.max(axis=0) < 1.01 * arm.gateway.model.limits.acceleration).all()


def test_a_stream_of_commands_does_not_start_it_again() -> None:
    """Who lets go and commands again begins where the arm is; a pause is not letting go."""
    arm = Elsewhere()
    arm.run(5)
    arm.moves = False
    jog(arm, 300)
    sent = len(arm.points)
    assert len(jog(arm, 100)) == 100
    assert len(arm.points) == sent
    arm.run(40)
    assert arm.gateway.snapshot.blocked == ''
    arm.moves = True
    before = np.array(arm.at)
    assert len(jog(arm, 50)) == 50
    assert len(arm.points) == sent
    arm.run(40)
    assert jog(arm, 1, 0.0) == []
    assert jog(arm, 50) == []
    assert np.abs(arm.path()[sent] - before).max() < 1e-3
    assert arm.at[0] > before[0] + 0.1


def test_a_trajectory_of_an_arm_that_stands_still_ends_with_the_joint() -> None:
    """It is no success; the joint, its distance and the remedy are in the outcome."""
    arm = Elsewhere()
    arm.run(5)
    arm.moves = False
    goal = swing(arm, 0.4)
    command = arm.gateway.request(goal)
    arm.run(300)
    ending = outcome(command)
    assert ending.code is GoalCode.PATH_TOLERANCE_VIOLATED
    assert 'does not follow: it is 0.2' in ending.reason


@pytest.mark.parametrize('delay', [0, 5, 18])
def test_an_arm_that_is_late_follows(delay: int) -> None:
    """A delay, however fast the arm, is no following error; neither is what it ends with."""
    arm = Elsewhere(FollowingLimits(0.01, 0.2))
    arm.delay = delay
    arm.run(5)
    assert jog(arm, 200, 2.0) == []
    arm.run(30)
    assert np.ptp(arm.path()[:, 0]) > 1.0
    assert arm.gateway.snapshot.blocked == ''


def test_no_limit_lets_it_run() -> None:
    """An error of 0 switches it off, for drives that report no positions of their own."""
    arm = Elsewhere(FollowingLimits(0.0))
    arm.run(5)
    arm.moves = False
    assert jog(arm, 200) == []


def test_silence_is_reported_as_silence() -> None:
    """Joint states that are lost in motion are named as such, not as an arm that is stuck."""
    arm = Elsewhere(FollowingLimits(0.01, 0.0))
    arm.run(5)
    jog(arm, 50, 2.0)
    arm.is_published = False
    refusals = jog(arm, 60, 2.0)
    assert refusals
    assert all('no joint states' in refusal for refusal in refusals)


def test_continuous_joints_may_be_whole_turns_off() -> None:
    """A driver that reports angles between -pi and pi follows, too."""
    endless = np.array([math.inf])
    one = np.ones(1)
    watch = FollowingWatch(
        JointLimits(('wheel',), -endless, endless, one, one, one), FollowingLimits(0.1, 0.0), 0.01
    )
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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A trajectory takes an arm over that is in motion, as it takes over one that rests."""

from __future__ import annotations

from dataclasses import replace

import core_commands
from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import ready, robot, ROBOTS
import numpy as np
import pytest
from servo_commands import jog
from servo_drives import Drives
from servo_elsewhere import Elsewhere
from servo_streams import follow_to_the_end, kept, stream

from arm_model import RobotState
from arm_servo import CoreSettings, MotionCore
from arm_trajectory import GoalCode, GoalError, GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow


def jogged(
    name: str, rng: np.random.Generator, by: str, duration: float
) -> tuple[MotionCore, list[RobotState]]:
    """Return a core whose arm was jogged for a time [s] at up to its limits, and its states."""
    core = MotionCore(robot(name), CoreSettings(check_self_collision=False))
    core.reset(ready(name))
    limits = core.model.limits
    if by == 'twist':
        twist = np.concatenate((rng.uniform(-0.6, 0.6, 3), rng.uniform(-1.0, 1.0, 3)))
        core_commands.twist(core, twist, 0.0, duration=9.0)
    else:
        speeds = rng.choice((-0.99, 0.0, 0.99), len(limits)) * limits.velocity
        core_commands.jog(
            core, dict(zip(limits.names, speeds.tolist(), strict=True)), 0.0, duration=9.0
        )
    return core, [core.state, *(point.state for point in stream(core, duration))]


def goal(core: MotionCore, rng: np.random.Generator, kind: str) -> TrajectoryGoal:
    """Return a trajectory to a place near the arm, as clients write them."""
    limits, here = core.model.limits, core.state.position
    there = np.clip(here + rng.uniform(-0.3, 0.3, len(limits)), limits.lower, limits.upper)
    still = (0.0,) * len(limits)
    points = {
        'one point': [GoalPoint(2.0, tuple(there))],
        'with time to spare': [GoalPoint(8.0, tuple(there))],
        'there and back': [GoalPoint(1.5, tuple(there)), GoalPoint(3.0, tuple(here))],
        'planned': [GoalPoint(0.0, tuple(here), still), GoalPoint(2.5, tuple(there), still)],
    }[kind]
    return TrajectoryGoal(limits.names, points)


@pytest.mark.parametrize('kind', ['one point', 'with time to spare', 'there and back', 'planned'])
@pytest.mark.parametrize('by', ['twist', 'joints'])
@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 10**6), duration=st.floats(0.02, 0.8))
def test_a_trajectory_right_after_a_jog_is_followed(
    name: str, by: str, kind: str, seed: int, duration: float
) -> None:
    """At any speed of the jog, and while it speeds up."""
    rng = np.random.default_rng(seed)
    core, states = jogged(name, rng, by, duration)
    wanted = goal(core, rng, kind)
    execution = core_commands.follow(core, wanted)
    states += follow_to_the_end(core, execution)[1:]
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.SUCCESSFUL, execution.ending
    assert states[-1].position == pytest.approx(wanted.points[-1].positions, abs=1e-6)
    kept(core.model.limits, states)


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=3, deadline=None)
@given(seed=st.integers(0, 10**6), duration=st.floats(0.3, 0.8))
def test_a_trajectory_in_motion_is_refused_with_a_time_that_suffices(
    name: str, seed: int, duration: float
) -> None:
    """Back to where the arm was takes time to turn round; as much as the refusal says."""
    rng = np.random.default_rng(seed)
    core, _ = jogged(name, rng, 'joints', duration)
    here = tuple(core.state.position)
    hasty = TrajectoryGoal(core.model.joints, [GoalPoint(0.02, here)])
    try:
        core.plan(hasty, core.basis)
    except GoalError as error:
        factor = float(str(error).split('give the trajectory ')[1].split(' times')[0])
        later = replace(hasty.points[0], time=0.02 * factor)
        core.plan(replace(hasty, points=[later]), core.basis)


@pytest.mark.parametrize('where', ['drives of this process', 'drives elsewhere'])
def test_a_jog_at_full_speed_hands_over_to_a_trajectory(where: str) -> None:
    """As from any client of the nodes: the trajectory takes over, and gets to its end."""
    arm: Drives | Elsewhere = Elsewhere()
    if where == 'drives of this process':
        arm = Drives()
        arm.attach()
    arm.run(2)
    limits = arm.gateway.model.limits
    speeds = dict.fromkeys(limits.names[:1], 0.99 * limits.velocity[0])
    jog(arm.gateway, speeds, arm.now, 1.0)
    arm.run(40)
    reference = arm.gateway.snapshot.reference
    assert reference is not None
    assert reference.moving
    goal = TrajectoryGoal(limits.names, [GoalPoint(2.0, tuple(reference.position))])
    command = arm.gateway.request(goal)
    arm.run(round(3.0 / 0.01))
    assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL, command.ended.result(0.0)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The way that catches up with a trajectory is not the path that was checked: it stays clear."""

from __future__ import annotations

from dataclasses import replace

import core_commands
from core_commands import core_of, ending, goal_to
from model_robots import ready
import numpy as np
import pytest

from arm_model import RobotModel, RobotState
from arm_servo import MotionCore, Source
from arm_trajectory import GoalCode, GoalPoint, StateMovedError, TrajectoryGoal

PERIOD = 0.01

GANTRY = """<robot name="gantry">
<link name="base"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
<link name="bridge"/>
<link name="tool"><collision><origin xyz="0 0 -0.3"/><geometry><sphere radius="0.05"/></geometry>
</collision></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="bridge"/><axis xyz="1 0 0"/>
<limit lower="-2" upper="2" velocity="2" effort="1"/></joint>
<joint name="y" type="prismatic"><parent link="bridge"/><child link="tool"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.3"/><limit lower="-2" upper="2" velocity="2" effort="1"/></joint>
</robot>"""
"""A tool of 0.05 m that moves in a plane around a ball of 0.1 m in its middle."""

GROUP = (
    '<robot name="gantry"><group name="arm"><chain base_link="base" tip_link="tool"/></group>'
    '<disable_collisions link1="base" link2="bridge" reason="Adjacent"/></robot>'
)

LIMITS = {name: {'max_velocity': 2.0, 'max_acceleration': 5.0, 'max_jerk': 50.0} for name in 'xy'}


def jogged_past_the_ball(speed: float) -> MotionCore:
    """Return a gantry that jogs along y at a speed [m/s], and is beside the ball now."""
    core = MotionCore(RobotModel(GANTRY, GROUP, LIMITS))
    core.reset([-0.3, -0.17 - np.sign(speed) * 0.6])
    for cycle in range(400):
        core_commands.jog(core, {'y': speed}, cycle * PERIOD)
        core.step(cycle * PERIOD, PERIOD)
        if abs(core.state.position[1] + 0.17) < 0.02 + 0.005 * abs(speed):
            return core
    raise AssertionError('it does not get there')


@pytest.mark.parametrize(
    ('jog', 'aside', 'speed'),
    [(-1.9, 0.009, 1.0), (-1.9, 0.009, 1.5), (1.9, -0.009, 0.5), (1.9, 0.009, 0.5)],
)
def test_catching_up_makes_no_contact(jog: float, aside: float, speed: float) -> None:
    """A path leads around the ball; an arm in motion that catches up would cut its corner."""
    core = jogged_past_the_ball(jog)
    x, beside = core.state.position[0], core.state.position[1] + aside
    y = min(beside, -0.16)  # the path itself must be clear
    corner = (0.17 - x) / speed
    points = [
        GoalPoint(0.0, [x, y]),
        GoalPoint(corner, [0.17, y]),
        GoalPoint(corner + (0.3 - y) / speed, [0.17, 0.3]),
    ]
    # the plan is for an arm at rest there: the way from the motion is not in it
    basis = replace(core.basis, state=RobotState.at_rest(np.array([x, y])))
    motion = core.plan(TrajectoryGoal(core.model.joints, points), basis)
    assert motion is not None
    core.begin(motion, basis)
    execution = core.execution
    assert execution is not None
    for cycle in range(400, 700):
        state = core.step(cycle * PERIOD, PERIOD).state
        assert core.model.clearance(state.position) > 0.0
        if not state.moving:
            break
    assert ending(execution).code is GoalCode.PATH_TOLERANCE_VIOLATED
    assert 'base - tool' in ending(execution).reason
    assert core.source is Source.NONE


def test_a_trajectory_is_void_where_the_arm_is_elsewhere() -> None:
    """Prepared from a place 0.02 rad away it is refused: its path was checked from there only."""
    core = core_of('panda')
    goal = goal_to(core, ready('panda') + 0.2)
    basis = core.basis.foreseen(0.0)
    aside = replace(basis, state=RobotState.at_rest(basis.state.position + 0.02))
    motion = core.plan(goal, aside)
    assert motion is not None
    with pytest.raises(StateMovedError) as refused:
        core.begin(motion, aside)
    assert refused.value.code is GoalCode.INVALID_GOAL
    assert core.source is Source.NONE

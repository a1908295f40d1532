# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints beside a group count where they stand: another arm, a gate of a drive elsewhere."""

from __future__ import annotations

import math

from moveit_msgs.msg import AllowedCollisionEntry, AllowedCollisionMatrix, PlanningScene
import numpy as np
import pytest
from sensor_msgs.msg import JointState
from servo_commands import Drives, jog, PERIOD
from servo_nodes import Listener

from arm_model import CommandError, RobotModel
from arm_servo import TargetRequest
from arm_servo.core.gateway import MotionCommand
from arm_trajectory import GoalCode, GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

ARMS = ('left', 'right')
LINKS = ('base', 'left_link', 'right_link', 'gate_link')
QUARTER = math.pi / 2


def _joint(name: str, kind: str, xyz: str, box: str, at: str) -> str:
    return (
        f'<link name="{name}_link"><collision><origin xyz="{at}"/><geometry><box size="{box}"/>'
        f'</geometry></collision></link><joint name="{name}" type="{kind}"><parent link="base"/>'
        f'<child link="{name}_link"/><origin xyz="{xyz}"/><axis xyz="0 0 1"/>'
        '<limit lower="-2" upper="2" velocity="2" effort="1"/></joint>'
    )


def texts() -> tuple[str, str, dict[str, dict[str, float]]]:
    """Return two arms that turn in one plane and meet between them, and a gate behind the left.

    Turned by a quarter towards each other they overlap; the gate is in the way at 0.
    """
    arm, middle = '0.4 0.04 0.04', '0.2 0 0'
    urdf = (
        '<robot name="two"><link name="base"/>'
        + _joint('left', 'revolute', '0 0.3 0', arm, middle)
        + _joint('right', 'revolute', '0 -0.3 0', arm, middle)
        + _joint('gate', 'prismatic', '0 0.6 0', '0.1 0.1 0.1', '0 0 0')
        + '</robot>'
    )
    groups = ''.join(f'<group name="{side}"><joint name="{side}"/></group>' for side in ARMS)
    srdf = f'<robot name="two">{groups}<disable_collisions link1="x" link2="y"/></robot>'
    limits = {side: {'max_acceleration': 5.0, 'max_jerk': 50.0} for side in ARMS}
    return urdf, srdf, limits


class Robot:
    """Both arms, and the listener that knows where they are."""

    def __init__(self, left: float = 0.0, right: float = 0.0, gate: float = 1.0) -> None:
        self.arms = {}  # drives of each arm
        for side, other, at in (('left', 'right', left), ('right', 'left', right)):
            model = RobotModel(*texts(), side, moved_by_others={other: [other]})
            self.arms[side] = Drives(model=model, begin=[at])
            self.arms[side].attach()
            self.arms[side].run(2)
        self.listener = Listener(*self.arms.values())  # the listener
        self.place_gate(gate)
        self.run(0.3)

    def place_gate(self, position: float) -> None:
        """Deliver a joint state of the gate."""
        self.listener.made._take_joints(JointState(name=['gate'], position=[position]))

    def run(self, seconds: float) -> None:
        """Advance the time: ten cycles of both between two looks."""
        for cycle in range(round(seconds / PERIOD)):
            for drives in self.arms.values():
                drives.run()
            if cycle % 10 == 9:
                self.listener.run(0.1)

    def scene(self, side: str = 'left') -> object:
        """Return the scene that counts for an arm."""
        return self.arms[side].gateway.model.scene

    def send(self, side: str, position: float) -> MotionCommand:
        """Send an arm to a place."""
        return self.arms[side].gateway.request(TargetRequest({side: position}))

    def at(self, side: str) -> float:
        """Return where an arm is."""
        return float(self.arms[side].path[-1][0])


@pytest.mark.parametrize('right', [0.0, QUARTER])
def test_an_arm_does_not_move_into_another_that_rests(right: float) -> None:
    """It is checked where it stands, not at 0: a target into it is refused with the pair."""
    robot = Robot(right=right)
    command = robot.send('left', -QUARTER)
    robot.run(3.0)
    if right:
        with pytest.raises(CommandError, match='left_link and right_link would collide'):
            command.future.result(0.0)
        assert robot.at('left') == 0.0
    else:
        assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL


def test_a_jog_stops_in_front_of_an_arm_that_rests() -> None:
    """And the report names it."""
    robot = Robot(right=QUARTER)
    left = robot.arms['left']
    jog(left.gateway, {'left': -0.5}, left.now, 30.0)
    robot.run(5.0)
    point = left.gateway.snapshot.set_point
    assert point is not None
    assert any('right_link' in limiter.name for limiter in point.report.limiters)
    assert -QUARTER < robot.at('left') < -0.5
    assert left.gateway.model.clearance(left.path[-1]) > 0.0


@pytest.mark.parametrize('gate', [0.0, 1.0])
def test_a_joint_without_a_group_counts_where_its_joint_states_have_it(gate: float) -> None:
    """A way that is clear is not refused for where the joint is not."""
    robot = Robot(gate=gate)
    command = robot.send('left', QUARTER)
    robot.run(3.0)
    if gate:
        assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL
    else:
        with pytest.raises(CommandError, match='left_link and gate_link would collide'):
            command.future.result(0.0)


@pytest.mark.parametrize('is_allowed', [True, False])
def test_arms_that_both_move_meet_only_where_the_scene_of_the_planner_lets_them(
    is_allowed: bool,
) -> None:
    """Each stops in front of the other, and names it."""
    robot = Robot()
    entries = [AllowedCollisionEntry(enabled=[is_allowed] * 2) for _ in ARMS]
    names = [f'{side}_link' for side in ARMS]
    matrix = AllowedCollisionMatrix(entry_names=names, entry_values=entries)
    robot.listener.take(PlanningScene(allowed_collision_matrix=matrix))
    robot.run(0.2)
    for side, velocity in (('left', -0.5), ('right', 0.5)):
        jog(robot.arms[side].gateway, {side: velocity}, robot.arms[side].now, 30.0)
    robot.run(3.2)
    here = {side: robot.at(side) for side in ARMS} | {'gate': 1.0}
    distance = RobotModel(*texts(), 'left').with_others(here).clearance(np.array([here['left']]))
    point = robot.arms['left'].gateway.snapshot.set_point
    assert point is not None
    assert ('right_link' in str(point.report)) != is_allowed
    assert (distance > 0.0) != is_allowed


def test_arms_that_move_at_the_same_time_are_checked_once_one_rests() -> None:
    """A trajectory under way ends on its path where the other has come to rest in it."""
    robot = Robot()
    left = robot.arms['left']
    goal = TrajectoryGoal(left.gateway.model.joints, [GoalPoint(8.0, [-QUARTER])])
    command = left.gateway.request(goal)
    robot.run(0.2)
    robot.send('right', QUARTER)
    robot.run(10.0)
    ended = command.ended.result(0.0)
    assert ended.code is GoalCode.PATH_TOLERANCE_VIOLATED
    assert 'left_link and right_link would collide' in ended.reason
    assert left.gateway.model.clearance(left.path[-1]) > 0.0
    assert robot.at('right') == pytest.approx(QUARTER, abs=1e-6)


def test_noise_of_a_joint_beside_the_group_makes_no_new_scene() -> None:
    """What was prepared stays valid."""
    robot = Robot()
    scene = robot.scene()
    for number in range(20):
        robot.place_gate(1.0 + 4e-4 * (-1) ** number)
        robot.run(0.1)
    assert robot.scene() is scene
    robot.place_gate(1.1)
    robot.run(0.2)
    assert robot.scene() is not scene


def test_a_joint_that_moves_beside_the_group_makes_few_scenes() -> None:
    """One in half a second, and the last where it came to rest."""
    robot = Robot()
    scenes = set()
    for number in range(30):
        robot.place_gate(1.0 + 0.01 * number)
        robot.run(0.1)
        scenes.add(robot.scene())
    assert 5 <= len(scenes) <= 7
    robot.run(0.2)
    kinematics = robot.arms['left'].gateway.model.scene.kinematics
    assert kinematics.others['gate'] == pytest.approx(1.29)


def test_the_scene_of_a_planner_leaves_the_joints_where_they_are() -> None:
    """Its matrix has all links; the other arm is checked all the same, and only where it rests."""
    robot = Robot(right=QUARTER)
    entry = AllowedCollisionEntry(enabled=[False] * len(LINKS))
    matrix = AllowedCollisionMatrix(entry_names=list(LINKS), entry_values=[entry for _ in LINKS])
    robot.listener.take(PlanningScene(allowed_collision_matrix=matrix))
    robot.run(0.2)
    command = robot.send('left', -QUARTER)
    robot.run(0.5)
    with pytest.raises(CommandError, match='left_link and right_link would collide'):
        command.future.result(0.0)
    away = robot.send('right', 0.0)
    robot.run(4.0)
    assert away.ended.result(0.0).code is GoalCode.SUCCESSFUL
    command = robot.send('left', -QUARTER)
    robot.run(3.0)
    assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL


def test_a_joint_of_which_nothing_is_known_is_named_once() -> None:
    """With where it is taken to be."""
    robot = Robot(gate=math.nan)
    robot.run(10.0)
    warnings = [text for text in robot.listener.warnings if 'gate at 0' in text]
    assert len(warnings) == len(ARMS)
    assert 'group left: collisions are checked with gate at 0' in warnings[0]
    known = Robot()
    known.run(10.0)
    assert not known.listener.warnings

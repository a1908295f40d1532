# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints beside a group count where they stand: another arm, a gate of a drive elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

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
    arm = ('0.4 0.04 0.04', '0.2 0 0')
    joints = (
        _joint('left', 'revolute', '0 0.3 0', *arm),
        _joint('right', 'revolute', '0 -0.3 0', *arm),
        _joint('gate', 'prismatic', '0 0.6 0', '0.1 0.1 0.1', '0 0 0'),
    )
    urdf = f'<robot name="two"><link name="base"/>{"".join(joints)}</robot>'
    groups = ''.join(f'<group name="{side}"><joint name="{side}"/></group>' for side in ARMS)
    srdf = f'<robot name="two">{groups}<disable_collisions link1="x" link2="y"/></robot>'
    return urdf, srdf, {side: {'max_acceleration': 5.0, 'max_jerk': 50.0} for side in ARMS}


def matrix(names: Sequence[str], *, is_allowed: bool) -> PlanningScene:
    """Return a scene in which links may all touch, or none."""
    entry = AllowedCollisionEntry(enabled=[is_allowed] * len(names))
    allowed = AllowedCollisionMatrix(entry_names=[*names], entry_values=[entry for _ in names])
    return PlanningScene(allowed_collision_matrix=allowed)


class Robot:
    """Both arms, and the listener that knows where they are."""

    def __init__(self, right: float = 0.0, gate: float = 1.0) -> None:
        self.arms = {}  # drives of each arm
        for side, other, at in (('left', 'right', 0.0), ('right', 'left', right)):
            model = RobotModel(*texts(), side, moved_by_others={other: [other]})
            self.arms[side] = Drives(model=model, begin=[at]).following()
        self.listener = Listener(*self.arms.values())
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

    def take(self, scene: PlanningScene) -> None:
        """Deliver the scene of a planner."""
        self.listener.take(scene)
        self.run(0.2)

    def jog(self, side: str, velocity: float) -> None:
        """Jog an arm for half a minute."""
        arm = self.arms[side]
        jog(arm.gateway, {side: velocity}, arm.now, 30.0)

    @property
    def scene(self) -> Any:
        """The scene that counts for the left arm."""
        return self.arms['left'].gateway.model.scene

    @property
    def report(self) -> str:
        """What limits the left arm."""
        point = self.arms['left'].gateway.snapshot.set_point
        assert point is not None
        return str(point.report)

    def send(self, side: str, position: float) -> MotionCommand:
        """Send an arm to a place."""
        return self.arms[side].gateway.request(TargetRequest({side: position}))

    def at(self, side: str) -> float:
        """Return where an arm is."""
        return float(self.arms[side].path[-1][0])


@pytest.mark.parametrize(
    ('right', 'gate', 'to', 'link'),
    [
        (0.0, 1.0, -QUARTER, ''),
        (QUARTER, 1.0, -QUARTER, 'right_link'),
        (0.0, 1.0, QUARTER, ''),
        (0.0, 0.0, QUARTER, 'gate_link'),
    ],
)
def test_an_arm_does_not_move_into_what_rests_beside_it(
    right: float, gate: float, to: float, link: str
) -> None:
    """Another arm, a joint without a group: checked where they stand, and not at 0."""
    robot = Robot(right=right, gate=gate)
    command = robot.send('left', to)
    robot.run(3.0)
    if link:
        with pytest.raises(CommandError, match=f'left_link and {link} would collide'):
            command.future.result(0.0)
        assert robot.at('left') == 0.0
    else:
        assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL


def test_a_jog_stops_in_front_of_an_arm_that_rests() -> None:
    """And the report names it."""
    robot = Robot(right=QUARTER)
    robot.jog('left', -0.5)
    robot.run(5.0)
    assert 'right_link' in robot.report
    assert -QUARTER < robot.at('left') < -0.5
    left = robot.arms['left']
    assert left.gateway.model.clearance(left.path[-1]) > 0.0


@pytest.mark.parametrize('is_allowed', [True, False])
def test_arms_that_both_move_meet_only_where_the_scene_of_the_planner_lets_them(
    is_allowed: bool,
) -> None:
    """Each stops in front of the other, and names it."""
    robot = Robot()
    robot.take(matrix(['left_link', 'right_link'], is_allowed=is_allowed))
    robot.jog('left', -0.5)
    robot.jog('right', 0.5)
    robot.run(3.2)
    here = {side: robot.at(side) for side in ARMS} | {'gate': 1.0}
    distance = RobotModel(*texts(), 'left').with_others(here).clearance(np.array([here['left']]))
    assert ('right_link' in robot.report) != is_allowed
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


def test_a_joint_that_moves_beside_the_group_makes_few_scenes() -> None:
    """Noise none: what was prepared stays valid. One in half a second, and the last at rest."""
    robot = Robot()
    scene, scenes = robot.scene, set()
    for number in range(20):
        robot.place_gate(1.0 + 4e-4 * (-1) ** number)
        robot.run(0.1)
    assert robot.scene is scene
    for number in range(30):
        robot.place_gate(1.0 + 0.01 * number)
        robot.run(0.1)
        scenes.add(robot.scene)
    assert 5 <= len(scenes) <= 7
    robot.run(0.2)
    assert robot.scene.kinematics.others['gate'] == pytest.approx(1.29)


def test_the_scene_of_a_planner_leaves_the_joints_where_they_are() -> None:
    """Its matrix has all links; the other arm is checked all the same, and only where it rests."""
    robot = Robot(right=QUARTER)
    robot.take(matrix(LINKS, is_allowed=False))
    command = robot.send('left', -QUARTER)
    robot.run(0.5)
    with pytest.raises(CommandError, match='left_link and right_link would collide'):
        command.future.result(0.0)
    for side, to in (('right', 0.0), ('left', -QUARTER)):
        command = robot.send(side, to)
        robot.run(4.0)
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

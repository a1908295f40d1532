# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that make whole turns: clients get the way that is shortest."""

from __future__ import annotations

from collections.abc import Iterator
import json
from typing import Any

from geometry_msgs.msg import Pose as PoseMessage
from isolation import reserve
from model_robots import chain_texts
from move_group_rig import joint_goal, motion_request, MoveGroupRig, parameter_file, pose_goal
from moveit_msgs.msg import Constraints, JointConstraint, MoveItErrorCodes
import numpy as np
import pytest

from arm_model import frozen, RobotModel
from arm_planning.ik import IkSolver

pytestmark = pytest.mark.xdist_group('turns')

JOINTS = [f'j{number}' for number in range(1, 8)]
START = [-3.1, 0.4, -0.8, 0.3, 0.6, 0.2, 6.0]


def texts() -> tuple[str, str, dict[str, Any]]:
    """Return URDF, SRDF and limits of an arm whose first joint has no end, the last two turns."""
    urdf, srdf, limits = chain_texts('cyyzyyz')
    head, last, tail = urdf.partition('<joint name="j7"')
    turns = tail.replace('lower="-2" upper="2"', 'lower="-6.28" upper="6.28"')
    return head + last + turns, srdf, limits


@pytest.fixture(name='rig', scope='module')
def start(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MoveGroupRig]:
    """Start move_group, with the arm at the start."""
    urdf, srdf, limits = texts()
    folder = tmp_path_factory.mktemp('chain')
    file = folder / 'limits.yaml'
    file.write_text(json.dumps({'joint_limits': limits}))
    arguments = ('--ros-args', '--params-file', str(parameter_file(folder, urdf, srdf, file)))
    at = dict(zip(JOINTS, START, strict=True))
    with reserve() as isolation, MoveGroupRig(isolation, *arguments, positions=at) as rig:
        yield rig


def end(rig: MoveGroupRig, goal: Constraints, **fields: Any) -> list[float]:
    """Return where a plan ends in [rad]."""
    response = rig.plan(motion_request(goal, 'arm', **fields))
    assert response.error_code.val == MoveItErrorCodes.SUCCESS, response.error_code
    return list(response.trajectory.joint_trajectory.points[-1].positions)


@pytest.mark.parametrize('planner', ['', 'PTP'])
def test_a_joint_without_end_turns_the_shorter_way(rig: MoveGroupRig, planner: str) -> None:
    """By 0.08 from -3.1 to 3.1; constraints hold in any turn; others go where they are sent."""
    goal = joint_goal([3.1, -3.0], ['j1', 'j7'])
    near = JointConstraint(joint_name='j1', position=3.14, weight=1.0)
    near.tolerance_above = near.tolerance_below = 0.1
    bounds = Constraints(joint_constraints=[near])
    place = end(rig, goal, planner_id=planner, path_constraints=bounds)
    assert place[0] == pytest.approx(3.1 - 2.0 * np.pi, abs=1e-3)
    assert place[6] == pytest.approx(-3.0, abs=1e-3)


def test_a_pose_within_a_tolerance_is_reached_in_the_same_turn(rig: MoveGroupRig) -> None:
    """Its middle is out of reach, a part of it is not."""
    here = rig.fk('tip')
    goal = pose_goal(PoseMessage(position=here.position), 'tip', 'base')
    goal.orientation_constraints = []
    goal.position_constraints[0].constraint_region.primitive_poses[0].position.z += 5.0
    goal.position_constraints[0].constraint_region.primitives[0].dimensions[0] = 5.0
    for _ in range(5):
        place = end(rig, goal)
        assert abs(place[0] - START[0]) < np.pi
        assert abs(place[6] - START[6]) < np.pi


def test_solutions_of_a_pose_are_in_the_nearest_turn() -> None:
    """Those that random starts lead to, too; a second question has other starts."""
    model = RobotModel(*texts())
    solver, seed = IkSolver(model), frozen([*START[:6], 3.0])
    pose = solver.link.pose(seed)
    first, second = (solver.solve(pose, seed, timeout=20.0, count=8) for _ in range(2))
    for solution in (*first, *second):
        assert np.abs(solution - seed)[[0, 6]].max() <= np.pi + 1e-9
    assert not np.allclose(first[-1], second[-1])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that make whole turns take the way that is shortest."""

from __future__ import annotations

from functools import cache

from model_robots import chain_texts
import numpy as np
from planning_scenes import near
import pytest

from arm_model import frozen, Pose, RobotModel, Sphere
from arm_planning import JointGoal, MotionRequest, PathConstraints, Planner, PoseGoal
from arm_planning.ik import IkSolver

START = frozen([-3.1, 0.4, -0.8, 0.3, 0.6, 0.2, 6.0])


@cache
def model() -> RobotModel:
    """Return an arm whose first joint has no end, and the last one two turns."""
    urdf, srdf, limits = chain_texts('cyyzyyz')
    head, last, tail = urdf.partition('<joint name="j7"')
    turns = tail.replace('lower="-2" upper="2"', 'lower="-6.28" upper="6.28"')
    return RobotModel(head + last + turns, srdf, limits)


@pytest.mark.parametrize('planner', ['', 'PTP'])
def test_a_joint_without_end_turns_the_shorter_way(planner: str) -> None:
    """By 0.08 from -3.1 to 3.1; constraints hold in any turn; others go where they are sent."""
    goal = JointGoal(frozen([3.1, *START[1:6], -3.0]))
    bounds = PathConstraints({'j1': (3.04, 3.24)})
    asked = MotionRequest(START, [goal], planner, timeout=60.0, constraints=bounds)
    end = Planner(model()).plan(asked).path.end.position
    assert end[0] == pytest.approx(3.1 - 2.0 * np.pi, abs=1e-3)
    assert end[6] == pytest.approx(-3.0, abs=1e-3)


def test_a_pose_within_a_tolerance_is_reached_in_the_same_turn() -> None:
    """Its middle is out of reach, a part of it is not."""
    here = model().pose(START)
    far = Pose(here.rotation, frozen(np.add(here.position, [0.0, 0.0, 5.0])))
    goal = PoseGoal(far, tolerances=near(far, Sphere(5.0), frozen([np.pi] * 3)))
    for seed in range(5):
        plan = Planner(model(), seed=seed).plan(MotionRequest(START, [goal], timeout=60.0))
        assert np.abs(plan.path.end.position - START)[[0, 6]].max() < np.pi


def test_solutions_of_a_pose_are_in_the_nearest_turn() -> None:
    """Those that random starts lead to, too; a second question has other starts."""
    solver, seed = IkSolver(model()), frozen([*START[:6], 3.0])
    pose = solver.link.pose(seed)
    first, second = (solver.solve(pose, seed, timeout=20.0, count=8) for _ in range(2))
    for solution in (*first, *second):
        assert np.abs(solution - seed)[[0, 6]].max() <= np.pi + 1e-9
    assert not np.allclose(first[-1], second[-1])

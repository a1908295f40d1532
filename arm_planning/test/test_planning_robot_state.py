# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States and paths as messages: nothing is lost."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from moveit_msgs.msg import Constraints, JointConstraint
import numpy as np
from planning_messages import panda
import pytest

from arm_model import ModelError
from arm_model.ros import seconds
from arm_planning import JointGoal
from arm_planning.ros.motion_request import RequestReader
from arm_planning.ros.robot_groups import RobotGroups
from arm_planning.ros.scene import SceneSnapshot
from arm_planning.ros.trajectories import check_trajectory, path_of, trajectory_message
from arm_trajectory import lines, Path

JOINTS = panda().joints


def test_a_goal_has_the_tolerance_of_the_nearer_side() -> None:
    """The joints that it leaves out stay."""
    model = panda().model('panda_arm')
    ready = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    places = panda().positions(dict(zip(model.joints, ready.tolist(), strict=True)))
    message = JointConstraint(joint_name=model.joints[0], position=0.5)
    message.tolerance_above, message.tolerance_below = 0.3, 0.01
    reader = RequestReader(model, SceneSnapshot(panda().scene), places)
    goal = reader.goal(Constraints(joint_constraints=[message]))
    assert isinstance(goal, JointGoal)
    assert list(goal.positions) == pytest.approx([0.5, *ready[1:]])
    assert goal.tolerance[0] == pytest.approx(0.01)


def test_joints_that_are_not_given_stand_in_their_range() -> None:
    """Joint 4 of the Panda has no zero."""
    positions = panda().positions({JOINTS[0]: 0.5})
    assert positions[0] == 0.5
    model = panda().model('panda_arm')
    inside = np.array([positions[JOINTS.index(name)] for name in model.joints])
    assert (inside >= model.limits.lower).all()
    assert (inside <= model.limits.upper).all()


@given(st.lists(st.one_of(st.floats(1e-12, 1e-8), st.floats(1e-4, 2.0)), min_size=1, max_size=8))
def test_points_of_a_path_have_times_that_increase(durations: list[float]) -> None:
    """A phase of a motion may be shorter than a nanosecond; the ends are where they are."""
    rates = np.random.default_rng(len(durations)).uniform(-1.0, 1.0, (len(durations), 2))
    lasts = np.array(durations)
    ways = np.cumsum(rates * lasts[:, None], axis=0)
    path = Path(lasts, lines(lasts, np.concatenate((np.zeros((1, 2)), ways))))
    trajectory = trajectory_message(['a', 'b'], path, 'base').joint_trajectory
    check_trajectory(trajectory)
    first, last = trajectory.points[0], trajectory.points[-1]
    assert first.positions == pytest.approx([0.0, 0.0], abs=1e-8)
    assert last.positions.tolist() == path.end.position.tolist()
    assert seconds(last.time_from_start) == pytest.approx(path.duration, abs=1e-9)


def test_points_of_a_path_are_near_to_each_other_and_make_it() -> None:
    """Viewers show one after the other; what interpolates them with quintics has the path."""
    random = np.random.default_rng(0)
    for duration in (0.05, 0.73, 2.0):
        path = Path(np.array([duration]), random.uniform(-1.0, 1.0, (1, 6, 3)))
        trajectory = trajectory_message(['a', 'b', 'c'], path, 'base').joint_trajectory
        times = [seconds(point.time_from_start) for point in trajectory.points]
        assert np.diff(times).max() <= 0.1 + 1e-9
        again = path_of(trajectory)
        looks = np.linspace(0.0, path.duration, 500)
        assert again.positions(looks) == pytest.approx(path.positions(looks), abs=1e-6)


def test_a_robot_without_groups_is_refused() -> None:
    """Nothing could be planned."""
    with pytest.raises(ModelError, match='no group'):
        RobotGroups('<robot name="r"><link name="base"/></robot>', '<robot name="r"/>', {})

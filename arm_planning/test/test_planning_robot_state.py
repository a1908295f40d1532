# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States and paths as messages: nothing is lost, and what is wrong is refused."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
from moveit_msgs.msg import RobotState
import numpy as np
from planning_messages import panda
import pytest
from sensor_msgs.msg import JointState

from arm_model import ModelError
from arm_model.ros import seconds
from arm_planning import PlanningCode, PlanningError
from arm_planning.ros.joint_trajectory import check_trajectory
from arm_planning.ros.path_watch import path_of
from arm_planning.ros.robot_groups import RobotGroups
from arm_planning.ros.robot_state import joints_of, trajectory_message
from arm_trajectory import Path, Segment

JOINTS = panda().joints


@pytest.mark.parametrize(
    ('state', 'words'),
    [
        (JointState(name=['elbow'], position=[0.0]), "no joint 'elbow'"),
        (JointState(name=[JOINTS[0]], position=[math.nan]), 'nan'),
        (JointState(name=[JOINTS[0]]), '1 names and 0 positions'),
    ],
)
def test_states_that_are_wrong_are_refused(state: JointState, words: str) -> None:
    """An unknown joint, a position that is no number, or none at all."""
    with pytest.raises(PlanningError, match=words) as refusal:
        joints_of(RobotState(joint_state=state), panda().all_joints)
    assert refusal.value.code is PlanningCode.INVALID_ROBOT_STATE


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
    starts = np.concatenate(((0.0,), np.cumsum(durations)[:-1]))
    rates = np.random.default_rng(len(durations)).uniform(-1.0, 1.0, (len(durations), 2))
    segments, place = [], np.zeros(2)
    for start, duration, rate in zip(starts.tolist(), durations, rates, strict=True):
        segments.append(Segment(start, duration, np.array([place, rate, *np.zeros((4, 2))])))
        place = place + rate * duration
    path = Path(segments)
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
        path = Path([Segment(0.0, duration, random.uniform(-1.0, 1.0, (6, 3)))])
        trajectory = trajectory_message(['a', 'b', 'c'], path, 'base').joint_trajectory
        times = [seconds(point.time_from_start) for point in trajectory.points]
        assert np.diff(times).max() <= 0.1 + 1e-9
        again = path_of(trajectory)
        looks = np.linspace(0.0, path.duration, 500)
        assert again.positions(looks) == pytest.approx(path.positions(looks), abs=1e-6)


def test_an_unknown_group_is_refused_with_the_known_ones() -> None:
    """MoveIt's code for it."""
    with pytest.raises(PlanningError, match='panda_arm') as refusal:
        panda().model('legs')
    assert refusal.value.code is PlanningCode.INVALID_GROUP_NAME


def test_a_robot_without_groups_is_refused() -> None:
    """Nothing could be planned."""
    with pytest.raises(ModelError, match='no group'):
        RobotGroups('<robot name="r"><link name="base"/></robot>', '<robot name="r"/>', {})

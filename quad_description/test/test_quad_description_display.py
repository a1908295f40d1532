# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The display node: what it publishes, and the motion that it shows."""

from __future__ import annotations

import sys

from hypothesis import given
from hypothesis import strategies as st
from isolation import Isolation
from processes import RunningProcess
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from node_runner import LATCHED
from quad_description import movable_joints, Pose, pose_positions, quadruped, robot_urdf
from quad_description.display import sweep, SWEEP_DURATION

pytestmark = pytest.mark.slow

JOINTS = movable_joints(robot_urdf('lite'))
ROBOT = quadruped(robot_urdf('lite'))
REST = pose_positions(Pose.STAND)


@given(st.floats(0, 1e4))
def test_a_sweep_moves_one_joint_within_its_limits(elapsed: float) -> None:
    """At any time at most one joint is off its rest, and none beyond a limit.

    After a quarter of its turn each is at the upper one, after three quarters at the lower one.
    """
    positions = sweep(JOINTS, REST, elapsed)
    assert sum(positions[name] != REST[name] for name in REST) <= 1
    for index, joint in enumerate(JOINTS):
        assert joint.limits.lower - 1e-9 <= positions[joint.name] <= joint.limits.upper + 1e-9
        for part, limit in ((0.25, joint.limits.upper), (0.75, joint.limits.lower)):
            turned = sweep(JOINTS, REST, (index + part) * SWEEP_DURATION)
            assert turned[joint.name] == pytest.approx(limit)


def test_the_display_publishes_what_viewers_need(isolation: Isolation) -> None:
    """A late subscriber gets the URDF, and joint states name every motor of it."""
    words = '--ros-args', '-p', 'preset:=mini', '-p', 'arm:=true', '-p', 'motion:=lie'
    node = [sys.executable, '-m', 'quad_description.display', *words]
    with RunningProcess(node, isolation.env), RosClient(isolation.domain_id) as client:
        states = client.listen(JointState, '/joint_states')
        client.spin_until(lambda: bool(states), 20.0, 'joint states')
        late = client.listen(String, '/robot_description', LATCHED)
        trees = client.listen(TFMessage, '/tf')
        client.spin_until(lambda: bool(late and trees), 20.0, 'description and /tf')
    assert late[0].data == robot_urdf('mini', arm=True)
    tree = trees[0].transforms[0]
    assert (tree.header.frame_id, tree.child_frame_id) == ('base_link', 'base_footprint')
    lying = ROBOT.standing_height(list(pose_positions(Pose.LIE).values()))
    assert tree.transform.translation.z == pytest.approx(-lying)
    named = dict(zip(states[0].name, states[0].position, strict=True))
    assert named == pose_positions(Pose.LIE, arm=True)

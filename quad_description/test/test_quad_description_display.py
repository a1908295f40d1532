# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The display node: what it publishes, and the motion that it shows."""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys

from hypothesis import given
from hypothesis import strategies as st
from isolation import Isolation
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from node_runner import LATCHED
from quad_description import movable_joints, Pose, pose_positions, quadruped, robot_urdf
from quad_description.display import sweep, SWEEP_DURATION

pytestmark = pytest.mark.slow

PACKAGE = Path(__file__).parents[1]
JOINTS = movable_joints(robot_urdf('lite'))
ROBOT = quadruped(robot_urdf('lite'))
REST = pose_positions(Pose.STAND)


@given(st.floats(0, 1e4))
def test_a_sweep_moves_one_joint_within_its_limits(elapsed: float) -> None:
    """At any time at most one joint is off its rest, and none beyond a limit."""
    positions = sweep(JOINTS, REST, elapsed)
    assert sum(positions[name] != REST[name] for name in REST) <= 1
    for joint in JOINTS:
        assert joint.limits.lower - 1e-9 <= positions[joint.name] <= joint.limits.upper + 1e-9


def test_a_sweep_reaches_both_ends_of_every_joint() -> None:
    """A quarter of a turn is the upper limit, three quarters are the lower one."""
    for index, joint in enumerate(JOINTS):
        up = sweep(JOINTS, REST, (index + 0.25) * SWEEP_DURATION)
        down = sweep(JOINTS, REST, (index + 0.75) * SWEEP_DURATION)
        assert up[joint.name] == pytest.approx(joint.limits.upper)
        assert down[joint.name] == pytest.approx(joint.limits.lower)


def display(isolation: Isolation, *parameters: str) -> subprocess.Popen[str]:
    """Start the node as its own process."""
    arguments = [word for text in parameters for word in ('-p', text)]
    command = [sys.executable, '-m', 'quad_description.display', '--ros-args', *arguments]
    return subprocess.Popen(
        command, cwd=PACKAGE, env=isolation.env, stderr=subprocess.PIPE, text=True
    )


def test_the_display_publishes_what_viewers_need(isolation: Isolation) -> None:
    """A late subscriber gets the URDF, and joint states name every motor of it."""
    process = display(isolation, 'preset:=mini', 'arm:=true', 'motion:=lie')
    try:
        with RosClient(isolation.domain_id) as client:
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
    finally:
        process.terminate()
        process.communicate(timeout=20)


def test_a_wrong_parameter_ends_it_with_the_remedy(isolation: Isolation) -> None:
    """The node exits with 1 and says what is possible."""
    process = display(isolation, 'motoin:=lie')
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "did you mean 'motion'" in errors

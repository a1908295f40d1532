# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A bring-up of the quadruped: the article's frames, and Ctrl-C while it is on its way down."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

from nav_msgs.msg import Odometry
from processes import RunningProcess
import pytest
from rclpy.qos import qos_profile_sensor_data
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from node_runner import LATCHED
from quad_bringup.examples.walk import GROUND_TRUTH
from quad_description import LEGS, Pose, pose_positions
from quad_msgs.srv import SetMode

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario

STARTING = 60.0  # [s] until all is ready on a busy machine
MOVING = 60.0  # [s] for a mode to be reached
WAY_DOWN = 6.0  # [s]
STALLS = 5  # how often a machine that stalls may end its way up


def tree(messages: Sequence[TFMessage]) -> dict[str, str]:
    """Return the parent of each frame."""
    return {
        each.child_frame_id: each.header.frame_id
        for message in messages
        for each in message.transforms
    }


def expected_tree() -> dict[str, str]:
    """Return the article's frames: the parent of each."""
    legs = {
        f'{leg}_{part}': f'{leg}_{above}' if above else 'base_link'
        for leg in LEGS
        for part, above in (('hip', ''), ('thigh', 'hip'), ('calf', 'thigh'), ('foot', 'calf'))
    }
    body = {'base_link': 'odom', 'base_footprint': 'base_link', 'imu_link': 'base_link'}
    return body | legs


def test_a_robot_on_its_way_down_arrives_before_its_processes_end(
    isolation: Isolation, tmp_path: Path
) -> None:
    """The controller ends lying, and an observer sees joints and body there; physics ends last."""
    slow = tmp_path / 'slow.yaml'  # the bring-up takes a second or two to join ROS
    slow.write_text(f'/controller_node:\n  ros__parameters:\n    blend_time: {WAY_DOWN}\n')
    arguments = ['ros2', 'run', 'quad_bringup', 'bringup', '--simulate']
    arguments += ['--ros-args', '--params-file', str(slow)]
    with (
        RosClient(isolation.domain_id) as client,
        RunningProcess(arguments, isolation.env) as bringup,
    ):
        joints = client.listen(JointState, '/joint_states', qos_profile_sensor_data)
        truth = client.listen(Odometry, GROUND_TRUTH, qos_profile_sensor_data)
        states = client.listen(String, '/controller_node/state', LATCHED)
        moving = client.listen(TFMessage, '/tf', 100)
        static = client.listen(TFMessage, '/tf_static', LATCHED)

        def height() -> float:
            return float(truth[-1].pose.pose.position.z)

        def reach(*ends: str) -> str:
            client.spin_until(lambda: bool(states) and states[-1].data in ends, MOVING, ends[0])
            return str(states[-1].data)

        def ask(mode: str) -> None:
            assert client.call(SetMode, '/set_mode', SetMode.Request(mode=mode)).success

        bringup.wait_for('all is ready', STARTING)
        client.spin_until(lambda: bool(truth and joints), STARTING, 'robot')
        wanted = expected_tree().items()
        client.spin_until(
            lambda: wanted <= tree([*moving, *static]).items(), STARTING, 'the frames'
        )
        low = height()
        for _ in range(STALLS):
            ask('stand')
            if reach('stand', 'fault') == 'stand':
                break
            assert client.trigger('/controller_node/clear_fault').success
            reach('lie', 'relax')
        high = height()
        ask('lie')
        reach('to lie')
        client.spin_until(lambda: high - height() > 0.2 * (high - low), MOVING, 'way down')
        assert states[-1].data == 'to lie'
        bringup.signal(signal.SIGINT)
        client.spin_until(lambda: not bringup.is_running(), MOVING, 'end')
        assert bringup.wait() == 0, bringup.output
        assert states[-1].data == 'lie', 'the controller was ended on the way'
        lying = [pose_positions(Pose.LIE)[name] for name in joints[-1].name]
        assert list(joints[-1].position) == pytest.approx(lying, abs=0.15)
        assert height() == pytest.approx(low, abs=0.01)

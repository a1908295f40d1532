# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node as a process, over DDS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TYPE_CHECKING

from processes import executable, RunningProcess
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile
from ros_client import RosClient
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf_robots import ARM, POSITIONS

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = pytest.mark.scenario

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SMALL = '<robot name="small"><link name="a"/><link name="b"/>{}</robot>'
FIXED = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'

StartNode = Callable[..., RunningProcess]


@pytest.fixture
def start(isolation: Isolation) -> Iterator[StartNode]:
    """Start the node with arguments."""
    running = []

    def start_node(*arguments: str) -> RunningProcess:
        command = [executable('robot_viewer', 'robot_state_publisher'), *arguments]
        running.append(RunningProcess(command, isolation.env))
        return running[-1]

    yield start_node
    for process in running:
        process.__exit__(None, None, None)


@pytest.fixture
def urdf(tmp_path: Path) -> Path:
    """Write the test arm to a file."""
    file = tmp_path / 'arm.urdf'
    file.write_text(ARM)
    return file


def frames(messages: list[TFMessage]) -> dict[str, Any]:
    """Return the last transform of each child frame."""
    return {each.child_frame_id: each for message in messages for each in message.transforms}


def set_parameter(client: RosClient, **values: str) -> Any:
    """Set string parameters of the node; return the first result."""
    parameters = [
        Parameter(
            name=name,
            value=ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value),
        )
        for name, value in values.items()
    ]
    request = SetParameters.Request(parameters=parameters)
    service = '/robot_state_publisher/set_parameters'
    return client.call(SetParameters, service, request).results[0]


def test_a_viewer_gets_description_fixed_and_moving_frames(
    start: StartNode, isolation: Isolation, urdf: Path
) -> None:
    """Latched for who comes late; a new description replaces the old one, a wrong one does not."""
    node = start(str(urdf), '--ros-args', '-p', 'publish_frequency:=100.0')
    node.wait_for('publishing 2 fixed and 5 moving frames')
    node.wait_until_ready()
    with RosClient(isolation.domain_id) as client:
        descriptions = client.listen(String, 'robot_description', LATCHED)
        static = client.listen(TFMessage, '/tf_static', LATCHED)
        moving = client.listen(TFMessage, '/tf', 100)
        publisher = client.node.create_publisher(JointState, 'joint_states', 10)
        message = JointState(name=list(POSITIONS), position=list(POSITIONS.values()))
        message.header.stamp.sec = 7

        def arrives() -> bool:
            publisher.publish(message)  # until the node has found the publisher
            return bool(moving)

        client.spin_until(lambda: bool(descriptions and static), 20.0, 'latched messages')
        client.spin_until(arrives, 20.0, '/tf')
        assert descriptions[0].data == ARM
        assert set(frames(static)) == {'camera', 'plate'}
        found = frames(moving)
        assert set(found) == {'upper', 'slider', 'wheel', 'finger', 'thumb'}
        assert found['upper'].header.frame_id == 'base'
        assert found['upper'].header.stamp.sec == 7
        assert found['thumb'].transform.translation.y == pytest.approx(0.3)

        refused = set_parameter(client, robot_description=SMALL.format(''))
        assert not refused.successful
        assert 'exactly one link must have no parent' in refused.reason
        assert set_parameter(client, robot_description=SMALL.format(FIXED)).successful
        client.spin_until(lambda: 'b' in frames(static), 20.0, 'the new description')
        assert set_parameter(client, frame_prefix='dog/').successful
        client.spin_until(lambda: 'dog/b' in frames(static), 20.0, 'the prefix')
    assert node.stop() == 0


@pytest.mark.parametrize(
    ('arguments', 'words'),
    [
        (['/nowhere.urdf'], 'nowhere.urdf.*No such file'),
        (['{broken}'], r'broken\.urdf: .*no <link>'),
    ],
    ids=['no file', 'broken file'],
)
def test_what_cannot_work_ends_at_once_with_the_reason(
    start: StartNode, tmp_path: Path, arguments: list[str], words: str
) -> None:
    """Exit code 1, one line, no traceback."""
    broken = tmp_path / 'broken.urdf'
    broken.write_text('<robot/>')
    node = start(*(word.format(broken=broken) for word in arguments))
    node.wait_for(words)
    assert node.wait() == 1
    assert 'Traceback' not in node.output

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node over DDS: a robot that follows at once, and a person who asks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
import math
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Twist, TwistStamped
from processes import RunningProcess
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.duration import Duration
from ros_client import RosClient
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64, String

from node_runner import LATCHED
from quad_controller.recording import run as replay_policy
from quad_description import quadruped, robot_urdf
from quad_gait_rig import joined, metadata, write_policy
from quad_msgs.msg import JointCommand
from quad_msgs.srv import LoadPolicy, SetMode

if TYPE_CHECKING:
    from isolation import Isolation
    from rclpy.publisher import Publisher
    from rclpy.timer import Timer

pytestmark = pytest.mark.slow

NODE = [sys.executable, '-m', 'quad_controller.nodes.controller_node', '--ros-args']
ROBOT = quadruped(robot_urdf())
PERIOD = 0.02  # [s]
FOLDED = [0.0, 1.4, -1.0] * 4


class Robot:
    """Joints that go to their targets, published as a hardware node does.

    Attributes:
        names: Under which the joints are published.
        late: By how much their stamps are in the past [s]; None for none.
        largest_speed: The largest speed of a target so far in [rad/s].
    """

    def __init__(self, client: RosClient, process: RunningProcess) -> None:
        """Join the graph of the node's process; joint states come with :meth:`begin`."""
        self.client, self.process = client, process
        node = client.node
        self.positions = list(FOLDED)
        self.names = list(ROBOT.names)
        self.late: float | None = None
        self.largest_speed, self._stamp = 0.0, 0.0
        self._joints = node.create_publisher(JointState, 'joint_states', 10)
        self._imu = node.create_publisher(Imu, 'imu', 10)
        self.twist = node.create_publisher(Twist, 'cmd_vel', 1)
        self.commands: list[Any] = []
        node.create_subscription(JointCommand, 'joint_command', self._follow, 1)
        self.states = client.listen(String, 'controller_node/state', LATCHED)
        self.diagnostics = client.listen(DiagnosticArray, '/diagnostics', 50)

    def begin(self) -> None:
        """Publish joints and attitude at 50 Hz from now on, and wait until the node has all."""
        self.client.node.create_timer(PERIOD, self._publish)
        self.client.spin_until(
            lambda: bool(self.commands) and any('ready' in line for line in self.process.lines),
            20.0,
            'readiness',
        )

    def _publish(self) -> None:
        imu = Imu()
        imu.orientation.w, imu.linear_acceleration.z = 1.0, 9.81
        if self.late is not None:
            now = self.client.node.get_clock().now()
            imu.header.stamp = (now - Duration(seconds=self.late)).to_msg()
        self._imu.publish(imu)
        still = [0.0] * len(self.names)
        joints = JointState(name=self.names, position=self.positions, velocity=still)
        joints.header = imu.header
        self._joints.publish(joints)

    def _follow(self, message: Any) -> None:
        stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec
        # a message may be lost on the way when the machine is busy: speeds, and not steps
        interval = max(stamp - self._stamp, PERIOD)
        steps = [abs(a - b) for a, b in zip(message.position, self.positions, strict=True)]
        self.largest_speed = max(self.largest_speed, max(steps) / interval)
        self._stamp = stamp
        self.positions = list(message.position)
        self.commands.append(message)

    def walk(self, stamped: Publisher | None = None) -> Timer:
        """Stand up and walk from now on; return what sends velocities when it steps."""
        self.enter('walk')
        message, before = TwistStamped(), list(self.positions)
        message.twist.linear.x = 0.2
        publish = partial(stamped.publish, message) if stamped else partial(
            self.twist.publish, message.twist
        )  # fmt: skip
        timer = self.client.node.create_timer(0.1, publish)

        def steps() -> bool:
            pairs = zip(self.positions, before, strict=True)
            return bool(max(abs(a - b) for a, b in pairs) > 0.2)

        self.client.spin_until(steps, 20.0, 'steps')
        return timer

    def mode(self, mode: str) -> Any:
        """Ask for a mode."""
        return self.client.call(SetMode, 'set_mode', SetMode.Request(mode=mode))

    def load(self, path: str) -> Any:
        """Ask for another policy."""
        request = LoadPolicy.Request(path=path)
        return self.client.call(LoadPolicy, 'controller_node/load_policy', request)

    def tune(self, **values: float) -> Any:
        """Set parameters of the node."""
        request = SetParameters.Request()
        for name, number in values.items():
            value = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=number)
            request.parameters.append(Parameter(name=name, value=value))
        service = 'controller_node/set_parameters'
        return self.client.call(SetParameters, service, request).results[0]

    def enter(self, mode: str) -> None:
        """Ask for a mode, and wait until it is reached."""
        assert self.mode(mode).success
        self.until_state(mode)

    def until_state(self, state: str) -> None:
        """Wait for a state."""
        self.client.spin_until(
            lambda: bool(self.states) and self.states[-1].data == state, 20.0, f'state {state}'
        )


@contextmanager
def running(isolation: Isolation, *parameters: str) -> Iterator[Robot]:
    """Start the node with parameters, and a robot for it."""
    command = [*NODE, *(word for each in parameters for word in ('-p', each))]
    with (
        RunningProcess(command, isolation.env) as process,
        RosClient(isolation.domain_id) as client,
    ):
        process.wait_for('waiting for joint_states')
        yield Robot(client, process)


@pytest.fixture
def robot(isolation: Isolation) -> Iterator[Robot]:
    """Start the node and a robot for it."""
    with running(isolation) as robot:
        yield robot


def test_stop_ends_a_walk_while_velocities_come(robot: Robot, isolation: Isolation) -> None:
    """The service that STOP of every view calls; the robot stands.

    cmd_vel is served as TwistStamped, too, as Nav2 publishes it: without a remap, and beside a
    publisher of Twist.
    """
    robot.begin()
    with RosClient(isolation.domain_id) as nav2:
        robot.walk(nav2.node.create_publisher(TwistStamped, 'cmd_vel', 1))
        answer = robot.client.trigger('stop')
        assert (answer.success, answer.message) == (True, 'stopped: walk; the mode is stand')
        robot.until_state('stand')


def test_a_bridge_that_is_late_by_its_stamps_stops_the_walk(robot: Robot) -> None:
    """Its messages arrive at their rate, and no target moves on by what they say."""
    robot.late = 0.0
    robot.begin()
    robot.walk()
    robot.late = 0.3
    robot.client.spin_until(
        lambda: len({tuple(each.position) for each in robot.commands[-25:]}) == 1, 20.0, 'a stop'
    )
    robot.client.spin_until(
        lambda: any('ms old' in each.message for each in robot.diagnostics[-1].status),
        20.0,
        'a warning',
    )


@pytest.mark.parametrize('late', [3600.0, -3600.0])
def test_a_bridge_with_another_clock_walks_and_is_reported(robot: Robot, late: float) -> None:
    """An hour off, either way: ages count from arrival, and the log says so once for a topic."""
    robot.late = late
    robot.begin()
    robot.walk()
    for topic in ('/joint_states', '/imu'):
        text = f'the clocks of {topic} and of this computer differ by '
        found = [line.partition(text)[2] for line in robot.process.lines if text in line]
        assert len(found) == 1
        assert float(found[0].split()[0]) == pytest.approx(late, abs=5.0)
        assert found[0].endswith('s; ages count from arrival')


def test_from_lying_to_walking_and_back(robot: Robot) -> None:
    """Services and topics lead through the modes; commands do not jump."""
    answer = robot.mode('walk')
    assert not answer.success
    assert '/joint_states' in answer.message
    robot.begin()
    assert list(robot.commands[0].position) == pytest.approx(FOLDED, abs=1e-6)
    assert 'gait:crawl' in robot.mode('dance').message
    assert not robot.tune(nominal_height=0.9).successful
    assert 'do not reach' in robot.tune(nominal_height=0.2).reason
    assert robot.tune(swing_height=0.025).successful
    robot.enter('stand')
    node = robot.client.node
    timer = robot.walk(node.create_publisher(TwistStamped, 'cmd_vel_stamped', 1))
    assert 'not in walk' in robot.tune(swing_height=0.02).reason
    node.destroy_timer(timer)
    bad = Twist()
    bad.linear.x = math.nan
    robot.twist.publish(bad)
    robot.process.wait_for('it is not finite')
    robot.enter('lie')
    # the speed limit of the joints is 10 rad/s, and the time between two steps is not exact
    assert robot.largest_speed < 20.0
    figures = {
        value.key: value.value
        for status in robot.diagnostics[-1].status
        if status.name == 'controller_node: loop'
        for value in status.values
    }
    assert float(figures['feedback_to_command_p50']) > 0.0


def test_a_shipped_policy_is_found_checked_watched_and_recorded(
    isolation: Isolation, tmp_path: Path
) -> None:
    """By its name it is loaded; in a dry run its answers are published beside the commands.

    The recording has them, and replay_policy finds the same ones.
    """
    words = 'policy:=trot_ppo', 'policy_dry_run:=true', f'record:={tmp_path}'
    with running(isolation, *words) as robot:
        reports = robot.client.listen(String, 'controller_node/policy', LATCHED)
        shadows = robot.client.listen(JointCommand, 'joint_command_shadow', 1)
        robot.begin()
        robot.client.spin_until(lambda: bool(shadows and reports), 20.0, 'shadow commands')
        assert 'sha256' in reports[0].data
        assert 'dry run' in robot.mode('policy').message
        robot.process.stop()
    (recording,) = tmp_path.iterdir()
    assert replay_policy([str(recording)]) == 0


def test_a_policy_that_does_not_fit_leaves_the_gait(isolation: Isolation, tmp_path: Path) -> None:
    """A renamed joint is named in the table and in the answer; the robot still walks."""
    names = joined(['fl_hip', *ROBOT.names[1:]])
    path = write_policy(tmp_path / 'renamed.onnx', metadata(joint_names=names))
    with running(isolation, f'policy:={path}') as robot:
        robot.process.wait_for('not in the robot: fl_hip')
        robot.begin()
        assert 'not in the robot: fl_hip' in robot.mode('policy').message
        robot.enter('stand')


def test_another_policy_is_loaded_while_it_walks(robot: Robot, tmp_path: Path) -> None:
    """Checked as at the start and refused in the same words; then it takes over, and leaves."""
    names = joined(['fl_hip', *ROBOT.names[1:]])
    # before the robot lives: it is silent as long as this process writes
    renamed = write_policy(tmp_path / 'renamed.onnx', metadata(joint_names=names))
    still = write_policy(tmp_path / 'still.onnx', metadata())
    reports = robot.client.listen(String, 'controller_node/policy', LATCHED)
    inexact = robot.client.node.create_publisher(Float64, 'joint_velocity_error', LATCHED)
    inexact.publish(Float64(data=0.5))
    robot.begin()
    robot.enter('walk')
    assert 'neither a file nor shipped' in robot.load('no_such').message
    assert 'not in the robot: fl_hip' in robot.load(str(renamed)).message
    answer = robot.load(str(still))
    assert answer.success, answer.message
    assert 'stands, then follows still.onnx; sha256 ' in answer.message
    robot.until_state('policy')
    robot.process.wait_for('error of 0.50 rad/s rms, and nothing says with what noise')
    robot.client.spin_until(lambda: bool(reports), 20.0, 'the report')
    assert answer.message.rpartition(' ')[2] in reports[-1].data
    assert robot.load('gait').message == 'stands, then follows the gait'
    robot.until_state('walk')
    robot.client.spin_until(lambda: 'no policy' in reports[-1].data, 20.0, 'the report')
    assert 'no policy is loaded' in robot.mode('policy').message


def test_a_missing_joint_is_a_fault_that_is_cleared_by_its_service(robot: Robot) -> None:
    """A robot whose reports lack a joint is held, and the joint named; then it can be cleared."""
    robot.begin()
    robot.enter('stand')
    robot.names[0] = 'somebody_else'
    robot.until_state('fault')
    robot.process.wait_for('holding the last targets')
    robot.process.wait_for('fault, joint states: joint states without fl_hip_joint')
    assert not robot.client.trigger('controller_node/clear_fault').success
    robot.names[0] = ROBOT.names[0]
    robot.client.spin_until(
        lambda: robot.client.trigger('controller_node/clear_fault').success, 20.0, 'clearing'
    )
    robot.until_state('relax')

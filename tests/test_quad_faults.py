# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Processes of the quadruped die or get nonsense while it walks: nothing jumps."""

from __future__ import annotations

from collections.abc import Iterator
import signal
import time
from typing import TYPE_CHECKING

from isolation import reserve
from nav_msgs.msg import Odometry
from processes import RunningProcess
import pytest
from rclpy.qos import qos_profile_sensor_data
from ros_client import RosClient
from sensor_msgs.msg import JointState
from simulated_quad import LEANING, SimulatedQuad, UPRIGHT
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from node_runner import LATCHED
from quad_bringup.walk import GROUND_TRUTH
from quad_description import LEGS, Pose, pose_positions, quadruped, raised_feet, robot_urdf
from quad_msgs.msg import JointCommand
from quad_msgs.srv import SetMode

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from isolation import Isolation


pytestmark = pytest.mark.scenario

LARGEST_STEP = 29.0
"""Degrees between two commands to a servo. The controller lets set-points go at 10 rad/s: 11.5 in
a period, 17.2 in one that is late, and two commands may come out as one. A trot needs that speed:
its set-points are ahead of soft servos, at 13 a period where those of firm ones have 10."""
RESUMED = 6.0
"""Degrees between two commands when a new controller takes over where the joints are: the bridge
begins at 2 rad/s."""
TRIES = 20
"""How often a trot is stopped until a foot is in the air; it is in two of three."""


@pytest.fixture(scope='module')
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedQuad]:
    """Start a quadruped with a listener on its serial line, for all tests of this module."""
    folder = tmp_path_factory.mktemp('quad')
    with reserve() as isolation, SimulatedQuad(isolation, folder) as quad:
        yield quad


@pytest.fixture
def quad(processes: SimulatedQuad) -> SimulatedQuad:
    """Let it stand, whatever a test before has left; what was on the wire is forgotten."""
    processes.start_ended()
    processes.clear_fault()
    processes.stand()
    processes.tap.forget()
    return processes


def freeze_in_mid_trot(quad: SimulatedQuad) -> None:
    """Stop the controller (SIGSTOP) while its last targets have a foot in the air."""
    commands = quad.client.listen(JointCommand, '/joint_command')
    robot = quadruped(robot_urdf())
    controller = quad.processes['controller']
    for _ in range(TRIES):
        if quad.state != 'walk':
            quad.clear_fault()
            quad.stand()
            quad.set_mode('walk')
        quad.walk(1.0)
        controller.signal(signal.SIGSTOP)
        quad.spin(0.1)  # what it sent before arrives
        if raised_feet(robot.feet(commands[-1].position)):
            return
        controller.signal(signal.SIGCONT)
    raise AssertionError(f'all feet stood, {TRIES} times')


def kill(quad: SimulatedQuad, name: str) -> float:
    """Kill a process; return when, in steady time [s]."""
    quad.processes[name].signal(signal.SIGKILL)
    quad.processes[name].wait()
    return time.monotonic()


def wait_until_lying(quad: SimulatedQuad) -> None:
    """Wait until the joints are those of a robot that lies: a busy machine takes longer."""
    lying = pose_positions(Pose.LIE)

    def lies() -> bool:
        joints = quad.joints[-1]
        wanted = [lying[name] for name in joints.name]
        return bool(list(joints.position) == pytest.approx(wanted, abs=0.15))

    quad.client.spin_until(lies, 20.0, 'lying')


def check_upright(quad: SimulatedQuad, most: float = UPRIGHT) -> None:
    """The robot stands, and no servo ever got a target that jumps."""
    assert quad.tilt < most
    assert quad.tap.largest_step() < LARGEST_STEP


def test_a_controller_killed_in_mid_trot_leaves_no_leg_in_the_air(quad: SimulatedQuad) -> None:
    """The bridge folds the legs and says so; a new controller moves nothing until it is asked."""
    freeze_in_mid_trot(quad)
    killed = kill(quad, 'controller')
    quad.processes['hardware'].wait_for('commands broke off')
    wait_until_lying(quad)
    quad.spin(0.5)  # its last targets
    check_upright(quad)
    count = len(quad.tap.targets)
    stray = quad.client.node.create_publisher(JointCommand, '/joint_command', 1)
    standing = [pose_positions(Pose.STAND)[name] for name in quad.joints[-1].name]
    goes_on = quad.client.node.create_timer(
        0.02, lambda: stray.publish(JointCommand(position=standing))
    )
    quad.spin(0.5)  # commands that were only held up raise no robot, either
    quad.processes['hardware'].wait_for('the robot was laid down, and ')
    quad.client.node.destroy_timer(goes_on)
    quad.spin(0.1)  # a call of the timer may wait in the executor
    quad.client.node.destroy_publisher(stray)
    assert len(quad.tap.targets) == count
    quad.start('controller')
    quad.spin(0.5)
    assert quad.tap.largest_step(since=killed) < RESUMED
    quad.stand()
    check_upright(quad)


def test_a_killed_bridge_is_reported_and_its_successor_goes_on_smoothly(
    quad: SimulatedQuad,
) -> None:
    """The controller stops by itself; after the fault is cleared it walks again."""
    quad.set_mode('walk')
    quad.walk(1.5)
    killed = kill(quad, 'hardware')
    quad.processes['controller'].wait_for('fault, .*joint states')
    quad.start('hardware')
    quad.spin(1.0)
    check_upright(quad, LEANING)
    quad.clear_fault()
    quad.stand()
    assert quad.tap.largest_step(since=killed) < LARGEST_STEP
    quad.set_mode('walk')
    quad.walk(1.0)
    check_upright(quad)


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

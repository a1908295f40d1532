# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An arm's drives and their master as real processes, also with the motion core in the master."""

from __future__ import annotations

from contextlib import ExitStack
import json
from pathlib import Path
import time
from typing import Any, TYPE_CHECKING

from action_msgs.msg import GoalStatus
from ament_index_python.packages import get_package_share_directory
from canopen_interfaces.srv import COTargetDouble
from control_msgs.action import FollowJointTrajectory
from processes import executable, RunningProcess
from ros_client import RosClient
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_bringup.robots import expand_xacro
from arm_msgs.srv import InjectFault

if TYPE_CHECKING:
    from collections.abc import Sequence

    from isolation import Isolation
    from rclpy.action.client import ActionClient
    from typing_extensions import Self

JOINTS = [f'panda_joint{number}' for number in range(1, 8)]


def panda_bus() -> Path:
    """Return the bus.yml of the installed robot."""
    return Path(get_package_share_directory('arm_bringup')) / 'robots' / 'panda' / 'bus.yml'


class SimulatedArm:
    """Slaves, master and a client; by default the Panda's.

    Attributes:
        joints: Names of the drives.
        slaves: Process of the simulated drives.
        master: Process of the master.
        client: A ROS node of the test.
    """

    def __init__(
        self,
        isolation: Isolation,
        bus_config: Path | None = None,
        joints: Sequence[str] = JOINTS,
        master_arguments: Sequence[str] = (),
    ) -> None:
        self.joints = list(joints)
        self._isolation = isolation
        self._bus_config = bus_config or panda_bus()
        self._stack = ExitStack()
        try:
            self.client = self._stack.enter_context(RosClient(isolation.domain_id))
            self.slaves = self.start('fake_slaves')
            self.master = self.start('master', *master_arguments)
            self.master.wait_until_ready()
        except BaseException:
            self._stack.close()
            raise

    def start(self, name: str, *arguments: str) -> RunningProcess:
        """Start an executable of arm_canopen on the bus; it ends with the arm."""
        command = [
            executable('arm_canopen', name),
            '--ros-args',
            *('-p', f'bus_config:={self._bus_config}'),
            *('-p', f'can_interface_name:={self._isolation.bus}'),
            *arguments,
        ]
        return self._stack.enter_context(RunningProcess(command, self._isolation.env))

    def run(self, *command: str) -> RunningProcess:
        """Start any command in the environment of the arm, as from a second terminal."""
        return self._stack.enter_context(RunningProcess(command, self._isolation.env))

    def inject(self, joint: str, fault: str) -> None:
        """Inject a fault into a simulated drive; ``none`` ends them."""
        request = InjectFault.Request(fault=fault)
        answer = self.client.call(InjectFault, f'/fake_slaves/{joint}/fault', request)
        assert answer.success, answer.message

    def send_target(self, joint: str, target: float) -> COTargetDouble.Response:
        """Command a single target."""
        request = COTargetDouble.Request(target=target)
        return self.client.call(COTargetDouble, f'/{joint}/target', request)

    def init_all(self) -> float:
        """Initialise all joints at the same time; return how long that took in [s]."""
        clients = [self.client.client_of(Trigger, f'/{joint}/init', 20.0) for joint in self.joints]
        begin = time.monotonic()
        futures = [client.call_async(Trigger.Request()) for client in clients]
        self.client.spin_until(lambda: all(f.done() for f in futures), 20.0, 'init of all joints')
        duration = time.monotonic() - begin
        for future in futures:
            assert future.result().success, future.result().message
        return duration

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop all processes, the last started first."""
        self._stack.close()


READY = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
"""A pose of the Panda from which it can move in every direction in [rad]."""

CONTROLLER = '/panda_arm_controller'


def robot_parameters(folder: Path, semantic: str = '') -> Path:
    """Write what describes the Panda as a parameter file.

    Args:
        folder: Where to.
        semantic: What is to stand in its SRDF besides.
    """
    robot = Path(get_package_share_directory('arm_bringup')) / 'robots' / 'panda'
    srdf = (robot / 'panda.srdf').read_text(encoding='utf-8')
    values = {
        'robot_description': expand_xacro(robot / 'panda.urdf.xacro'),
        'robot_description_semantic': srdf.replace('</robot>', f'{semantic}</robot>'),
        'joint_limits': str(robot / 'limits.yaml'),
    }
    path = folder / 'panda.json'  # JSON is YAML
    path.write_text(json.dumps({'/**': {'ros__parameters': values}}), encoding='utf-8')
    return path


class MovingArm(SimulatedArm):
    """The Panda's drives and ``motion_master``, whose drives follow from :meth:`follow` on."""

    def __init__(
        self, isolation: Isolation, folder: Path, *arguments: str, bus: Path | None = None
    ) -> None:
        """Start the processes and wait until all drives are booted; by default the Panda's bus."""
        self._parameters = robot_parameters(folder)
        self._extra = arguments
        super().__init__(isolation, bus)

    def start(self, name: str, *arguments: str) -> RunningProcess:
        """Start an executable; the master is the one with the motion core."""
        if name != 'master':
            return super().start(name, *arguments)
        command = [
            executable('arm_servo', 'motion_master'),
            '--ros-args',
            *('-p', f'bus_config:={self._bus_config}'),
            *('-p', f'can_interface_name:={self._isolation.bus}'),
            *('--params-file', str(self._parameters)),
            *self._extra,
            *arguments,
        ]
        return self.run(*command)

    def follow(self) -> None:
        """Enable all drives in cyclic position mode."""
        self.init_all()
        for joint in self.joints:
            answer = self.client.trigger(f'/{joint}/cyclic_position_mode')
            assert answer.success, answer.message

    def send(self, goal: FollowJointTrajectory.Goal) -> GoalRun:
        """Send a goal; it is accepted."""
        return GoalRun(self.client, goal)

    def reach(self, positions: Sequence[float], seconds: float) -> None:
        """Go to a pose in [rad]."""
        reach(self.client, goal_to(positions, seconds))


def trajectory_client(client: RosClient, controller: str = CONTROLLER) -> ActionClient:
    """Return the client of a trajectory controller."""
    return client.action(FollowJointTrajectory, f'{controller}/follow_joint_trajectory')


class GoalRun:
    """A goal of the action on its way."""

    def __init__(
        self, client: RosClient, goal: FollowJointTrajectory.Goal, controller: str = CONTROLLER
    ) -> None:
        self.feedback: list[Any] = []  # what was fed back so far
        self._client = client
        action = trajectory_client(client, controller)
        # not wait_for_server: the client may have joint states to publish meanwhile
        client.spin_until(action.server_is_ready, 20.0, 'the action server')
        sent = action.send_goal_async(goal, lambda message: self.feedback.append(message.feedback))
        client.spin_until(sent.done, 10.0, 'acceptance')
        self._handle = sent.result()
        assert self._handle.accepted
        self._result = self._handle.get_result_async()

    def cancel(self) -> None:
        """Ask it to end."""
        future = self._handle.cancel_goal_async()
        self._client.spin_until(future.done, 10.0, 'answer to the cancel')

    @property
    def done(self) -> bool:
        """Whether it has ended."""
        return bool(self._result.done())

    def wait(self, timeout: float = 60.0) -> tuple[int, FollowJointTrajectory.Result]:
        """Wait for its end; return status and result."""
        self._client.spin_until(self._result.done, timeout, 'end of the goal')
        answer = self._result.result()
        return answer.status, answer.result


def reach(
    client: RosClient, goal: FollowJointTrajectory.Goal, controller: str = CONTROLLER
) -> None:
    """Send a goal, and wait until it is reached."""
    status, result = GoalRun(client, goal, controller).wait()
    assert status == GoalStatus.STATUS_SUCCEEDED, result.error_string


def goal_to(
    positions: Sequence[float], time: float, joints: Sequence[str] = JOINTS
) -> FollowJointTrajectory.Goal:
    """Return a goal with one point.

    Args:
        positions: In [rad].
        time: Its time_from_start in [s].
        joints: Names of the joints.
    """
    point = JointTrajectoryPoint(positions=list(positions))
    point.time_from_start.sec = int(time)
    point.time_from_start.nanosec = round(time % 1.0 * 1e9)
    return FollowJointTrajectory.Goal(
        trajectory=JointTrajectory(joint_names=list(joints), points=[point])
    )

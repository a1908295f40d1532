# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging a simulated arm over DDS: every kind of command, and every refusal with its reason."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

from control_msgs.msg import JointJog, JointTrajectoryControllerState
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistStamped
from moveit_msgs.msg import ServoStatus
from moveit_msgs.srv import ServoCommandType
from moving_arm import CONTROLLER, goal_to, MovingArm, READY
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from simulated_arm import JOINTS
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

if TYPE_CHECKING:
    from pathlib import Path

    from isolation import Isolation

pytestmark = pytest.mark.scenario


class Jogger:
    """Publishes commands again and again until something is seen.

    Attributes:
        states: Messages of the trajectory controller.
        words: Messages of the servo's status.
    """

    def __init__(self, arm: MovingArm) -> None:
        """Advertise and listen."""
        self.arm = arm
        node = arm.client.node
        self._clock = node.get_clock()
        self._publishers = {
            TwistStamped: node.create_publisher(TwistStamped, '/servo_node/delta_twist_cmds', 10),
            JointJog: node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10),
            PoseStamped: node.create_publisher(PoseStamped, '/servo_node/pose_target_cmds', 10),
        }
        self.states = arm.client.listen(
            JointTrajectoryControllerState, f'{CONTROLLER}/controller_state'
        )
        self.words = arm.client.listen(ServoStatus, '/servo_node/status')

    @property
    def at(self) -> list[float]:
        """Positions commanded last."""
        return list(self.states[-1].reference.positions)

    def until(self, message: Any, condition: Callable[[], bool], what: str) -> None:
        """Publish a command at 50 Hz, with fresh stamps, until a condition holds."""
        stamped = message.header.stamp.sec != 0

        def publish() -> None:
            if not stamped:
                message.header.stamp = self._clock.now().to_msg()
            self.publish(message)

        timer = self.arm.client.node.create_timer(0.02, publish)
        try:
            self.arm.client.spin_until(condition, 10.0, f'{what}; {self.last}')
        finally:
            self.arm.client.node.destroy_timer(timer)

    @property
    def last(self) -> str:
        """The last status."""
        return str(self.words[-1].message) if self.words else ''

    def publish(self, message: Any) -> None:
        """Publish a command once, with a stamp of zero."""
        self._publishers[type(message)].publish(message)

    def refused(self, message: Any, words: str) -> None:
        """Publish a command until the status says why it is refused."""

        def reported() -> bool:
            status = self.words[-1]
            return bool(status.code == ServoStatus.INVALID and words in status.message)

        before = self.at
        self.until(message, reported, f'refusal with {words!r}')
        assert self.at == pytest.approx(before, abs=1e-9)

    def at_rest(self) -> None:
        """Wait until nothing moves."""
        self.arm.client.spin_until(
            lambda: not any(self.states[-1].reference.velocities) and self.last == 'ready',
            10.0,
            'rest',
        )


def twist(frame: str, **linear: float) -> TwistStamped:
    """Return a twist."""
    message = TwistStamped()
    message.header.frame_id = frame
    for axis, value in linear.items():
        setattr(message.twist.linear, axis, value)
    return message


def test_an_arm_is_jogged_in_every_way(isolation: Isolation, tmp_path: Path) -> None:
    """Twists in links and TF frames, joints, displacements, poses; refusals, pause, time-out."""
    with MovingArm(isolation, tmp_path) as arm:
        arm.follow()
        arm.reach(READY, 2.0)
        jogger = Jogger(arm)
        arm.client.spin_until(lambda: bool(jogger.words and jogger.states), 10.0, 'status')
        _jogs(jogger)
        _refuses_what_is_wrong(jogger)
        _is_switched_and_paused(jogger)
        _takes_over_from_a_trajectory(jogger)


def _jogs(jogger: Jogger) -> None:
    begin = jogger.at
    jogger.until(
        twist('panda_link0', z=-0.5), lambda: abs(jogger.at[3] - begin[3]) > 0.02, 'motion'
    )
    jogger.at_rest()  # by the time-out, without a stop
    first = jogger.at[0]
    jog = JointJog(joint_names=['panda_joint1'], velocities=[0.5])
    jogger.until(jog, lambda: jogger.at[0] > first + 0.05, 'joint motion')
    jogger.at_rest()
    first = jogger.at[0]
    step = JointJog(joint_names=['panda_joint1'], displacements=[-0.05])
    jogger.publish(step)
    jogger.arm.client.spin_until(
        lambda: abs(jogger.at[0] - first + 0.05) < 1e-6, 10.0, 'a displacement, exactly'
    )
    jogger.at_rest()
    _frame_of_tf(jogger)
    _pose(jogger)


def _frame_of_tf(jogger: Jogger) -> None:
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = jogger.arm.client.node.create_publisher(TFMessage, '/tf_static', latched)
    table = TransformStamped(child_frame_id='table')
    table.header.frame_id = 'panda_link0'
    table.transform.rotation.z = table.transform.rotation.w = 0.5**0.5  # x of the table is y here
    publisher.publish(TFMessage(transforms=[table]))
    first = jogger.at[0]
    jogger.until(twist('table', x=0.5), lambda: jogger.at[0] > first + 0.02, 'motion to the left')
    jogger.at_rest()


def _pose(jogger: Jogger) -> None:
    pose = PoseStamped()
    pose.header.frame_id = 'panda_link8'  # ahead of the tool by 5 cm, again and again
    pose.pose.position.z = 0.05
    pose.pose.orientation.w = 1.0
    before = jogger.at
    jogger.until(pose, lambda: abs(jogger.at[3] - before[3]) > 0.01, 'motion to a pose')
    jogger.at_rest()


def _refuses_what_is_wrong(jogger: Jogger) -> None:
    old = twist('panda_link0', x=0.5)
    old.header.stamp.sec = 1000
    pose = PoseStamped()
    pose.pose.orientation.w = 2.0
    jog = JointJog(joint_names=['panda_joint1', 'panda_joint2'], velocities=[0.5])
    jogger.refused(twist('panda_link0', x=float('nan')), 'finite')
    jogger.refused(twist('nowhere', x=0.5), "'nowhere'")
    jogger.refused(old, 'stale')
    jogger.refused(pose, 'length')
    jogger.refused(jog, '2 joint_names, but 1 velocities')
    jogger.refused(JointJog(joint_names=['elbow'], velocities=[0.5]), "'elbow'")
    jogger.refused(JointJog(joint_names=['panda_joint1'], velocities=[float('inf')]), 'finite')
    jogger.refused(JointJog(joint_names=['panda_joint1'], displacements=[9.0]), 'beyond')
    jogger.at_rest()


def _is_switched_and_paused(jogger: Jogger) -> None:
    client = jogger.arm.client
    request = ServoCommandType.Request(command_type=ServoCommandType.Request.JOINT_JOG)
    assert client.call(ServoCommandType, '/servo_node/switch_command_type', request).success
    jogger.refused(twist('panda_link0', x=0.5), 'switch_command_type')
    request = ServoCommandType.Request(command_type=ServoCommandType.Request.TWIST)
    assert client.call(ServoCommandType, '/servo_node/switch_command_type', request).success
    request = ServoCommandType.Request(command_type=7)
    assert not client.call(ServoCommandType, '/servo_node/switch_command_type', request).success
    assert client.call(SetBool, '/servo_node/pause_servo', SetBool.Request(data=True)).success
    jogger.refused(twist('panda_link0', x=0.5), 'paused')
    assert client.call(SetBool, '/servo_node/pause_servo', SetBool.Request(data=False)).success
    for name in ('stop_servo', 'start_servo', 'unpause_servo'):
        assert client.call(Trigger, f'/servo_node/{name}', Trigger.Request()).success
    jogger.at_rest()


def _takes_over_from_a_trajectory(jogger: Jogger) -> None:
    run = jogger.arm.send(goal_to([1.0, *READY[1:]], 5.0))
    jogger.arm.client.spin_until(lambda: len(run.feedback) > 10, 10.0, 'motion')
    jogger.until(twist('panda_link0', z=-0.3), lambda: run.done, 'end of the trajectory')
    assert 'jogging took over' in run.wait()[1].error_string
    jogger.at_rest()
    assert sorted(jogger.states[-1].joint_names) == sorted(JOINTS)

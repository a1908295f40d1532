# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories and jogging on a simulated arm over DDS, and every refusal with its reason."""

from __future__ import annotations

from collections.abc import Callable
import signal
from typing import Any, TYPE_CHECKING

from action_msgs.msg import GoalStatus
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointJog, JointTrajectoryControllerState, SpeedScalingFactor
from control_msgs.srv import QueryTrajectoryState
from controller_manager_msgs.srv import ListControllers, SwitchController
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistStamped
from moveit_msgs.msg import ServoStatus
from moveit_msgs.srv import ServoCommandType
import pytest
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState
from simulated_arm import CONTROLLER, goal_to, JOINTS, MovingArm, READY
from std_srvs.srv import SetBool, Trigger
from tf2_msgs.msg import TFMessage

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from isolation import Isolation


pytestmark = pytest.mark.scenario

Result = FollowJointTrajectory.Result


def test_an_arm_follows_goals_and_is_jogged_and_says_why_not(
    isolation: Isolation, tmp_path: Path
) -> None:
    """Refusals before and after init, a goal to its end, a cancel on the path, a drive lost.

    And twists in links and TF frames, joints, displacements, poses; pause, time-out.
    """
    with MovingArm(isolation, tmp_path) as arm:
        states = arm.client.listen(
            JointTrajectoryControllerState, f'{CONTROLLER}/controller_state'
        )
        _reports_where_it_stands(arm, states)
        _refuses_before_init(arm)
        arm.follow()
        _refuses_what_is_wrong(arm)
        _reaches_a_goal(arm)
        jogger = Jogger(arm)
        arm.client.spin_until(lambda: bool(jogger.words and jogger.states), 10.0, 'status')
        _jogs(jogger)
        _refuses_wrong_commands(jogger)
        _is_switched_and_paused(jogger)
        _takes_over_from_a_trajectory(jogger)
        arm.reach(READY, 3.0)
        _is_listed_and_switched(arm)
        _takes_a_goal_from_the_command_line(arm)
        _cancels_on_the_path(arm)
        _slows_down(arm)
        _names_the_lost_drives(arm)


def _reports_where_it_stands(
    arm: MovingArm, states: Sequence[JointTrajectoryControllerState]
) -> None:
    """Before any command, and before the drives are enabled."""
    arm.client.spin_until(lambda: bool(states), 10.0, 'state of the controller')
    assert list(states[0].reference.positions) == list(states[0].feedback.positions)
    assert not any(states[0].error.positions)
    service = f'{CONTROLLER}/query_state'
    answer = arm.client.call(QueryTrajectoryState, service, QueryTrajectoryState.Request())
    assert answer.success, answer.message
    assert list(answer.position) == pytest.approx(list(states[-1].feedback.positions), abs=1e-3)


def _refuses_before_init(arm: MovingArm) -> None:
    status, result = arm.send(goal_to(READY, 3.0)).wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert result.error_code == Result.INVALID_GOAL
    assert '~/init' in result.error_string
    assert 'panda_joint1' in result.error_string


def _refuses_what_is_wrong(arm: MovingArm) -> None:
    unknown = goal_to(READY, 3.0, ['elbow', *JOINTS[1:]])
    beyond = goal_to([9.0, *READY[1:]], 3.0)
    old = goal_to(READY, 3.0)
    old.trajectory.header.stamp.sec = 1
    nan = goal_to([float('nan'), *READY[1:]], 3.0)
    fast = goal_to(READY, 0.1)
    twice = goal_to(READY, 3.0)
    twice.trajectory.points *= 2
    for goal, code, words in (
        (unknown, Result.INVALID_JOINTS, 'elbow'),
        (beyond, Result.INVALID_GOAL, 'panda_joint1'),
        (old, Result.OLD_HEADER_TIMESTAMP, 'stamp'),
        (nan, Result.INVALID_GOAL, 'nan'),
        (fast, Result.INVALID_GOAL, 'rad/s'),
        (twice, Result.INVALID_GOAL, 'must increase'),
        (goal_to(READY[:3], 3.0), Result.INVALID_GOAL, '3 positions'),
    ):
        status, result = arm.send(goal).wait()
        assert status == GoalStatus.STATUS_ABORTED
        assert result.error_code == code, result.error_string
        assert words in result.error_string


def _reaches_a_goal(arm: MovingArm) -> None:
    run = arm.send(goal_to(READY, 3.0))
    status, result = run.wait()
    assert (status, result.error_code) == (GoalStatus.STATUS_SUCCEEDED, 0), result.error_string
    assert list(run.feedback[-1].joint_names) == JOINTS
    assert list(run.feedback[-1].actual.positions) == pytest.approx(READY, abs=0.02)
    assert len(run.feedback) > 10
    answer = arm.client.call(
        QueryTrajectoryState, f'{CONTROLLER}/query_state', QueryTrajectoryState.Request()
    )
    assert answer.success
    assert list(answer.position) == pytest.approx(READY, abs=1e-3)


def _is_listed_and_switched(arm: MovingArm) -> None:
    states = arm.client.listen(JointState, '/joint_states')
    arm.client.spin_until(lambda: bool(states), 10.0, 'joint states')
    assert list(states[-1].name) == JOINTS
    assert list(states[-1].position) == pytest.approx(READY, abs=0.02)
    listed = arm.client.call(
        ListControllers, '/controller_manager/list_controllers', ListControllers.Request()
    )
    assert {each.name: each.state for each in listed.controller} == {
        'panda_arm_controller': 'active',
        'joint_state_broadcaster': 'active',
    }
    run = arm.send(goal_to([0.5, *READY[1:]], 4.0))
    arm.client.spin_until(lambda: len(run.feedback) > 5, 10.0, 'motion')
    _switch(arm, SwitchController.Request(deactivate_controllers=['panda_arm_controller']))
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert 'deactivated' in result.error_string
    assert 'inactive' in arm.send(goal_to(READY, 2.0)).wait()[1].error_string
    _switch(arm, SwitchController.Request(activate_controllers=['panda_arm_controller']))


def _switch(arm: MovingArm, request: SwitchController.Request) -> None:
    request.strictness = SwitchController.Request.STRICT
    answer = arm.client.call(SwitchController, '/controller_manager/switch_controller', request)
    assert answer.ok, answer.message


def _takes_a_goal_from_the_command_line(arm: MovingArm) -> None:
    numbers = ', '.join(map(str, [0.1, *READY[1:]]))
    goal = (
        f'{{trajectory: {{joint_names: [{", ".join(JOINTS)}], points: [{{positions: [{numbers}],'
        ' time_from_start: {sec: 1}}]}}'
    )
    name = f'{CONTROLLER}/follow_joint_trajectory'
    kind = 'control_msgs/action/FollowJointTrajectory'
    command = arm.run('ros2', 'action', 'send_goal', '--feedback', name, kind, goal)
    assert command.wait(30.0) == 0, command.output
    assert 'status: SUCCEEDED' in command.output
    assert 'Feedback:' in command.output


def _cancels_on_the_path(arm: MovingArm) -> None:
    run = arm.send(goal_to([0.5, *READY[1:]], 2.0))
    arm.client.spin_until(
        lambda: any(f.desired.positions[0] > 0.1 for f in run.feedback), 10.0, 'motion'
    )
    run.cancel()
    status, result = run.wait()
    assert status == GoalStatus.STATUS_CANCELED, result.error_string
    assert 'on the path' in result.error_string


def _slows_down(arm: MovingArm) -> None:
    states = arm.client.listen(JointTrajectoryControllerState, f'{CONTROLLER}/controller_state')
    _scales(arm, states, 0.8, DurabilityPolicy.VOLATILE)
    _scales(arm, states, 0.5, DurabilityPolicy.TRANSIENT_LOCAL)
    run = arm.send(goal_to(READY, 1.0))
    assert run.wait()[0] == GoalStatus.STATUS_SUCCEEDED
    times = [f.header.stamp.sec + 1e-9 * f.header.stamp.nanosec for f in run.feedback]
    assert times[-1] - times[0] > 1.5  # of 2 s
    assert not any('incompatible QoS' in line for line in arm.master.lines)


def _scales(
    arm: MovingArm,
    states: Sequence[JointTrajectoryControllerState],
    factor: float,
    durability: DurabilityPolicy,
) -> None:
    """Set the speed as a controller that latches it does, or a person in a shell."""
    publisher = arm.client.node.create_publisher(
        SpeedScalingFactor,
        f'{CONTROLLER}/speed_scaling_input',
        QoSProfile(depth=1, durability=durability),
    )
    arm.client.spin_until(
        lambda: publisher.get_subscription_count() > 0, 10.0, 'match of the publisher'
    )
    publisher.publish(SpeedScalingFactor(factor=factor))
    arm.client.spin_until(
        lambda: bool(states) and states[-1].speed_scaling_factor == factor, 10.0, f'{factor}'
    )


def _names_the_lost_drives(arm: MovingArm) -> None:
    run = arm.send(goal_to([0.5, *READY[1:]], 4.0))
    arm.client.spin_until(lambda: len(run.feedback) > 5, 10.0, 'motion')
    arm.slaves.signal(signal.SIGKILL)
    status, result = run.wait()
    assert status == GoalStatus.STATUS_ABORTED
    assert 'panda_joint' in result.error_string
    assert result.error_code == Result.INVALID_GOAL
    assert all(name in result.error_string for name in JOINTS)


class Jogger:
    """Publishes commands again and again until something is seen."""

    def __init__(self, arm: MovingArm) -> None:
        self.arm = arm
        node = arm.client.node
        self._clock = node.get_clock()
        self._publishers = {
            TwistStamped: node.create_publisher(TwistStamped, '/servo_node/delta_twist_cmds', 10),
            JointJog: node.create_publisher(JointJog, '/servo_node/delta_joint_cmds', 10),
            PoseStamped: node.create_publisher(PoseStamped, '/servo_node/pose_target_cmds', 10),
        }
        # messages of the trajectory controller
        self.states = arm.client.listen(
            JointTrajectoryControllerState, f'{CONTROLLER}/controller_state'
        )
        # messages of the servo's status
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


def _refuses_wrong_commands(jogger: Jogger) -> None:
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

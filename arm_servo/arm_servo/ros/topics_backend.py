# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Back end for drives in other processes: joint states in, one loop per group, set-points out.

It publishes set-points to another controller, as moveit_servo does.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
import threading
import time

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from arm_model import ModelError, RobotModel
from arm_model.ros import declare_groups, declare_robot, duration_fields
from node_runner import (
    declare_thread_priority,
    LINGER,
    log_defects,
    notify_ready,
    ParameterReader,
    raise_thread_priority,
    settle_process_memory,
    spin,
)
from robot_primitives import setting, switch

from ..controllers.controller import SetPoint
from ..core.gateway import CommandGateway, start_worker
from ..core.motion_core import MotionCore
from ..core.preparation import CoreSettings
from ..motion_thread import (
    FollowingLimits,
    FollowingWatch,
    JointFeedback,
    MotionCycle,
    MotionThread,
)
from .controller_manager import ControllerManager, declare_manager
from .group_motion import (
    build_arm,
    build_groups,
    by_check,
    check_names,
    MakeNode,
    Offers,
    watch_other_programs,
)
from .scene_listener import SceneListener
from .servo_commands import PREFIX

ARRAY_TOPIC = 'forward_position_controller/commands'
"""Default of command_out_topic, as in the examples of ros2_controllers; groups other than the main
one prefix it with their name."""


def serve_topics(stop: threading.Event, offers: Offers) -> None:
    """Run until stopped, then bring the robot to rest."""
    nodes: list[Node] = []
    with ExitStack() as stack:

        def make_node(name: str) -> Node:
            node = Node(name)
            stack.callback(node.destroy_node)
            nodes.append(node)
            return node

        threads = build_motion(make_node, offers)
        check_names(nodes)
        settle_process_memory(nodes[0])
        for thread in threads:
            thread.start(failed=stop.set)
            stack.callback(thread.stop)
        nodes[0].get_logger().info('ready for commands')
        notify_ready()
        survive = log_defects(nodes[0])
        spin(nodes, stop, survive=survive)
        for thread in threads:
            thread.end()
        for thread in threads:
            spin(nodes, thread.ended, linger=LINGER, survive=survive)  # goals get their results
    for thread in threads:
        if thread.error is not None:
            raise thread.error


def build_motion(make_node: MakeNode, offers: Offers) -> Sequence[MotionThread]:
    """Assemble interfaces, cores, feedback and output, without starting them.

    Args:
        make_node: Creates the nodes, which live until the program ends.

    Returns:
        The loop of each group.
    """
    if not offers.trajectories:
        return [_beside_a_controller(make_node('servo_node'))]
    manager = make_node('controller_manager')
    models = declare_groups(manager)
    for note in models.notes:
        manager.get_logger().warning(note)
    main = models.arms[0]
    name, _ = declare_manager(manager, main)

    drives: list[TopicDrives] = []

    def make_gateway(node: Node, model: RobotModel, settings: CoreSettings) -> CommandGateway:
        topic = ARRAY_TOPIC if model is main else f'{model.group}_{ARRAY_TOPIC}'
        drives.append(TopicDrives(node, model, settings, output=(topic, ARRAY)))
        return drives[-1].gateway

    groups = build_groups(models, name, make_node, offers, make_gateway)
    checked, unchecked = by_check(groups)
    SceneListener(manager, checked, unchecked, joint_topic=drives[0].joint_topic)
    entries = [entry for group in groups for entry in group.entries(drives[0].period)]
    ControllerManager(manager, entries)
    nodes = [node for group in groups for node in group.nodes]
    watch_other_programs([manager, *nodes], [each.topic for each in drives])
    return [each.thread for each in drives]


def _beside_a_controller(servo: Node) -> MotionThread:
    """Assemble a servo that jogs the arm of a trajectory controller in another process."""
    model = declare_robot(servo)
    for note in model.notes:
        servo.get_logger().warning(note)
    topic = f'{model.group}_controller/joint_trajectory'

    drives: list[TopicDrives] = []

    def make_gateway(node: Node, model: RobotModel, settings: CoreSettings) -> CommandGateway:
        output = (topic, TRAJECTORY)
        drives.append(TopicDrives(node, model, settings, prefix=PREFIX, output=output))
        return drives[-1].gateway

    build_arm(model, None, servo, make_gateway)
    SceneListener(servo, [drives[0].gateway], joint_topic=drives[0].joint_topic)
    watch_other_programs([servo], [drives[0].topic])
    return drives[0].thread


class TopicDrives:
    """Connects a motion core to drives in another process: joint states in, set-points out."""

    def __init__(
        self,
        node: Node,
        model: RobotModel,
        settings: CoreSettings,
        *,
        prefix: str = '',
        output: tuple[str, str],  # default of topic and type of the set-points
    ) -> None:
        loop, wanted = declare_loop(node, prefix), declare_output(node, prefix, *output)
        self.gateway = CommandGateway(MotionCore(model, settings), start_worker())
        self.period, self.topic, self.joint_topic = (
            loop.publish_period,
            wanted.topic,
            loop.joint_topic,
        )
        feedback = JointFeedback(model.joints, loop.joint_state_timeout)

        def receive(message: JointState) -> None:
            feedback.receive(message.name, message.position, message.velocity, time.monotonic())

        def begin() -> None:
            raise_thread_priority(node, loop.thread_priority, 'the motion loop')

        node.create_subscription(JointState, loop.joint_topic, receive, 10)
        publish = TopicOutput(node, wanted, list(model.joints), loop.publish_period)
        watch = FollowingWatch(model.limits, loop.following, loop.publish_period)
        cycle = MotionCycle(self.gateway, feedback, publish, watch)
        # steps the core; not started yet
        self.thread = MotionThread(cycle, loop.publish_period, begin)


TRAJECTORY = 'trajectory_msgs/JointTrajectory'
ARRAY = 'std_msgs/Float64MultiArray'

THREAD_PRIORITY = 40
"""Default SCHED_FIFO priority of the loop, as in moveit_servo."""


@dataclass(frozen=True, slots=True)
class OutputParameters:
    """Parameters of the published set-points."""

    topic: str  # where to
    kind: str  # :data:`TRAJECTORY` or :data:`ARRAY`
    positions: bool  # positions are in it
    velocities: bool  # velocities are in it
    accelerations: bool  # accelerations are in it; only in trajectories


def declare_output(node: Node, prefix: str, topic: str, kind: str) -> OutputParameters:
    """Declare moveit_servo's parameters of the output.

    Raises:
        ModelError: The type is unknown, or cannot carry the selected fields.
    """
    read = ParameterReader(node, prefix)
    parameters = OutputParameters(
        read.text('command_out_topic', topic, 'where set-points are published'),
        read.text('command_out_type', kind, f'{TRAJECTORY} or {ARRAY}'),
        read.flag('publish_joint_positions', 'positions are in it', default=True),
        read.flag('publish_joint_velocities', 'velocities are in it', default=kind == TRAJECTORY),
        read.flag('publish_joint_accelerations', 'accelerations are in it', default=False),
    )
    if parameters.kind not in {TRAJECTORY, ARRAY}:
        raise ModelError(
            f'{prefix}command_out_type is {parameters.kind!r}: {TRAJECTORY} or {ARRAY}'
        )
    chosen = parameters.positions + parameters.velocities + parameters.accelerations
    if not chosen or (parameters.kind == ARRAY and (chosen > 1 or parameters.accelerations)):
        raise ModelError(
            f'{prefix}publish_joint_...: an array has positions or velocities, a trajectory at'
            ' least one of them'
        )
    return parameters


@dataclass(frozen=True, slots=True)
class LoopParameters:
    """Parameters of the control loop."""

    thread_priority: int  # SCHED_FIFO priority of its thread; 0 is none
    following: FollowingLimits  # when the arm counts as not following
    publish_period: float = setting(0.01, 0.001, 0.1, 'period of the loop [s]')
    joint_topic: str = switch('joint_states', 'topic of the joint states')
    joint_state_timeout: float = setting(
        0.5, 0.02, 10.0, 'silence of a joint at which the arm comes to rest [s]'
    )


def declare_loop(node: Node, prefix: str) -> LoopParameters:
    """Declare the parameters of the control loop."""
    read = ParameterReader(node, prefix)
    return read.settings(
        LoopParameters,
        thread_priority=declare_thread_priority(read, THREAD_PRIORITY),
        following=read.settings(FollowingLimits),
    )


class TopicOutput:
    """Publishes set-points; call it in the thread of the cycle."""

    def __init__(
        self, node: Node, parameters: OutputParameters, joints: list[str], period: float
    ) -> None:
        kind = Float64MultiArray if parameters.kind == ARRAY else JointTrajectory
        self._publisher = node.create_publisher(kind, parameters.topic, 10)
        self._parameters, self._joints = parameters, joints
        self._duration = duration_fields(period)

    def __call__(self, point: SetPoint) -> None:
        """Publish a set-point."""
        wanted, state = self._parameters, point.state
        if wanted.kind == ARRAY:
            values = state.position if wanted.positions else state.velocity
            self._publisher.publish(Float64MultiArray(data=values.tolist()))
            return
        row = JointTrajectoryPoint()
        if wanted.positions:
            row.positions = state.position.tolist()
        if wanted.velocities:
            row.velocities = state.velocity.tolist()
        if wanted.accelerations:
            row.accelerations = state.acceleration.tolist()
        row.time_from_start.sec = self._duration['sec']
        row.time_from_start.nanosec = self._duration['nanosec']
        self._publisher.publish(JointTrajectory(joint_names=self._joints, points=[row]))

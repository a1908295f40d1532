# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The back end for drives elsewhere: joint states in, a loop for each group, set-points out."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
import threading
import time

from rclpy.node import Node
from sensor_msgs.msg import JointState

from arm_model import RobotModel
from arm_model.ros import declare_groups, declare_robot
from node_runner import (
    LINGER,
    log_defects,
    notify_ready,
    raise_thread_priority,
    settle_process_memory,
    spin,
)

from ..core.gateway import CommandGateway, start_worker
from ..core.motion_core import MotionCore
from ..core.preparation import CoreSettings
from ..io.following import FollowingWatch
from ..io.motion_thread import JointFeedback, MotionCycle, MotionThread
from ..io.topic_output import ARRAY, declare_loop, declare_output, TopicOutput, TRAJECTORY
from .controller_manager import ControllerManager, declare_manager
from .group_motion import build_arm, build_groups, by_check, MakeNode, Offers
from .other_programs import watch_other_programs
from .parameter_check import check_names
from .scene_listener import SceneListener
from .servo.parameters import PREFIX

ARRAY_TOPIC = 'forward_position_controller/commands'
"""Default of command_out_topic, the name that ros2_controllers' examples use; that of a group
beside the main one begins with the group's name."""


def serve_topics(stop: threading.Event, offers: Offers) -> None:
    """Move a robot until stopped; it comes to rest before that ends.

    Args:
        stop: Set by Ctrl-C and SIGTERM.
    """
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
    """Put interfaces, cores, feedback and output together; nothing runs yet.

    Args:
        make_node: Makes the nodes; they live until the program ends.

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

    def make_drives(node: Node, model: RobotModel, settings: CoreSettings) -> TopicDrives:
        topic = ARRAY_TOPIC if model is main else f'{model.group}_{ARRAY_TOPIC}'
        drives.append(TopicDrives(node, model, settings, output=(topic, ARRAY)))
        return drives[-1]

    groups = build_groups(models, name, make_node, offers, make_drives)
    checked, unchecked = by_check(groups)
    SceneListener(manager, checked, unchecked, joint_topic=drives[0].joint_topic)
    entries = [entry for group in groups for entry in group.entries(drives[0].period)]
    ControllerManager(manager, entries)
    nodes = [node for group in groups for node in group.nodes]
    watch_other_programs([manager, *nodes], [each.topic for each in drives])
    return [each.thread for each in drives]


def _beside_a_controller(servo: Node) -> MotionThread:
    """Put a servo together that jogs the arm of a trajectory controller elsewhere."""
    model = declare_robot(servo)
    for note in model.notes:
        servo.get_logger().warning(note)
    topic = f'{model.group}_controller/joint_trajectory'

    drives: list[TopicDrives] = []

    def make_drives(node: Node, model: RobotModel, settings: CoreSettings) -> TopicDrives:
        output = (topic, TRAJECTORY)
        drives.append(TopicDrives(node, model, settings, prefix=PREFIX, output=output))
        return drives[-1]

    build_arm(model, None, servo, make_drives)
    SceneListener(servo, [drives[0].gateway], joint_topic=drives[0].joint_topic)
    watch_other_programs([servo], [drives[0].topic])
    return drives[0].thread


class TopicDrives:
    """Drives elsewhere under a core: joint states in, set-points out.

    Attributes:
        thread: Steps the core; not started yet.
    """

    def __init__(
        self,
        node: Node,
        model: RobotModel,
        settings: CoreSettings,
        *,
        prefix: str = '',
        output: tuple[str, str],
    ) -> None:
        """Declare how the loop runs, subscribe and advertise.

        Args:
            output: Default of topic and type of the set-points.
        """
        loop, wanted = declare_loop(node, prefix), declare_output(node, prefix, *output)
        self.gateway = CommandGateway(MotionCore(model, settings), start_worker())
        self.period, self.topic, self.joint_topic = loop.period, wanted.topic, loop.joint_topic
        feedback = JointFeedback(model.joints, loop.joint_timeout)

        def receive(message: JointState) -> None:
            feedback.receive(message.name, message.position, message.velocity, time.monotonic())

        def begin() -> None:
            raise_thread_priority(node, loop.priority, 'the motion loop')

        node.create_subscription(JointState, loop.joint_topic, receive, 10)
        publish = TopicOutput(node, wanted, list(model.joints), loop.period)
        watch = FollowingWatch(model.limits, loop.following, loop.period)
        cycle = MotionCycle(self.gateway, feedback, publish, watch)
        self.thread = MotionThread(cycle, loop.period, begin)

    def prepare(self) -> bool:
        """Return that nothing was got back: the drives stay with their client."""
        return False

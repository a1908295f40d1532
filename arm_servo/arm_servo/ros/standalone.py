# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the programs for drives elsewhere share: feedback in, a thread, set-points out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
import sys
import threading
import time

from rclpy.node import Node
from sensor_msgs.msg import JointState

from arm_model import ArmError, RobotModel
from node_runner import (
    declare_thread_priority,
    LINGER,
    notify_ready,
    ParameterReader,
    raise_thread_priority,
    run_program,
    settle_process_memory,
    spin,
)

from ..core.gateway import CommandGateway, start_worker
from ..core.motion_core import MotionCore
from ..core.settings import CoreSettings
from ..io.following import FollowingLimits, FollowingWatch
from ..io.joint_feedback import JointFeedback
from ..io.motion_thread import MotionCycle, MotionThread
from ..io.topic_output import OutputParameters, TopicOutput
from .upstream_parameters import check_names

SWITCH_INTERVAL = 0.0005
"""How long a busy callback may keep the interpreter from the cycle in [s]."""

THREAD_PRIORITY = 40
"""SCHED_FIFO priority of the loop, unless a parameter says another; that of moveit_servo."""

MakeNode = Callable[[str], Node]
"""Makes the node of a name; it lives until the program ends."""


@dataclass(frozen=True, slots=True)
class LoopParameters:
    """How the loop runs.

    Attributes:
        period: Its period in [s].
        joint_topic: Topic of the joint states.
        joint_timeout: Age at which a joint state counts no more in [s].
        priority: SCHED_FIFO priority of its thread; 0 is none.
        following: When the arm counts as not following.
    """

    period: float
    joint_topic: str
    joint_timeout: float
    priority: int
    following: FollowingLimits


def declare_loop(node: Node, prefix: str) -> LoopParameters:
    """Declare how the loop runs.

    Args:
        node: The node.
        prefix: Before each name, with its dot.
    """
    read = ParameterReader(node, prefix)
    return LoopParameters(
        read.number('publish_period', 0.01, (0.001, 0.1), 'period of the loop [s]'),
        read.text('joint_topic', 'joint_states', 'topic of the joint states'),
        read.number(
            'joint_state_timeout',
            0.5,
            (0.02, 10.0),
            'silence of a joint at which the arm comes to rest [s]',
        ),
        declare_thread_priority(read, THREAD_PRIORITY),
        FollowingLimits(
            read.number(
                'following_error_limit',
                0.2,
                (0.0, 10.0),
                'distance of a joint from where it was sent at which the arm comes to rest [rad];'
                ' 0 is any',
            ),
            read.number(
                'following_delay', 0.2, (0.0, 1.0), 'how late it may be where it was sent [s]'
            ),
        ),
    )


def make_loop(
    node: Node,
    model: RobotModel,
    settings: CoreSettings,
    loop: LoopParameters,
    output: OutputParameters,
) -> tuple[CommandGateway, MotionThread]:
    """Put core, feedback and output together; nothing runs yet.

    Args:
        node: The node that subscribes and publishes.
        model: The arm.
        settings: How the core behaves.
        loop: How the loop runs.
        output: What is published.
    """
    for note in model.notes:
        node.get_logger().warning(note)
    gateway = CommandGateway(MotionCore(model, settings), start_worker())
    feedback = JointFeedback(model.joints, loop.joint_timeout)

    def take(message: JointState) -> None:
        feedback.take(message.name, message.position, message.velocity, time.monotonic())

    node.create_subscription(JointState, loop.joint_topic, take, 10)
    publish = TopicOutput(node, output, list(model.joints), loop.period)
    watch = FollowingWatch(model.limits, loop.following, loop.period)
    cycle = MotionCycle(gateway, feedback, publish, watch)

    def begin() -> None:
        raise_thread_priority(node, loop.priority, 'the motion loop')

    return gateway, MotionThread(cycle, loop.period, begin)


def keep_drives() -> None:
    """Prepare nothing before a motion: whoever has the drives keeps them."""


def run_standalone(
    name: str, build: Callable[[MakeNode], MotionThread], args: Sequence[str] | None
) -> int:
    """Run a program until Ctrl-C or SIGTERM; the arm comes to rest before it ends.

    Args:
        name: Name for the log.
        build: Makes the nodes, by their names, and the thread.
        args: Command line; None for the process's own.

    Returns:
        Exit code: 0, or 1 when the arm cannot be built.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    return run_program(name, lambda stop: _serve(build, stop), ArmError, args=args)


def _serve(build: Callable[[MakeNode], MotionThread], stop: threading.Event) -> None:
    nodes: list[Node] = []
    with ExitStack() as stack:

        def make_node(name: str) -> Node:
            node = Node(name)
            stack.callback(node.destroy_node)
            nodes.append(node)
            return node

        thread = build(make_node)
        for node in nodes:
            check_names(node)
        settle_process_memory(nodes[0])
        thread.start(failed=stop.set)
        stack.callback(thread.stop)
        nodes[0].get_logger().info('ready for commands')
        notify_ready()
        spin(nodes, stop)
        thread.end()
        spin(nodes, thread.ended, linger=LINGER)  # goals get their results
    if thread.error is not None:
        raise thread.error

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of commands: links of the robot, or else frames of TF."""

from __future__ import annotations

import math
import time

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

from ..arrays import checked
from ..exceptions import CommandError
from ..frame_tree import FrameTree
from ..model import RobotModel
from ..pose import Pose, rotation_of
from .numbers import seconds, xyz, xyzw

STATIC_QOS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""How /tf_static is published."""


class TfListener:
    """Listens to TF from the first frame on that is no link of the robot.

    /tf costs a Python node more than the jogging, and few need it.
    """

    def __init__(self, node: Node, model: RobotModel, prefix: str = '') -> None:
        """Do not listen yet.

        Args:
            model: The arm; its links need no TF.
            prefix: Before the names of its links in TF.
        """
        self._node = node
        self._prefix = prefix
        self._base = prefix + model.base
        self._links = frozenset(model.frames)
        self._names = ', '.join(model.frames)
        self._tree: FrameTree | None = None

    def link(self, frame: str) -> str | None:
        """Return the link of the robot that a frame is, with or without its prefix."""
        name = frame.removeprefix(self._prefix)
        return name if name in self._links else None

    def pose(self, frame: str) -> Pose:
        """Return the pose of a frame of TF in the base of the arm.

        Raises:
            CommandError: It is not known, or not yet.
        """
        if self._tree is None:
            self._listen()
        found = self._tree.pose(frame, self._base, time.monotonic()) if self._tree else None
        if found is None:
            raise CommandError(
                f'frame {frame!r} is no link of the robot and not (yet) connected to {self._base}'
                f' by TF; links: {self._names}'
            )
        return found

    def _listen(self) -> None:
        self._tree = FrameTree()
        self._node.create_subscription(TFMessage, '/tf', self._take, 100)
        self._node.create_subscription(TFMessage, '/tf_static', self._take_static, STATIC_QOS)

    def _take(self, message: TFMessage) -> None:
        now, clock = time.monotonic(), float(self._node.get_clock().now().nanoseconds) * 1e-9
        if self._tree is not None:
            learn_transforms(self._tree, message, now, clock)

    def _take_static(self, message: TFMessage) -> None:
        if self._tree is not None:
            learn_static(self._tree, message)


def learn_transforms(tree: FrameTree, message: TFMessage, now: float, clock: float) -> None:
    """Take a message of /tf; what comes late is as old as its stamps say.

    Args:
        clock: Time of its arrival by the clock of the stamps in [s].
    """
    for transform in message.transforms:
        _learn(tree, transform, now - max(clock - seconds(transform.header.stamp), 0.0))


def learn_static(tree: FrameTree, message: TFMessage) -> None:
    """Take a message of /tf_static."""
    for transform in message.transforms:
        _learn(tree, transform, math.inf)


def _learn(tree: FrameTree, transform: TransformStamped, when: float) -> None:
    try:
        rotation = rotation_of(xyzw(transform.transform.rotation))
        position = checked(xyz(transform.transform.translation), 3, 'translation')
    except CommandError:
        return  # other listeners of TF report it to its publisher
    tree.learn(transform.child_frame_id, transform.header.frame_id, Pose(rotation, position), when)

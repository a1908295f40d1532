# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of TF, such as that of a camera, in the root link of the robot."""

from __future__ import annotations

from collections import deque
from contextlib import suppress
import math
import threading
import time

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from tf2_msgs.msg import TFMessage

from arm_model import Array, combined, FrameTree, Kinematics, Pose, TRANSFORM_TIMEOUT
from arm_model.ros import learn_static, learn_transforms, STATIC_QOS

from ..exceptions import PlanningCode, PlanningError

KEPT_TIME = 5.0  # age at which a message that nobody needed is passed over unread in [s]
KEPT_MESSAGES = 2000  # how many of them at most


class TfFrames:
    """Frames of /tf and /tf_static; any thread may ask.

    Messages are kept as they come and read when somebody asks: robots publish the frames of their
    own links 100 times a second, and few requests name others.
    """

    def __init__(self, node: Node, kinematics: Kinematics, prefix: str = '') -> None:
        """Listen.

        Args:
            kinematics: All joints of the robot.
            prefix: Before the names of its links in TF.
        """
        self._node, self._kinematics, self._prefix = node, kinematics, prefix
        self._unread: deque[tuple[float, float, bytes]] = deque(maxlen=KEPT_MESSAGES)
        self._tree, self._lock = FrameTree(), threading.Lock()
        node.create_subscription(TFMessage, '/tf', self._take, 100, raw=True)
        node.create_subscription(TFMessage, '/tf_static', self._take_static, STATIC_QOS)

    def pose(self, frame: str, positions: Array) -> Pose:
        """Return where a frame is in the root link.

        A frame that TF connects with a link of the robot only is where that link is.

        Args:
            positions: Positions of all joints of the robot in [rad].

        Raises:
            PlanningError: It is unknown, not connected with the robot, or too old.
        """
        root, links = self._kinematics.root, self._kinematics.frames
        if (name := frame.removeprefix(self._prefix)) in links:
            return self._kinematics.link_pose(name, positions)
        with self._lock:
            self._read()
            now = time.monotonic()
            for link in (root, *links):
                in_link = self._tree.pose(frame, self._prefix + link, now)
                if in_link is not None:
                    return combined(self._kinematics.link_pose(link, positions), in_link)
            raise PlanningError(PlanningCode.FRAME_TRANSFORM_FAILURE, self._reason(frame, now))

    def _reason(self, frame: str, now: float) -> str:
        age, root = self._tree.age(frame, now), self._prefix + self._kinematics.root
        if not math.isfinite(age):
            return (
                f'Unknown frame: {frame!r}; it is no link, no object and no subframe'
                f' object/subframe, and /tf does not have it: start what publishes it'
            )
        if age > TRANSFORM_TIMEOUT:
            return (
                f'Unable to transform from frame {frame!r} to frame {root!r}: its newest transform'
                f' on /tf is {age:.1f} s old; see that its publisher goes on'
            )
        return (
            f'Unable to transform from frame {frame!r} to frame {root!r}: /tf does not connect'
            ' them with transforms of the last second; publish what is between them'
        )

    def _read(self) -> None:
        oldest = time.monotonic() - KEPT_TIME
        with suppress(IndexError):  # until none is left; more may come meanwhile
            while True:
                now, clock, data = self._unread.popleft()
                if now > oldest:
                    learn_transforms(self._tree, deserialize_message(data, TFMessage), now, clock)

    def _take(self, data: bytes) -> None:
        now = time.monotonic()
        clock = float(self._node.get_clock().now().nanoseconds) * 1e-9
        self._unread.append((now, clock, data))

    def _take_static(self, message: TFMessage) -> None:
        with self._lock:
            learn_static(self._tree, message)

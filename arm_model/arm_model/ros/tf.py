# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts poses and times of messages; looks up TF frames such as that of a camera."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from contextlib import suppress
import math
import threading
import time
from typing import Any

from geometry_msgs.msg import TransformStamped
import numpy as np
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from tf2_msgs.msg import TFMessage

from ..arrays import Array, checked, combined, inverse, ORIGIN, Pose, rotation_of
from ..exceptions import CommandError, SceneError
from ..kinematics import Kinematics


def xyz(vector: Any) -> Array:  # noqa: ANN401  # Vector3 or Point; message classes have no type
    """Convert a vector or point message."""
    return np.array([vector.x, vector.y, vector.z])


def xyzw(quaternion: Any) -> list[float]:  # noqa: ANN401
    """Convert a quaternion message to x, y, z, w."""
    return [quaternion.x, quaternion.y, quaternion.z, quaternion.w]


def pose_of(position: Any, orientation: Any, what: str) -> Pose:  # noqa: ANN401
    """Convert position and quaternion to a pose; an all-zero quaternion is identity, as in MoveIt.

    Args:
        what: Beginning of the error message.

    Raises:
        SceneError: A number is not finite, or the length of the quaternion is not 1.
    """
    quaternion = xyzw(orientation)
    try:
        rotation = rotation_of(quaternion) if any(quaternion) else ORIGIN.rotation
        return Pose(rotation, checked(xyz(position), 3, 'position'))
    except CommandError as error:
        raise SceneError(f'{what}: {error}') from error


def seconds(stamp: Any) -> float:  # noqa: ANN401  # Time and Duration
    """Convert a stamp or duration message to [s]."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def duration_fields(time: float) -> dict[str, int]:
    """Return the fields of a duration message."""
    total = round(time * 1e9)
    return {'sec': total // 1_000_000_000, 'nanosec': total % 1_000_000_000}


STATIC_QOS = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""QoS profile of /tf_static."""

TRANSFORM_TIMEOUT = 1.0  # age at which a transform of /tf counts no more in [s]
KEPT_TIME = 5.0  # age at which a message that was not needed is left unread in [s]
KEPT_MESSAGES = 2000  # how many of them at most


class FrameTree:
    """The newest transforms of /tf and /tf_static."""

    def __init__(self) -> None:
        self._links: dict[str, tuple[str, Pose, float]] = {}  # parent, pose in it, time

    def learn(self, child: str, parent: str, pose: Pose, time: float) -> None:
        """Store a transform, with the steady time of its arrival; infinity for a static one."""
        self._links[child] = parent, pose, time

    def age(self, frame: str, now: float) -> float:
        """Return the age of the newest transform of a frame in [s]; infinity if it has none."""
        link = self._links.get(frame)
        return math.inf if link is None else max(now - link[2], 0.0)

    def pose(self, frame: str, base: str, now: float) -> Pose | None:
        """Return the pose of a frame in another; None if they are not connected."""
        up, over = self._to_root(frame, now), self._to_root(base, now)
        for name, pose in up.items():
            if name in over:
                return combined(inverse(over[name]), pose)
        return None

    def _to_root(self, frame: str, now: float) -> dict[str, Pose]:
        """Return the pose of a frame in itself and in each of its ancestors, nearest first."""
        pose = Pose(np.eye(3), np.zeros(3))
        found = {frame: pose}
        while link := self._links.get(frame):
            parent, in_parent, learned = link
            if now - learned >= TRANSFORM_TIMEOUT or parent in found:  # too old, or a loop
                break
            pose, frame = combined(in_parent, pose), parent
            found[frame] = pose
        return found


class TfListener:
    """Listens to TF; frames can be looked up from any thread."""

    def __init__(
        self,
        node: Node,
        kinematics: Kinematics,
        prefix: str = '',
        base: str = '',
        *,
        world_frames: Collection[str] = (),
        on_demand: bool = False,
    ) -> None:
        """Create the listener.

        Args:
            prefix: Prefix of the robot's link names in TF.
            base: Link in which :meth:`pose` expresses poses.
            world_frames: Names of the root link unless TF has these frames: those of the SRDF's
                virtual joint.
            on_demand: If true, store messages unread and read them at a lookup: robots publish
                their own links 100 times a second, and few requests name other frames. If false,
                start listening at the first lookup of a frame that is not a link, and read each
                message on arrival, so that no control cycle reads many.
        """
        self._node, self._prefix, self._base = node, prefix, base
        self._links, self._root = frozenset(kinematics.frames), kinematics.root
        self._world_frames = frozenset(world_frames) - self._links
        self._on_demand, self._is_listening = on_demand, False
        self._has_static = False
        self._unread: deque[tuple[float, float, bytes]] = deque(maxlen=KEPT_MESSAGES)
        self._tree, self._lock = FrameTree(), threading.Lock()
        if on_demand:
            self._listen()
        elif self._world_frames:  # the first command in one is to know where it is
            self._listen_to_static()

    def link(self, frame: str) -> str | None:
        """Return the robot link that a frame names, with or without the prefix."""
        name = frame.removeprefix(self._prefix)
        if name in self._world_frames and not self._is_placed(frame):
            return self._root
        return name if name in self._links else None

    def _is_placed(self, frame: str) -> bool:
        """Return whether TF has connected a frame with the root link, however long ago."""
        self._listen()
        with self._lock:
            self._read()
            return self._tree.pose(frame, self._prefix + self._root, -math.inf) is not None

    def pose(self, frame: str) -> Pose:
        """Return the pose of a TF frame in the base.

        Raises:
            CommandError: The frame is unknown, not connected to the base, or too old.
        """
        return self.connected(frame, self._base)[1]

    def connected(self, frame: str, *links: str) -> tuple[str, Pose]:
        """Return the first of some links that TF connects to a frame, and the frame's pose in it.

        Raises:
            CommandError: The frame is unknown, not connected to any link, or too old.
        """
        self._listen()
        with self._lock:
            self._read()
            now = time.monotonic()
            for link in links:
                found = self._tree.pose(frame, self._prefix + link, now)
                if found is not None:
                    return link, found
            raise CommandError(self._reason(frame, self._prefix + links[0], now))

    def _reason(self, frame: str, base: str, now: float) -> str:
        age = self._tree.age(frame, now)
        if not math.isfinite(age):
            return (
                f'Unknown frame: {frame!r}; it is no link of the robot, and /tf does not have it:'
                ' start what publishes it'
            )
        what = f'Unable to transform from frame {frame!r} to frame {base!r}'
        if age > TRANSFORM_TIMEOUT:
            return (
                f'{what}: its newest transform on /tf is {age:.1f} s old; see that its publisher'
                ' goes on'
            )
        return (
            f'{what}: /tf does not connect them with transforms of the last second; publish what'
            ' is between them'
        )

    def _listen(self) -> None:
        if self._is_listening:
            return
        self._is_listening = True
        self._listen_to_static()
        if self._on_demand:
            self._node.create_subscription(TFMessage, '/tf', self._keep, 100, raw=True)
        else:
            self._node.create_subscription(TFMessage, '/tf', self._learn_now, 100)

    def _listen_to_static(self) -> None:
        if not self._has_static:
            self._has_static = True
            self._node.create_subscription(TFMessage, '/tf_static', self._learn_static, STATIC_QOS)

    def _arrival(self) -> tuple[float, float]:
        """Return the present time in [s] on the steady clock, and on the clock of the stamps."""
        return time.monotonic(), float(self._node.get_clock().now().nanoseconds) * 1e-9

    def _keep(self, data: bytes) -> None:
        self._unread.append((*self._arrival(), data))

    def _read(self) -> None:
        oldest = time.monotonic() - KEPT_TIME
        with suppress(IndexError):  # until none is left; more may come meanwhile
            while True:
                now, clock, data = self._unread.popleft()
                if now > oldest:
                    self._learn(deserialize_message(data, TFMessage), now, clock)

    def _learn_now(self, message: TFMessage) -> None:
        with self._lock:
            self._learn(message, *self._arrival())

    def _learn(self, message: TFMessage, now: float, clock: float) -> None:
        """Store a message of /tf; a late message has the age that its stamps give."""
        for each in message.transforms:
            self._store(each, now - max(clock - seconds(each.header.stamp), 0.0))

    def _learn_static(self, message: TFMessage) -> None:
        with self._lock:
            for each in message.transforms:
                self._store(each, math.inf)

    def _store(self, transform: TransformStamped, when: float) -> None:
        try:
            rotation = rotation_of(xyzw(transform.transform.rotation))
            position = checked(xyz(transform.transform.translation), 3, 'translation')
        except CommandError:
            return  # other listeners of TF report it to its publisher
        child, parent = transform.child_frame_id, transform.header.frame_id
        self._tree.learn(child, parent, Pose(rotation, position), when)

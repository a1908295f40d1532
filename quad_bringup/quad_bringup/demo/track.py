# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a stream of poses to velocities of the body in its own frame."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math

from quad_description.rotations import Quaternion, tilt_of, yaw_of

from .segments import Velocity

WINDOW = 1.0
"""Time in [s] over which the velocity of the moment is taken."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the body is in a fixed frame.

    Attributes:
        stamp: ROS time in [s].
        x: Position in [m].
        y: Position in [m].
        z: Height in [m].
        rotation: Unit quaternion (x, y, z, w), body to fixed frame.
    """

    stamp: float
    x: float
    y: float
    z: float
    rotation: Quaternion

    @property
    def yaw(self) -> float:
        """Heading in [rad], from minus pi to pi."""
        return yaw_of(self.rotation)

    @property
    def tilt(self) -> float:
        """Angle between the body's z axis and the vertical in [rad]."""
        return tilt_of(self.rotation)


@dataclass(frozen=True, slots=True)
class Milestone:
    """What a body has covered since the first pose.

    Attributes:
        stamp: ROS time in [s].
        forward: Distance along its own x in [m].
        left: Distance along its own y in [m].
        turn: Angle about z in [rad], not wrapped.
    """

    stamp: float
    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0


def mean_velocity(begin: Milestone, end: Milestone) -> Velocity | None:
    """Return the mean velocity between two milestones, None when no time has passed.

    Args:
        begin: The earlier one.
        end: The later one.
    """
    time = end.stamp - begin.stamp
    if time <= 0:
        return None
    return Velocity(
        (end.forward - begin.forward) / time,
        (end.left - begin.left) / time,
        (end.turn - begin.turn) / time,
    )


class Track:
    """Adds up what a body covers, in its own frame.

    Attributes:
        milestone: What it has covered so far, None before the first pose.
    """

    def __init__(self) -> None:
        self.milestone: Milestone | None = None
        self._last: Pose | None = None
        self._recent: deque[Milestone] = deque()

    def take(self, pose: Pose) -> None:
        """Take in a pose; one that is not newer than the last is passed over.

        Args:
            pose: The next.
        """
        last, covered = self._last, self.milestone
        if last is None or covered is None:
            covered = Milestone(pose.stamp)
        elif pose.stamp > last.stamp:
            covered = _extend(covered, last, pose)
        else:
            return
        self._last, self.milestone = pose, covered
        self._recent.append(covered)
        while self._recent[0].stamp < pose.stamp - WINDOW:
            self._recent.popleft()

    @property
    def velocity(self) -> Velocity | None:
        """Mean velocity of the last second, None before there is one."""
        if not self._recent:
            return None
        return mean_velocity(self._recent[0], self._recent[-1])


def _extend(covered: Milestone, last: Pose, pose: Pose) -> Milestone:
    turned = math.remainder(pose.yaw - last.yaw, math.tau)
    heading = last.yaw + 0.5 * turned
    dx, dy = pose.x - last.x, pose.y - last.y
    cosine, sine = math.cos(heading), math.sin(heading)
    return Milestone(
        pose.stamp,
        covered.forward + cosine * dx + sine * dy,
        covered.left - sine * dx + cosine * dy,
        covered.turn + turned,
    )

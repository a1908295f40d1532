# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of TF: which way one is turned and where it is in another."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from .pose import combined, inverse, Pose

TRANSFORM_TIMEOUT = 1.0  # age at which a transform of /tf counts no more in [s]


@dataclass(frozen=True, slots=True, eq=False)
class _Link:
    parent: str
    pose: Pose
    time: float


class FrameTree:
    """The newest transforms of /tf and /tf_static."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}

    def learn(self, child: str, parent: str, pose: Pose, time: float) -> None:
        """Take a transform.

        Args:
            parent: Name of the frame in which its pose is given.
            time: Steady time of its arrival in [s]; infinity for a static one.
        """
        self._links[child] = _Link(parent, pose, time)

    def age(self, frame: str, now: float) -> float:
        """Return how old the newest transform of a frame is in [s]; infinity where it has none."""
        link = self._links.get(frame)
        return math.inf if link is None else max(now - link.time, 0.0)

    def pose(self, frame: str, base: str, now: float) -> Pose | None:
        """Return the pose of a frame in another; None where they are not connected."""
        up, over = self._to_root(frame, now), self._to_root(base, now)
        for name, pose in up.items():
            if name in over:
                return combined(inverse(over[name]), pose)
        return None

    def _to_root(self, frame: str, now: float) -> dict[str, Pose]:
        """Return the pose of a frame in itself and in each of its ancestors, nearest first."""
        pose = Pose(np.eye(3), np.zeros(3))
        found = {frame: pose}
        while (link := self._links.get(frame)) and now - link.time < TRANSFORM_TIMEOUT:
            pose, frame = combined(link.pose, pose), link.parent
            if frame in found:  # a loop: whoever publishes it is wrong
                break
            found[frame] = pose
        return found

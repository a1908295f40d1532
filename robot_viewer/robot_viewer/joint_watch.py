# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Why a robot falls apart in a viewer: joints in no message, and names in no description."""

from __future__ import annotations

from collections.abc import Iterable
import math

from urdf_reader import KinematicTree

SILENCE_TIMEOUT = 5.0
"""Time in [s] after which a joint that was in no message is reported."""
START_TIMEOUT = 30.0
"""Time in [s] within which somebody publishes: a robot may take so long to start."""


class JointWatch:
    """Compares the joints of a description with those of the messages; reports each once."""

    def __init__(self, model: KinematicTree, now: float) -> None:
        """Begin to watch."""
        self._silent = {joint.name for joint in model.movable() if joint.mimic is None}
        self._known = {joint.name for joint in model.joints}
        self._unknown: set[str] = set()
        self._reported: set[str] = set()
        self._received = False
        self._due = now + SILENCE_TIMEOUT
        self._start_due = now + START_TIMEOUT
        self._publisher_due = math.inf

    def take(self, names: Iterable[str]) -> None:
        """Add the names of a message."""
        self._received = True
        self._silent.difference_update(names)
        self._unknown.update(name for name in names if name not in self._known)

    def notes(self, now: float, topic: str, publishers: int) -> list[str]:
        """Return what is not wrong yet and was not reported yet: nobody publishes so far."""
        waits = self._silent and not self._received and not publishers
        return self._once(
            f'no message on {topic} yet, as nobody publishes it: fine while the robot starts; '
            f'else check the publisher (ros2 topic info {topic}) and ROS_DOMAIN_ID'
            if waits and self._due <= now < self._start_due
            else ''
        )

    def warnings(self, now: float, topic: str, publishers: int) -> list[str]:
        """Return what is wrong and was not reported yet."""
        if not self._received:
            return self._silence(now, topic, publishers)
        if now < self._due:
            return []
        silent, unknown = ', '.join(sorted(self._silent)), ', '.join(sorted(self._unknown))
        return [
            *self._once(
                f'no message on {topic} has {silent}: no /tf below these joints of the robot '
                'description'
                if silent
                else ''
            ),
            *self._once(
                f'on {topic}, but not in the robot description: {unknown}' if unknown else ''
            ),
        ]

    def _silence(self, now: float, topic: str, publishers: int) -> list[str]:
        """Report a silent publisher, or that there is none yet."""
        if publishers and self._publisher_due == math.inf:
            self._publisher_due = now + SILENCE_TIMEOUT
        begun = self._publisher_due < math.inf
        silent = bool(self._silent) and now >= (self._publisher_due if begun else self._start_due)
        return self._once(
            f'no message on {topic}, so no /tf of moving joints; check the publisher '
            f'(ros2 topic info {topic}) and ROS_DOMAIN_ID'
            if silent
            else ''
        )

    def _once(self, text: str) -> list[str]:
        if not text or text in self._reported:
            return []
        self._reported.add(text)
        return [text]

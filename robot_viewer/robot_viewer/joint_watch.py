# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Why a robot falls apart in a viewer: joints nobody tells of, and names nobody knows."""

from __future__ import annotations

from collections.abc import Iterable

from urdf_reader import KinematicTree

PATIENCE = 5.0
"""Time in [s] after which a joint that was never heard of is told."""


class JointWatch:
    """Compares the joints of a description with those of the messages; tells each once."""

    def __init__(self, model: KinematicTree, now: float) -> None:
        """Begin to watch.

        Args:
            model: The robot.
            now: Steady time in [s].
        """
        self._silent = {joint.name for joint in model.movable() if joint.mimic is None}
        self._known = {joint.name for joint in model.joints}
        self._strangers: set[str] = set()
        self._told: set[str] = set()
        self._heard = False
        self._due = now + PATIENCE

    def take(self, names: Iterable[str]) -> None:
        """Take in the names of a message.

        Args:
            names: Names of joints.
        """
        self._heard = True
        self._silent.difference_update(names)
        self._strangers.update(name for name in names if name not in self._known)

    def warnings(self, now: float, topic: str) -> list[str]:
        """Say what is wrong and was not told yet.

        Args:
            now: Steady time in [s].
            topic: Name of the topic, for the message.
        """
        if now < self._due:
            return []
        if not self._heard:
            return self._once(
                f'nothing heard on {topic} for {PATIENCE:g} s: there is no /tf of moving joints; '
                f'does anybody publish (ros2 topic info {topic}), and in this ROS_DOMAIN_ID?'
                if self._silent
                else ''
            )
        silent, strangers = ', '.join(sorted(self._silent)), ', '.join(sorted(self._strangers))
        return [
            *self._once(
                f'never heard on {topic}: {silent}; there is no /tf below these joints of the '
                'robot description'
                if silent
                else ''
            ),
            *self._once(
                f'heard on {topic}, but not in the robot description: {strangers}'
                if strangers
                else ''
            ),
        ]

    def _once(self, text: str) -> list[str]:
        if not text or text in self._told:
            return []
        self._told.add(text)
        return [text]

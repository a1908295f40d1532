# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From joint positions to transforms, with the behaviour of ROS' robot_state_publisher.

No ROS and no clock in here: stamps and the time come in as integers in [ns].
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
import math

from urdf_reader import (
    Joint,
    joint_position,
    joint_transform,
    JointKind,
    KinematicTree,
    MOVABLE,
    Transform,
)

HIGHEST_FREQUENCY = 1000.0
"""Greatest ``publish_frequency`` in [Hz] (robot_state_publisher 3.3.3)."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How transforms are published; names and defaults are robot_state_publisher's.

    Attributes:
        publish_frequency: Greatest rate of a joint's transform in [Hz]; 0 for every message.
        frame_prefix: Put in front of each frame name as it is.
        ignore_timestamp: Publish at each message, whatever its stamp is.
    """

    publish_frequency: float = 20.0
    frame_prefix: str = ''
    ignore_timestamp: bool = False

    def __post_init__(self) -> None:
        """Refuse what has no meaning.

        Raises:
            ValueError: The frequency is beyond its range.
        """
        if not 0.0 <= self.publish_frequency <= HIGHEST_FREQUENCY:
            raise ValueError(
                f'publish_frequency {self.publish_frequency:g} is not between 0 and '
                f'{HIGHEST_FREQUENCY:g} Hz'
            )

    @property
    def interval(self) -> int:
        """Least time between two transforms of a joint in [ns], in whole milliseconds."""
        if not self.publish_frequency:
            return 0
        return int(1000.0 / self.publish_frequency) * 1_000_000


@dataclass(frozen=True, slots=True)
class FrameTransform:
    """A transform with the names of its frames.

    Attributes:
        parent: Name of the parent frame, with prefix.
        child: Name of the child frame, with prefix.
        transform: Pose of the child in the parent.
    """

    parent: str
    child: str
    transform: Transform


class MessageProblem(Enum):
    """What is wrong with a message."""

    LENGTHS = 'name and position have different lengths; the message is ignored'
    NO_POSITION = 'it has no positions; the message is ignored'
    NOT_FINITE = 'a position is not finite; that joint is left out'
    NO_STAMP = 'its stamp is zero; the time of its arrival is taken'
    BACKWARDS = 'the clock moved backwards; transforms are published from there on'


@dataclass(frozen=True, slots=True)
class Update:
    """What follows from a message.

    Attributes:
        stamp: Stamp of the transforms in [ns].
        transforms: To be published, possibly none.
        problems: What is wrong with the message.
    """

    stamp: int
    transforms: tuple[FrameTransform, ...] = ()
    problems: tuple[MessageProblem, ...] = ()


class StatePublisher:
    """Computes which transforms are to be published when joint positions come in."""

    def __init__(self, model: KinematicTree, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self._model = model
        self._movable = {joint.name: joint for joint in model.movable()}
        self._followers = [joint for joint in self._movable.values() if joint.mimic]
        self._published: dict[str, int] = {}
        self._last_now = 0

    @property
    def model(self) -> KinematicTree:
        """The robot."""
        return self._model

    def fixed(self) -> list[FrameTransform]:
        """Return the transforms that never change.

        Planar joints are among them, at their origin, as in the public robot_state_publisher;
        floating ones are not: another node publishes those.
        """
        moving = MOVABLE | {JointKind.FLOATING}
        fixed = (joint for joint in self._model.joints if joint.kind not in moving)
        return [self._named(joint, joint.origin) for joint in fixed]

    def update(
        self, names: Sequence[str], positions: Sequence[float], stamp: int, now: int
    ) -> Update:
        """Store a JointState.

        Args:
            names: Names of joints, those of other robots among them.
            positions: Their positions in [rad] or [m].
            stamp: Stamp of the message in [ns].
            now: ROS time in [ns].

        Returns:
            What follows.
        """
        if len(names) != len(positions):
            return Update(
                stamp, (), (MessageProblem.LENGTHS if positions else MessageProblem.NO_POSITION,)
            )
        problems = [*self._clock_problems(now)]
        if not stamp and not self.settings.ignore_timestamp:
            problems.append(MessageProblem.NO_STAMP)
            stamp = now
        if not self._is_due(names, stamp, now):
            return Update(stamp, (), tuple(problems))
        finite = {
            name: position
            for name, position in zip(names, positions, strict=True)
            if math.isfinite(position)
        }
        if len(finite) < len(set(names)):
            problems.append(MessageProblem.NOT_FINITE)
        self._published.update(dict.fromkeys(names, stamp))
        return Update(stamp, tuple(self._transforms(finite)), tuple(problems))

    def _clock_problems(self, now: int) -> Iterator[MessageProblem]:
        if now < self._last_now:  # a bag that begins again, or a simulation that was reset
            self._published.clear()
            yield MessageProblem.BACKWARDS
        self._last_now = now

    def _is_due(self, names: Sequence[str], stamp: int, now: int) -> bool:
        oldest = min([now, *(self._published.get(name, 0) for name in names)])
        return self.settings.ignore_timestamp or stamp >= oldest + self.settings.interval

    def _transforms(self, positions: Mapping[str, float]) -> Iterator[FrameTransform]:
        for name, position in positions.items():
            joint = self._movable.get(name)
            if joint is not None:
                yield self._named(joint, joint_transform(joint, position))
        for joint in self._followers:
            followed = joint_position(joint, positions)
            if joint.name not in positions and followed is not None:
                yield self._named(joint, joint_transform(joint, followed))

    def _named(self, joint: Joint, transform: Transform) -> FrameTransform:
        prefix = self.settings.frame_prefix
        return FrameTransform(prefix + joint.parent, prefix + joint.child, transform)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Computes transforms from joint positions, with the behaviour of ROS' robot_state_publisher.

Independent of ROS and clocks: the caller passes stamps and the time as integers in [ns].
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

HIGHEST_FREQUENCY = 1000.0  # maximum publish_frequency in [Hz] (robot_state_publisher 3.3.3)


@dataclass(frozen=True, slots=True)
class Settings:
    """How transforms are published; names and defaults are robot_state_publisher's.

    Raises:
        ValueError: publish_frequency is out of its range.
    """

    publish_frequency: float = 20.0
    """Maximum rate of a joint's transform, 0 to 1000 [Hz]; 0 for every message."""
    frame_prefix: str = ''  # prepended to each frame name unchanged
    ignore_timestamp: bool = False  # publish at each message, whatever its stamp

    def __post_init__(self) -> None:
        """Reject a publish_frequency out of range."""
        if not 0.0 <= self.publish_frequency <= HIGHEST_FREQUENCY:
            raise ValueError(
                f'publish_frequency is {self.publish_frequency:g} Hz; give 0 to'
                f' {HIGHEST_FREQUENCY:g} Hz, 0 for every message'
            )

    @property
    def interval(self) -> int:
        """Minimum time between two transforms of a joint in [ns], rounded down to milliseconds."""
        if not self.publish_frequency:
            return 0
        return int(1000.0 / self.publish_frequency) * 1_000_000


@dataclass(frozen=True, slots=True)
class FrameTransform:
    """A transform with its frame names, prefix included."""

    parent: str
    child: str
    transform: Transform  # pose of the child in the parent


class MessageProblem(Enum):
    """What is wrong with a message."""

    LENGTHS = 'name and position have different lengths; the message is ignored'
    NO_POSITION = 'it has no positions; the message is ignored'
    NOT_FINITE = 'a position is not finite; that joint is left out'
    NO_STAMP = 'its stamp is zero; the time of its arrival is taken'
    BACKWARDS = 'the clock moved backwards; transforms are published from there on'


@dataclass(frozen=True, slots=True)
class Update:
    """Result of processing a message."""

    stamp: int  # of the transforms in [ns]
    transforms: tuple[FrameTransform, ...] = ()  # to be published, possibly none
    problems: tuple[MessageProblem, ...] = ()  # what is wrong with the message


class StatePublisher:
    """Computes the transforms to publish for each JointState."""

    def __init__(self, model: KinematicTree, settings: Settings | None = None) -> None:
        self.settings = settings or Settings()
        self._model = model
        self._movable = {joint.name: joint for joint in model.movable()}
        self._followers = [joint for joint in self._movable.values() if joint.mimic]
        self._published: dict[str, int] = {}
        self._last_now = 0

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
        """Store a JointState, possibly with joints of other robots; return what to publish.

        Positions are in [rad] or [m], the stamp and the ROS time ``now`` in [ns].
        """
        if len(names) != len(positions):
            return Update(
                stamp, (), (MessageProblem.LENGTHS if positions else MessageProblem.NO_POSITION,)
            )
        problems = []
        if now < self._last_now:  # a bag restarted, or a simulation was reset
            self._published.clear()
            problems.append(MessageProblem.BACKWARDS)
        self._last_now = now
        if not stamp and not self.settings.ignore_timestamp:
            problems.append(MessageProblem.NO_STAMP)
            stamp = now
        oldest = min([now, *(self._published.get(name, 0) for name in names)])
        if not self.settings.ignore_timestamp and stamp < oldest + self.settings.interval:
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

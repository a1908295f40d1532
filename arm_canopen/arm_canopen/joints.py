# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Merges joint states of single drives into those of a robot, one set per time stamp."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple, TypeAlias

from urdf_reader import DescriptionError, Mimic, read_urdf

from canopen_core import CanopenError

STALE_AFTER = 0.5  # [s] without news a joint is no longer published
START_TIMEOUT = 30.0  # [s] in which the first state of a joint comes, or comes again after an end


Joints: TypeAlias = Mapping[str, Mimic | None]
"""Single-variable joints in URDF order, each with its mimic rule; None for independent joints."""


def movable_joints(robot_description: str) -> Joints:
    """Return the revolute, continuous and prismatic joints of a URDF (XML text) in its order.

    Raises:
        CanopenError: The text is no URDF, or has no movable joint.
    """
    try:
        tree = read_urdf(robot_description)
    except DescriptionError as error:
        raise CanopenError(str(error)) from error
    joints = {joint.name: joint.mimic for joint in tree.movable()}
    if not joints:
        raise CanopenError('the robot description has no revolute, continuous or prismatic joint')
    return joints


class JointSample(NamedTuple):
    """State of one joint: position [rad or m], velocity [unit/s], effort [Nm or N]."""

    position: float
    velocity: float
    effort: float


class JointSet(NamedTuple):
    """States of many joints, in URDF order, with one stamp in [ns] on the clock of the samples."""

    stamp: int
    samples: dict[str, JointSample]


class JointAggregator:
    """Collects samples into rounds; a round ends when it has every joint of the previous one.

    Drives on one bus share the stamp of their SYNC, so a round is one SYNC. A sample of a later
    stamp, or a second one of the same joint, ends a round that is still incomplete. Silent joints
    are left out after a while, never extrapolated; until then nothing is published without them,
    so that no subscriber sees a robot of one joint at the start.
    """

    def __init__(self, joints: Joints) -> None:
        self._joints = joints
        self._samples: dict[str, JointSample] = {}
        self._arrivals: dict[str, float] = {}  # steady time in [s]
        self._stamp = 0
        self._round: set[str] = set()
        self._expected: set[str] = set()
        self._published = False
        self._began: float | None = None  # steady time of the first sample in [s]

    def update(self, name: str, stamp: int, sample: JointSample, now: float) -> list[JointSet]:
        """Add a sample of a joint, with its stamp in [ns].

        Returns:
            The sets that are ready now: none, one, or two when this sample both ended a round and
            completed the next.
        """
        if self._began is None:
            self._began = now
        ready = []
        if stamp > self._stamp or name in self._round:
            if not self._published and self._round and self._may_publish(now):
                ready.append(self._close(now))
            self._expected = self._round
            self._round, self._stamp, self._published = set(), stamp, False
        self._round.add(name)
        self._samples[name] = sample
        self._arrivals[name] = now
        if not self._published and self._round >= self._expected and self._may_publish(now):
            ready.append(self._close(now))
        return ready

    def silent(self, now: float) -> list[str]:
        """Return the joints that are not reported yet, or no longer."""
        return [
            name
            for name, mimic in self._joints.items()
            if mimic is None and not self._is_recent(name, now)
        ]

    def _may_publish(self, now: float) -> bool:
        """Whether every joint was reported, or has timed out."""
        began = now if self._began is None else self._began
        return now - began > STALE_AFTER or not self.silent(now)

    def _close(self, now: float) -> JointSet:
        self._published = True
        samples = {}
        for name, mimic in self._joints.items():
            if self._is_recent(name, now):
                samples[name] = self._samples[name]
            elif mimic is not None and self._is_recent(mimic.source, now):
                leader = self._samples[mimic.source]
                position = mimic.position(leader.position)
                samples[name] = JointSample(position, mimic.velocity(leader.velocity), 0.0)
        return JointSet(self._stamp, samples)

    def _is_recent(self, name: str, now: float) -> bool:
        return name in self._arrivals and now - self._arrivals[name] <= STALE_AFTER


class SilenceWatch:
    """Distinguishes a lost drive from a master that has not started yet, or has ended.

    A master that ends takes its publishers out of the graph; a drive that is lost does not.
    """

    def __init__(self, joints: Iterable[str], now: float) -> None:
        self._absent_since: dict[str, float] = dict.fromkeys(joints, now)
        self._silent: frozenset[str] = frozenset()

    def note(self, joint: str) -> None:
        """Record that the state of a joint was received."""
        self._absent_since.pop(joint, None)

    def look(self, silent: Iterable[str], published: Iterable[str], now: float) -> list[str]:
        """Return the joints that are missing; call it every few seconds.

        ``silent`` joints have no states now; ``published`` joints have a publisher in the graph.
        """
        before, self._silent = self._silent, frozenset(silent)
        there = set(published)
        missing = []
        for joint in silent:
            if joint not in there and joint not in self._absent_since:
                self._absent_since[joint] = now
            absent_since = self._absent_since.get(joint)
            # a master that ends is silent for a moment before its publishers go
            was_silent = joint in before and absent_since is None
            if was_silent or (absent_since is not None and now - absent_since > START_TIMEOUT):
                missing.append(joint)
        return missing

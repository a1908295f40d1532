# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Stores the latest measurement of each joint and its time."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
import math
from typing import NamedTuple


class JointSample(NamedTuple):
    """Measurement of a joint, in radians, or metres for a prismatic joint."""

    position: float
    velocity: float  # NaN where it is not measured
    time: float  # steady time in [s]


class JointStateStore:
    """The latest sample of each joint, from messages that hold any subset in any order.

    One thread writes, any thread reads: a sample is replaced as a whole.
    """

    def __init__(self, joints: Collection[str] | None = None) -> None:
        """Begin empty; if ``joints`` are given, all others are ignored."""
        self._joints = None if joints is None else frozenset(joints)
        self._samples: dict[str, JointSample] = {}

    def receive(
        self,
        names: Sequence[str],
        positions: Sequence[float],
        velocities: Sequence[float],
        now: float,
    ) -> None:
        """Store a message; a joint whose position is missing or not finite is ignored."""
        speeds = velocities if len(velocities) == len(names) else [math.nan] * len(names)
        for name, position, speed in zip(names, positions, speeds, strict=False):
            if math.isfinite(position) and (self._joints is None or name in self._joints):
                self._samples[name] = JointSample(float(position), float(speed), now)

    def samples(self, since: float = -math.inf) -> Mapping[str, JointSample]:
        """Return the joints that were measured since a time."""
        return {name: each for name, each in self._samples.copy().items() if each.time >= since}

    def sample(self, joint: str) -> JointSample | None:
        """Return the latest sample of a joint; None before the first."""
        return self._samples.get(joint)

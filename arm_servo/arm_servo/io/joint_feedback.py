# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The arm's state from joint states that others publish."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from arm_model import frozen, RobotState


class JointFeedback:
    """Puts joint states together: each message may name some of the joints, in any order.

    :meth:`take` is for one thread, :meth:`state` for any.
    """

    def __init__(self, joints: Sequence[str], timeout: float) -> None:
        """Know nothing yet.

        Args:
            timeout: Age at which a position counts no more in [s].
        """
        self._joints = list(joints)
        self._timeout = timeout
        # one tuple per joint: position, velocity, time; each is replaced as a whole
        self._values = [(math.nan, 0.0, -math.inf)] * len(self._joints)

    def receive(
        self,
        names: Sequence[str],
        positions: Sequence[float],
        velocities: Sequence[float],
        now: float,
    ) -> None:
        """Store a message; numbers that are not finite are ignored.

        Args:
            velocities: Their velocities in [rad/s]; may be empty.
        """
        speeds = velocities if len(velocities) == len(names) else [0.0] * len(names)
        for name, position, speed in zip(names, positions, speeds, strict=False):
            if name in self._joints and math.isfinite(position):
                value = (float(position), float(speed) if math.isfinite(speed) else 0.0, now)
                self._values[self._joints.index(name)] = value

    @property
    def time(self) -> float:
        """Steady time since which every joint was received in [s]."""
        return min(time for _, _, time in self._values)

    def state(self, now: float) -> tuple[RobotState | None, str]:
        """Return the measured state, None before it is whole; and why it is no good."""
        values = list(self._values)
        silent = [
            joint
            for joint, (_, _, time) in zip(self._joints, values, strict=True)
            if now - time > self._timeout
        ]
        blocked = ''
        if silent:
            blocked = (
                f'no joint states of {", ".join(silent)} for {self._timeout:g} s;'
                ' does their driver run, and publish finite numbers?'
            )
        if any(math.isnan(position) for position, _, _ in values):
            return None, blocked
        measured = RobotState(
            frozen([position for position, _, _ in values]),
            frozen([speed for _, speed, _ in values]),
            np.zeros(len(values)),
        )
        return measured, blocked

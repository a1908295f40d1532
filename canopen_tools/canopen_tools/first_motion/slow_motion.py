# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A slow motion to a target, made in the cycle of the master while somebody permits it: pure."""

from __future__ import annotations

from collections.abc import Sequence
import math
import threading

from arm_canopen import AxisFeedback, Refusal

PERMIT = 0.25  # [s] for which one permission holds
RAMP_TIME = 0.25  # [s] from rest to full speed, and back
NEAR = 0.01  # share of a full step within which the target counts as reached


class SlowMotion:
    """A motion source that goes to a target only while its permission is young.

    Who permits is another thread. Should that stall, the joint stands within :data:`PERMIT` and
    :data:`RAMP_TIME`.
    """

    def __init__(self, axis: str, target: float, speed: float) -> None:
        """Begin at rest, towards a target in [rad] or [m], at most at speed [1/s]."""
        self.axes: Sequence[str] = (axis,)  # name of the drive
        self.problem = ''  # why the drive was taken away; empty while it follows
        self._target = target
        self._speed = speed
        self._position: float | None = None
        self._velocity = 0.0
        self._lock = threading.Lock()
        self._permitted_until = -math.inf

    def permit(self, until: float) -> None:
        """Let it move until a steady time in [s]; one that has passed ends the motion."""
        with self._lock:
            self._permitted_until = until

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Answer the set-point of this cycle."""
        (axis,) = feedback
        if not axis.followable or self.problem:
            return (None,)
        if self._position is None:
            self._position = axis.setpoint
        with self._lock:
            permitted = now < self._permitted_until
        self._step(period, permitted=permitted)
        return (self._position,)

    def released(self, axis: str, refusal: Refusal) -> None:
        """The drive was taken away."""
        self.problem = self.problem or f'{axis} {refusal}'

    def _step(self, period: float, *, permitted: bool) -> None:
        """Advance by a cycle; the speed changes by its ramp, and ends at the target."""
        position = self._position or 0.0
        left = self._target - position
        change = self._speed / RAMP_TIME * period
        # the speed from which it can still stop at the target after this step
        fastest = min(
            self._speed, math.sqrt(change**2 + 2.0 * change * abs(left) / period) - change
        )
        wanted = math.copysign(fastest, left) if permitted else 0.0
        self._velocity += min(max(wanted - self._velocity, -change), change)
        step = self._velocity * period
        if abs(step) >= abs(left) or abs(left - step) < NEAR * self._speed * period:
            self._position, self._velocity = self._target, 0.0
        else:
            self._position = position + step

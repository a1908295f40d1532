# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A trapezoidal profile, one step a cycle, for targets in the cyclic position modes.

A single target is approached as fast as the limits allow. Those of a stream are points of a path,
and come at times of their own: the profile follows a line between them, so that its speed is that
of the path and not that of a dash to each point. A set-point that can always stop at the end of
the line goes beyond none of the targets.
"""

from __future__ import annotations

import math

from ..parameters import ProfileLimits

SPREAD = 2.0  # intervals between targets over which the way to the newest one is spread
LEARNING = 0.25  # share of the newest interval in their mean


class TargetLine:
    """Goes to the newest of a stream of targets at a constant rate.

    It takes twice the usual interval between them for that, so that it does not rest when one is
    late.

    Attributes:
        position: Where it is.
        target: The newest target.
    """

    def __init__(self, target: float) -> None:
        self.position = self.target = target
        self._left = self._since = 0.0  # [s] to the newest target, and since it came
        self._interval: float | None = None  # [s]

    def extend(self, target: float) -> None:
        """Begin with the next target."""
        before = self._since if self._interval is None else self._interval
        self._interval = before + LEARNING * (self._since - before)
        self._left, self._since = SPREAD * self._interval, 0.0
        self.target = target

    def step(self, period: float) -> float:
        """Advance by a cycle of that length in [s], and return the new position."""
        if self._left > period:
            self.position += period / self._left * (self.target - self.position)
        else:
            self.position = self.target
        self._left -= period
        self._since += period
        return self.position


class SetpointProfile:
    """Moves a set-point to a target that may change at any time, without a step in velocity."""

    def __init__(self, position: float, velocity: float = 0.0) -> None:
        """Start at a position with a rate in [unit/s], and brake."""
        self.position = position  # set-point of this cycle
        self.velocity = velocity  # its rate in [unit/s]
        self.target: float | None = None  # where it goes; None brakes to a stop
        self._line: TargetLine | None = None

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and has nowhere to go."""
        return self.velocity == 0.0 and self.target in (None, self.position)

    @property
    def is_idle(self) -> bool:
        """Whether a step changes nothing: it is at rest, and follows no stream of targets."""
        return self._line is None and self.at_rest

    def go(self, target: float | None) -> None:
        """Go to a single target; without one brake to a stop."""
        self.target, self._line = target, None

    def track(self, target: float) -> None:
        """Go on to the next target of a stream; the first one is like a single target."""
        if self._line is None:
            self._line, self.target = TargetLine(target), target
        else:
            self._line.extend(target)

    def follow(self, position: float, period: float) -> None:
        """Follow the set-point of a stream, and remember its rate for a smooth stop."""
        self.velocity = (position - self.position) / period
        self.position = position
        self.go(None)

    def step(self, period: float, limits: ProfileLimits) -> float:
        """Advance by a cycle.

        The speed is never above the one from which the target can still be met by braking: of
        ``v * period + v^2 / (2 * deceleration) = distance`` the positive root.

        Returns:
            The new set-point.
        """
        speed_limit = limits.velocity
        if self._line is not None:
            before, self.target = self._line.position, self._line.step(period)
            line_speed = abs(self.target - before) / period
            speed_limit = max(speed_limit, min(line_speed, limits.speed_limit))
        if self.at_rest:
            return self.position
        wanted = 0.0
        if self.target is not None:
            wanted = self._wanted(self.target, period, speed_limit, limits.deceleration)
        braking = abs(wanted) < abs(self.velocity) or wanted * self.velocity < 0
        change = (limits.deceleration if braking else limits.acceleration) * period
        self.velocity += max(-change, min(change, wanted - self.velocity))
        self.position += self.velocity * period
        if (
            self.target is not None
            and abs(self.target - self.position) < 1e-9
            and (abs(self.velocity) <= limits.deceleration * period)
        ):
            self.position, self.velocity = self.target, 0.0
        return self.position

    def _wanted(
        self, target: float, period: float, speed_limit: float, deceleration: float
    ) -> float:
        distance = target - self.position
        root = math.sqrt(period**2 + 2.0 * abs(distance) / deceleration)
        speed = min(speed_limit, deceleration * (root - period))
        # on the last cycle the rest of the way is taken in one step
        if abs(distance) <= speed * period:
            speed = abs(distance) / period
        return math.copysign(speed, distance)

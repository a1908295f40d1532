# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""At the border of the reach: stopping in front of it, and going back the way the arm came.

A straight arm can fold to either side, and both bring the tool back. Whoever ran through the
straight pose would come back on the other side, where a joint limit or a link may soon be in the
way. So the joints are braked in front of it, and leave it to the side where they were.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from arm_model import Array, JointLimits
from arm_trajectory import brakeable

from .singularity import Directions, distance_to_singularity, LOST_SPEED_FACTOR, way_out

FULL_SPEED_TWIST = 0.05
"""Scaled twist from which on a singular pose is left at full speed in [rad/s]."""

MAX_ESCAPE_MOTION = 3.0
"""How far a way out is followed while the asked direction stays lost in [rad]."""

MAX_STEP_MOTION = 0.05
"""Motion of a joint between two steps from which on something else moved the arm in [rad]."""

MIN_SIDE_DISTANCE = 1e-3
"""Least distance along a way out that shows on which side of a singular pose one is in [rad]."""

MAX_SINGULAR_VALUE_RATE = 3.0
"""Greatest change of a scaled singular value with a joint in [1/rad], to save a closer look."""

MAX_APPROACH_RATE = 4.0  # greatest speed towards a fold per way that is left in [1/s]
MIN_COMPONENT = 1e-5  # part of a joint in a direction that counts for none
JacobianAt = Callable[[Array], Array]  # scaled Jacobian of joint positions


@dataclass(frozen=True, slots=True, eq=False)
class WayOut:
    """Joint speeds that lead out of a singular pose."""

    direction: Array  # unit vector of joint speeds
    speed: float  # how fast to go along it in [rad/s]
    weight: float  # how much that weighs against the asked twist, 0 to 1


class ReachLimit:
    """Stops in front of singular poses, and leads out of them.

    It remembers the sense in which a pose is left and where it was entered, and the last place
    where the arm could do what was asked.
    """

    def __init__(self, limits: JointLimits, escape: float, braking: float) -> None:
        """Remember nothing yet.

        Args:
            escape: Share of a joint's speed with which it leaves a singular pose.
            braking: Share of acceleration and jerk that braking plans with.
        """
        self._limits = limits
        self._escape, self._braking = escape, braking
        self._least_acceleration = braking * float(limits.acceleration.min())
        self._least_jerk = braking * float(limits.jerk.min())
        self._sense: Array | None = None
        self._entered: Array | None = None
        self._good: Array | None = None
        self._at: Array | None = None

    def forget(self) -> None:
        """Forget: the joints are moved each for itself."""
        self._sense = self._entered = self._good = None

    def slowed(
        self, jacobian_at: JacobianAt, position: Array, found: Directions, command: Array
    ) -> Directions:
        """Brake in front of the border, so as not to fold to the other side.

        Args:
            jacobian_at: Scaled Jacobian of joint positions.
            command: Scaled twist that is asked (6).
        """
        self._remember(position, good=bool(command.any()) and not found.damped)
        asked = float(command @ found.tool[:, -1])
        nearest = found.least / MAX_SINGULAR_VALUE_RATE
        slow = min(self._surely_stoppable(nearest), MAX_APPROACH_RATE * nearest)
        if abs(asked) <= found.least * slow:
            return found  # slow enough for a fold that is as near as can be
        way = float(np.sign(asked)) * distance_to_singularity(jacobian_at, position, found)
        if not 0.0 < way < np.inf:
            return found
        return found.slowed(command, self._stoppable(found, way))

    def _stoppable(self, found: Directions, way: float) -> float:
        """Return the speed along the last joint direction that ends within a way in [rad/s].

        The last of the way fades, so that the arm rests there and does not hunt about it.
        """
        parts = np.maximum(np.abs(found.joints[-1]), MIN_COMPONENT)
        acceleration = self._braking * float(np.min(self._limits.acceleration / parts))
        jerk = self._braking * float(np.min(self._limits.jerk / parts))
        return min(brakeable(way, acceleration, jerk), MAX_APPROACH_RATE * way)

    def _surely_stoppable(self, way: float) -> float:
        """Return a speed in any joint direction that ends within a way in [rad/s], quickly."""
        return brakeable(way, self._least_acceleration, self._least_jerk)

    def way_out(
        self, jacobian_at: JacobianAt, position: Array, found: Directions, command: Array
    ) -> WayOut | None:
        """Return the way out of a singular pose, where the command needs one and has one.

        Args:
            jacobian_at: Scaled Jacobian of joint positions.
            command: Scaled twist that is asked (6).
        """
        if not (found.lost.any() and command.any()):
            self._sense = self._entered = None
            return None
        if self._entered is None:
            self._entered = position
        if np.linalg.norm(position - self._entered) > MAX_ESCAPE_MOTION:
            return None  # it leads nowhere
        way = way_out(jacobian_at, position, found, command)
        self._sense = None if way is None else way * self._oriented(way, position)
        if self._sense is None:
            return None
        fade = 1.0 - float(found.speed_factors[-1]) / LOST_SPEED_FACTOR
        return WayOut(self._sense, fade * self._speed(self._sense, command), fade)

    def _remember(self, position: Array, good: bool) -> None:
        """Remember a place where the arm could do what was asked, until others move the arm."""
        if self._at is None or np.abs(position - self._at).max() > MAX_STEP_MOTION:
            self._good = None
        self._at = position
        if good:
            self._good = position

    def _speed(self, way: Array, command: Array) -> float:
        """Return how fast to follow a way out in [rad/s]: slower for a slow command."""
        fastest = self._escape / float(np.max(np.abs(way) / self._limits.velocity))
        return fastest * min(1.0, float(np.linalg.norm(command)) / FULL_SPEED_TWIST)

    def _oriented(self, way: Array, position: Array) -> float:
        """Return the sense, 1 or -1: as before, else back, else away from the nearer limits."""
        if self._sense is not None:
            return 1.0 if way @ self._sense >= 0 else -1.0
        back = 0.0 if self._good is None else float(way @ (self._good - position))
        if abs(back) > MIN_SIDE_DISTANCE:
            return 1.0 if back > 0 else -1.0
        return 1.0 if self._room(way, position) >= self._room(-way, position) else -1.0

    def _room(self, way: Array, position: Array) -> float:
        """Return the speed that can be braked at the limits of each joint that a way moves."""
        limits = self._limits
        left = np.where(way > 0.0, limits.upper - position, position - limits.lower)
        rows = zip(left, limits.acceleration, limits.jerk, limits.velocity, strict=True)
        speeds = [min(brakeable(*row), fastest) for *row, fastest in rows]
        concerned = np.abs(way) > 0.1
        return float(np.min(np.array(speeds)[concerned], initial=np.inf))

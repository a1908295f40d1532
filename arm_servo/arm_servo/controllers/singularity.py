# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Directions that an arm is losing, and the way out of a pose where they are lost.

The scaled Jacobian J = sum_i s_i u_i v_i' takes joint speeds along v_i to tool speeds along u_i.
Where s_i is small, a tool speed along u_i asks joint speeds of 1/s_i: this direction is damped,
just so much that no joint is asked for more than its share of speed. The others are left alone.

A straight arm can fold to either side, and both bring the tool back. An arm that ran through the
straight pose would come back on the other side, where a joint limit or a link may soon be in the
way. So the joints are braked in front of it, and leave it to the side where they were.

``command`` is the scaled twist that is asked (6).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from arm_model import Array, JointLimits, Mask
from arm_trajectory import brakeable

SPEED_FACTOR = 0.5
"""Share of a joint's speed that a direction on its own may ask before it is damped."""

HOLD_SPEED_FACTOR = 0.05
"""Share of a joint's speed that bringing back a held axis may ask before it is damped."""

MIN_SINGULAR_VALUE = 0.004
"""Singular value of the scaled Jacobian below which a direction is damped for any command."""

REGULAR_SINGULAR_VALUE = 0.4
"""Singular value of the scaled Jacobian above which a direction is never damped."""

LOST_SPEED_FACTOR = 0.5  # share of the asked speed below which a direction counts as lost
DIFFERENCE_STEP = 1e-3  # step of the differences that look for a way out in [rad]
MIN_SPEED = 1e-6  # speed that stands for none in [rad/s]
MIN_CURVATURE = 0.02  # least curvature of a way out, in scaled tool speed per squared joint speed

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
class Directions:
    """Singular directions of a scaled Jacobian, for a command."""

    tool: Array  # directions of the tool u_i, as columns (6, r)
    joints: Array  # directions of the joints v_i, as rows (r, n)
    values: Array  # singular values s_i (r)
    damping: Array  # squares of the damping of each direction (r)
    speed_factors: Array  # what is left of the speed along each direction (r), 0 to 1

    @property
    def damped(self) -> bool:
        """Whether any direction is damped."""
        return bool(self.damping.any())

    def slowed(self, command: Array, fastest: float) -> Directions:
        """Return these with the last direction damped to a speed of the joints along it."""
        asked, least = abs(float(command @ self.tool[:, -1])), self.least
        needed = asked * least / max(fastest, MIN_SPEED) - least * least
        if needed <= self.damping[-1]:
            return self
        damping = np.append(self.damping[:-1], needed)
        left = self.values**2 / (self.values**2 + damping)
        return replace(self, damping=damping, speed_factors=left)

    @property
    def least(self) -> float:
        """The smallest singular value."""
        return float(self.values[-1])

    @property
    def lost(self) -> Mask:
        """Mask of the lost directions."""
        mask: Mask = self.speed_factors < LOST_SPEED_FACTOR
        return mask


def directions(jacobian: Array, command: Array, correction: Array, fastest: Array) -> Directions:
    """Decompose a Jacobian and find the damping of each direction.

    With d the part of the command along u_i, the undamped joint speed |d|/s_i reaches the allowed
    speed at s_0. Below it the square of the damping is (s_0^2 - s_i^2)/4: nothing at s_0, and
    nowhere more than 1.16 times the allowed speed.

    Args:
        jacobian: Scaled Jacobian (6, n).
        command: Scaled twist that is asked (6).
        correction: Scaled twist that brings held axes back (6).
        fastest: Greatest joint speeds (n) in [rad/s].
    """
    tool, values, joints = np.linalg.svd(jacobian, full_matrices=False)
    if values[-1] >= REGULAR_SINGULAR_VALUE:
        return Directions(tool, joints, values, np.zeros_like(values), np.ones_like(values))
    allowed = 1.0 / np.max(np.abs(joints) / fastest, axis=1)
    asked = np.abs(command @ tool) / SPEED_FACTOR + np.abs(correction @ tool) / HOLD_SPEED_FACTOR
    knee = np.maximum(asked / allowed, MIN_SINGULAR_VALUE)
    # a good direction whose command is too fast is slowed down with all others, not damped
    poor = np.minimum(np.maximum(2.0 - values / (0.5 * REGULAR_SINGULAR_VALUE), 0.0), 1.0)
    damping = poor * np.maximum(knee * knee - values * values, 0.0) / 4.0
    share = values * values / (values * values + damping)
    return Directions(tool, joints, values, damping, share)


def distance_to_singularity(jacobian_at: JacobianAt, position: Array, found: Directions) -> float:
    """Return how far along the last joint direction its singular value is gone, to first order.

    At the border of the reach the arm folds there to one side or the other: an arm that goes on
    comes back on the other side.

    Returns:
        The way in [rad], below zero against the direction; infinity where there is none.
    """
    along, tool = found.joints[-1], found.tool[:, -1]
    beside = float(tool @ jacobian_at(position + DIFFERENCE_STEP * along) @ along)
    change = (beside - found.least) / DIFFERENCE_STEP
    return -found.least / change if abs(change) > MIN_CURVATURE * DIFFERENCE_STEP else float('inf')


def way_out(
    jacobian_at: JacobianAt, position: Array, found: Directions, command: Array
) -> Array | None:
    """Find joint speeds that lead out of a singular pose in the sense of a command.

    Along the lost joint directions N the tool stands still at first order. At second order it
    moves along the lost tool direction u by n' H n / 2 with H = N' d(J'u)/dq N. A direction n with
    positive curvature moves the tool as asked; one with none, that yet turns J'u, leaves the tool
    in place and brings the lost direction back. Where every curvature is negative the tool is at
    the border of its reach.

    Returns:
        A unit vector of joint speeds, of either sense; None when there is none.
    """
    lost = found.lost
    along = found.tool[:, lost] @ (found.tool[:, lost].T @ command)
    size = float(np.linalg.norm(along))
    if size < 0.1 * float(np.linalg.norm(command)) or size == 0.0:
        return None
    null = found.joints[lost]
    along /= size
    steps = DIFFERENCE_STEP * null
    turning = np.array(
        [(jacobian_at(position + n) - jacobian_at(position - n)).T @ along for n in steps]
    ) / (2.0 * DIFFERENCE_STEP)  # (k, n): change of J'u along each lost joint direction
    curvature = turning @ null.T
    bends, ways = np.linalg.eigh((curvature + curvature.T) / 2.0)
    if bends[-1] > MIN_CURVATURE:
        direction: Array = ways[:, -1] @ null
        return direction
    still = ways[:, bends > -MIN_CURVATURE]
    if not still.size:
        return None
    _, sizes, turned = np.linalg.svd(turning.T @ still, full_matrices=False)
    if sizes[0] < MIN_CURVATURE:
        return None
    turned_out: Array = (still @ turned[0]) @ null
    return turned_out


@dataclass(frozen=True, slots=True, eq=False)
class WayOut:
    """Joint speeds that lead out of a singular pose."""

    direction: Array  # unit vector of joint speeds
    speed: float  # how fast to go along it in [rad/s]
    weight: float  # how much that weighs against the asked twist, 0 to 1


class ReachLimit:
    """Stops in front of singular poses, and leads out of them.

    It remembers the sense in which a pose is left and where it was entered, and the last place
    where the arm could do what was asked. A singular pose is left with the share ``escape`` of a
    joint's speed; braking plans with the share ``braking`` of acceleration and jerk.
    """

    def __init__(self, limits: JointLimits, escape: float, braking: float) -> None:
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
        """Brake in front of the border, so as not to fold to the other side."""
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
        """Return the way out of a singular pose, where the command needs one and has one."""
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

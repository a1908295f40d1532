# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Singularity handling: damping of directions near singular poses, and escape from them.

The scaled Jacobian J = sum_i s_i u_i v_i' takes joint speeds along v_i to tool speeds along u_i.
Where s_i is small, a tool speed along u_i requires joint speeds of 1/s_i. Such a direction is
damped just enough that no joint exceeds its share of speed; the others are not damped.

A straight arm can fold to either side, and both bring the tool back. An arm that passed through
the straight pose would fold to the other side, where a joint limit or a collision may soon stop
it. So the joints brake before that pose, and leave it on the side from which they came.

``command`` is the commanded scaled twist (6).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from arm_model import Array, JointLimits, Mask
from arm_trajectory import brakeable

SPEED_FACTOR = 0.5
"""Share of a joint's speed limit that one direction may require before it is damped."""

HOLD_SPEED_FACTOR = 0.05
"""Share of a joint's speed limit that correcting a held axis may require before damping."""

MIN_SINGULAR_VALUE = 0.004
"""Singular value of the scaled Jacobian below which a direction is always damped."""

REGULAR_SINGULAR_VALUE = 0.4
"""Singular value of the scaled Jacobian above which a direction is never damped."""

LOST_SPEED_FACTOR = 0.5  # share of the commanded speed below which a direction counts as lost
DIFFERENCE_STEP = 1e-3  # step of finite differences in [rad]
MIN_SPEED = 1e-6  # speed that counts as zero in [rad/s]
MIN_CURVATURE = 0.02  # least curvature of a way out, in scaled tool speed per squared joint speed

FULL_SPEED_TWIST = 0.05
"""Norm of the scaled twist in [rad/s] from which the arm escapes at full speed."""

MAX_ESCAPE_MOTION = 3.0
"""Longest escape motion in [rad] while the commanded direction stays lost."""

MAX_STEP_MOTION = 0.05
"""Joint motion between two steps in [rad] above which something else moved the arm."""

MIN_SIDE_DISTANCE = 1e-3
"""Least distance along an escape direction in [rad] that shows the side of a singular pose."""

MAX_SINGULAR_VALUE_RATE = 3.0
"""Bound of the change of a scaled singular value per joint in [1/rad]; a quick first test."""

MAX_APPROACH_RATE = 4.0  # greatest speed towards a fold per remaining distance in [1/s]
MIN_COMPONENT = 1e-5  # joint component of a direction that counts as zero
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
        """Return a copy with the last direction damped to a joint speed ``fastest`` along it."""
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
    speed at s_0. Below s_0 the squared damping is (s_0^2 - s_i^2)/4: zero at s_0, and the joint
    speed is at most 1.16 times the allowed one.

    Args:
        jacobian: Scaled Jacobian (6, n).
        command: Commanded scaled twist (6).
        correction: Scaled twist that corrects held axes (6).
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
    """Estimate to first order how far along the last joint direction its singular value is 0.

    At the limit of the reach the arm folds there: if it goes on, it comes back on the other side.

    Returns:
        The distance in [rad], negative against the direction; infinity if there is no zero.
    """
    along, tool = found.joints[-1], found.tool[:, -1]
    beside = float(tool @ jacobian_at(position + DIFFERENCE_STEP * along) @ along)
    change = (beside - found.least) / DIFFERENCE_STEP
    return -found.least / change if abs(change) > MIN_CURVATURE * DIFFERENCE_STEP else float('inf')


def way_out(
    jacobian_at: JacobianAt, position: Array, found: Directions, command: Array
) -> Array | None:
    """Find joint speeds that lead out of a singular pose in the direction of a command.

    Along the lost joint directions N the tool stands still at first order. At second order it
    moves along the lost tool direction u by n' H n / 2 with H = N' d(J'u)/dq N. A direction n with
    positive curvature moves the tool as commanded. One with zero curvature that still turns J'u
    leaves the tool in place and restores the lost direction. If all curvatures are negative, the
    tool is at the limit of its reach.

    Returns:
        A unit vector of joint speeds, of either sign; None if no direction leads out.
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
    weight: float  # weight against the commanded twist, 0 to 1


class ReachLimit:
    """Brakes before singular poses, and leads out of them.

    It stores where the arm entered a singular pose, the sign of the escape direction, and the
    last position where the arm could follow the command. ``escape`` is the share of the joint
    speed limits for escaping, ``braking`` that of acceleration and jerk limits for braking.
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
        """Discard the stored state, because the joints move individually."""
        self._sense = self._entered = self._good = None

    def slowed(
        self, jacobian_at: JacobianAt, position: Array, found: Directions, command: Array
    ) -> Directions:
        """Damp the last direction before the reach limit, so that the arm does not fold over."""
        self._remember(position, good=bool(command.any()) and not found.damped)
        asked = float(command @ found.tool[:, -1])
        nearest = found.least / MAX_SINGULAR_VALUE_RATE
        slow = min(self._surely_stoppable(nearest), MAX_APPROACH_RATE * nearest)
        if abs(asked) <= found.least * slow:
            return found  # slow enough even for the nearest possible fold
        way = float(np.sign(asked)) * distance_to_singularity(jacobian_at, position, found)
        if not 0.0 < way < np.inf:
            return found
        return found.slowed(command, self._stoppable(found, way))

    def _stoppable(self, found: Directions, way: float) -> float:
        """Return the speed in [rad/s] along the last joint direction that can stop within ``way``.

        The speed fades near the end, so that the arm rests there and does not oscillate.
        """
        parts = np.maximum(np.abs(found.joints[-1]), MIN_COMPONENT)
        acceleration = self._braking * float(np.min(self._limits.acceleration / parts))
        jerk = self._braking * float(np.min(self._limits.jerk / parts))
        return min(brakeable(way, acceleration, jerk), MAX_APPROACH_RATE * way)

    def _surely_stoppable(self, way: float) -> float:
        """Return a speed in [rad/s] that can stop within ``way`` in any direction; cheap."""
        return brakeable(way, self._least_acceleration, self._least_jerk)

    def way_out(
        self, jacobian_at: JacobianAt, position: Array, found: Directions, command: Array
    ) -> WayOut | None:
        """Return the way out of a singular pose; None if it is not needed or does not exist."""
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
        """Store the last position where the arm followed the command, until others move it."""
        if self._at is None or np.abs(position - self._at).max() > MAX_STEP_MOTION:
            self._good = None
        self._at = position
        if good:
            self._good = position

    def _speed(self, way: Array, command: Array) -> float:
        """Return the escape speed in [rad/s], which is lower for a slow command."""
        fastest = self._escape / float(np.max(np.abs(way) / self._limits.velocity))
        return fastest * min(1.0, float(np.linalg.norm(command)) / FULL_SPEED_TWIST)

    def _oriented(self, way: Array, position: Array) -> float:
        """Return the sign of a way out: as before, else back, else away from the nearer limits."""
        if self._sense is not None:
            return 1.0 if way @ self._sense >= 0 else -1.0
        back = 0.0 if self._good is None else float(way @ (self._good - position))
        if abs(back) > MIN_SIDE_DISTANCE:
            return 1.0 if back > 0 else -1.0
        return 1.0 if self._room(way, position) >= self._room(-way, position) else -1.0

    def _room(self, way: Array, position: Array) -> float:
        """Return the greatest speed from which all joints moved by ``way`` can stop in time."""
        limits = self._limits
        left = np.where(way > 0.0, limits.upper - position, position - limits.lower)
        rows = zip(left, limits.acceleration, limits.jerk, limits.velocity, strict=True)
        speeds = [min(brakeable(*row), fastest) for *row, fastest in rows]
        concerned = np.abs(way) > 0.1
        return float(np.min(np.array(speeds)[concerned], initial=np.inf))

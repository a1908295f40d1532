# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Directions that an arm is losing, and the way out of a pose where they are lost.

The scaled Jacobian J = sum_i s_i u_i v_i' takes joint speeds along v_i to tool speeds along u_i.
Where s_i is small, a tool speed along u_i asks joint speeds of 1/s_i: this direction is damped,
just so much that no joint is asked for more than its share of speed. The others are left alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from arm_model import Array, Mask

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
        """Return these with the last direction damped to a speed of the joints along it.

        Args:
            command: Scaled twist that is asked (6).
        """
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


def distance_to_singularity(
    jacobian_at: Callable[[Array], Array], position: Array, found: Directions
) -> float:
    """Return how far along the last joint direction its singular value is gone, to first order.

    At the border of the reach the arm folds there to one side or the other: whoever runs through
    comes back on the other side.

    Args:
        jacobian_at: Scaled Jacobian of joint positions.

    Returns:
        The way in [rad], below zero against the direction; infinity where there is none.
    """
    along, tool = found.joints[-1], found.tool[:, -1]
    beside = float(tool @ jacobian_at(position + DIFFERENCE_STEP * along) @ along)
    change = (beside - found.least) / DIFFERENCE_STEP
    return -found.least / change if abs(change) > MIN_CURVATURE * DIFFERENCE_STEP else float('inf')


def way_out(
    jacobian_at: Callable[[Array], Array], position: Array, found: Directions, command: Array
) -> Array | None:
    """Find joint speeds that lead out of a singular pose in the sense of a command.

    Along the lost joint directions N the tool stands still at first order. At second order it
    moves along the lost tool direction u by n' H n / 2 with H = N' d(J'u)/dq N. A direction n with
    positive curvature moves the tool as asked; one with none, that yet turns J'u, leaves the tool
    in place and brings the lost direction back. Where every curvature is negative the tool is at
    the border of its reach.

    Args:
        jacobian_at: Scaled Jacobian of joint positions.
        command: Scaled twist (6).

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

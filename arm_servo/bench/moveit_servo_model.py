# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A small model of moveit_servo's documented algorithm (Jazzy), to compare with; not its code.

Modelled: the pseudo-inverse of the Jacobian, the scaling by its condition number with metres and
radians mixed (slower from 17 on, half as strict when leaving, a halt at 30 both ways), the common
factor for joint speeds, the exponential slowing near a collision and the halt in one, the margin
at joint limits that halts all joints, and the latency of 100 ms. Parameters are the defaults.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from arm_model import Array, RobotModel

LOWER, HARD_STOP, LEAVING = 17.0, 30.0, 2.0
PROBE = 0.01
PROXIMITY = 0.01  # [m]
MARGIN = 0.1  # [rad]
LATENCY = 0.1  # [s]


class MoveitServoModel:
    """Positions for twists, as moveit_servo would give them."""

    def __init__(self, model: RobotModel, start: Array, period: float) -> None:
        self._model = model
        self._period = period
        self.position: Array = np.array(start)
        waiting = round(LATENCY / period)
        self._queue: deque[Array] = deque([self.position] * waiting, maxlen=waiting)

    def step(self, twist: Array) -> Array:
        """Advance by a cycle, and return the positions that are commanded now."""
        late = self._queue[0]
        self._queue.append(self._next(twist))
        return late

    def _next(self, twist: Array) -> Array:
        model, limits = self._model, self._model.limits
        jacobian = model.jacobian(self.position)
        change = np.linalg.pinv(jacobian) @ twist * self._period
        change *= self._singularity(jacobian, twist)
        excess = np.abs(change) / (limits.velocity * self._period)
        change /= max(1.0, float(excess.max()))
        distance = model.clearance(self.position)
        if distance <= 0.0:
            return self.position
        if distance < PROXIMITY:
            change *= np.exp(np.log(0.001) / PROXIMITY * (PROXIMITY - distance))
        after = self.position + change
        outward = ((after > limits.upper - MARGIN) & (change > 0)) | (
            (after < limits.lower + MARGIN) & (change < 0)
        )
        if not outward.any():
            self.position = after
        return self.position

    def _singularity(self, jacobian: Array, twist: Array) -> float:
        tool, values, joints = np.linalg.svd(jacobian)
        condition = values[0] / max(values[-1], 1e-12)
        if condition < LOWER:
            return 1.0
        if condition >= HARD_STOP:
            return 0.0
        direction = tool[:, len(values) - 1]
        probe = self.position + PROBE * joints[len(values) - 1]
        probed = np.linalg.svd(self._model.jacobian(probe))[1]
        if probed[0] / max(probed[-1], 1e-12) < condition:
            direction = -direction
        toward = float(direction @ twist) > 0
        upper = HARD_STOP if toward else LOWER + (HARD_STOP - LOWER) * LEAVING
        return max(0.0, 1.0 - float(condition - LOWER) / (upper - LOWER))

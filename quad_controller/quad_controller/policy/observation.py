# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The observation of a policy, as the article and the vendor's training have it.

``ang_vel(3) gravity(3) cmd(3) phase(2) joint_pos(J) joint_vel(J) prev_action(J)``, raw SI values,
no history; joint positions relative to the default pose; ``obs_dim = 11 + 3 J``.
"""

from __future__ import annotations

import math

import numpy as np

from quad_description import ImuSample
from quad_description.rotations import Vector

from ..gait.velocity import Velocity
from .network import Floats
from .options import GravitySource

TERMS = ('ang_vel', 'gravity', 'cmd', 'phase', 'joint_pos', 'joint_vel', 'prev_action')
"""Terms in their order."""

ALIASES = {
    'base_ang_vel': 'ang_vel',
    'gyro': 'ang_vel',
    'imu_ang_vel': 'ang_vel',
    'projected_gravity': 'gravity',
    'command': 'cmd',
    'velocity_commands': 'cmd',
    'velocity_command': 'cmd',
    'joint_pos_rel': 'joint_pos',
    'joint_vel_rel': 'joint_vel',
    'actions': 'prev_action',
    'action': 'prev_action',
    'last_action': 'prev_action',
    'last_actions': 'prev_action',
}
"""Other names of the terms, as mjlab and its relatives write them."""

FIXED_WIDTH = 11  # of the terms that do not depend on the number of joints
CLIP = 100.0  # beyond it an observation is no observation
STANDARD_GRAVITY = 9.80665  # [m/s^2]
TRUSTED = 0.5  # [m/s^2] off 1 g up to which the accelerometer is blended in
PLAUSIBLE = 2.0  # [m/s^2] off 1 g up to which it is believed at all
BLEND_WEIGHT = 0.1


def width(joints: int) -> int:
    """Return the width of the observation for a number of joints."""
    return FIXED_WIDTH + 3 * joints


def gravity(imu: ImuSample, source: GravitySource) -> Vector:
    """Return the direction of gravity in the body's frame, (0, 0, -1) upright.

    Args:
        imu: Attitude and specific force; an accelerometer at rest reads +g upward (REP 145).
        source: What to believe.
    """
    down = imu.down
    if source is GravitySource.EULER or imu.acceleration is None:
        return down
    x, y, z = imu.acceleration
    size = math.sqrt(x * x + y * y + z * z)
    off = abs(size - STANDARD_GRAVITY)
    if off > (TRUSTED if source is GravitySource.BLEND else PLAUSIBLE):
        return down
    share = BLEND_WEIGHT if source is GravitySource.BLEND else 1.0
    mixed = tuple(
        (1.0 - share) * a - share * b / size for a, b in zip(down, (x, y, z), strict=True)
    )
    norm = math.hypot(*mixed) or 1.0
    return mixed[0] / norm, mixed[1] / norm, mixed[2] / norm


class ObservationBuilder:
    """Fills one buffer, step after step."""

    def __init__(
        self,
        defaults: Floats,
        period: float,
        threshold: float,
        *,
        yawed: bool,
        source: GravitySource,
    ) -> None:
        """Prepare it.

        Args:
            defaults: Default pose in the policy's order in [rad].
            period: Of the phase in [s].
            threshold: A command whose norm is smaller has no phase.
            yawed: Whether the angular velocity is that of a frame turned by 180 degrees.
            source: Of the direction of gravity.
        """
        self._defaults, self._count = defaults, len(defaults)
        self._period, self._threshold = period, threshold
        self._sign = -1.0 if yawed else 1.0
        self._source = source
        self._phase = 0.0
        self._row: Floats = np.zeros((1, width(self._count)), np.float32)

    def reset(self) -> None:
        """Begin with phase zero."""
        self._phase = 0.0

    def advance(self, dt: float) -> None:
        """Let the phase go on by some [s]."""
        self._phase = math.fmod(self._phase + dt / self._period, 1.0)

    def build(
        self,
        positions: Floats,
        velocities: Floats,
        imu: ImuSample,
        velocity: Velocity,
        previous: Floats,
    ) -> Floats:
        """Return the observation; the buffer is used again in the next step.

        Args:
            positions: Joints in the policy's order in [rad].
            velocities: The same in [rad/s].
            imu: Attitude and turning.
            velocity: Velocity that is requested.
            previous: The raw action of the step before.
        """
        row, count = self._row[0], self._count
        roll, pitch, yaw = imu.angular_velocity or (0.0, 0.0, 0.0)
        row[0:3] = (self._sign * roll, self._sign * pitch, yaw)
        row[3:6] = gravity(imu, self._source)
        command = (velocity.x, velocity.y, velocity.yaw)
        row[6:9] = command
        angle = math.tau * self._phase
        moves = math.hypot(*command) >= self._threshold
        row[9:11] = (math.sin(angle), math.cos(angle)) if moves else (0.0, 0.0)
        row[11 : 11 + count] = positions - self._defaults
        row[11 + count : 11 + 2 * count] = velocities
        row[11 + 2 * count :] = previous
        np.clip(self._row, -CLIP, CLIP, out=self._row)
        return self._row

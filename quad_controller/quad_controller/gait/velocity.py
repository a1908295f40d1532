# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Velocity and pose of the body, with their range and rate limits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple

from quad_description.rotations import axes_from_rpy, Vector


class Velocity(NamedTuple):
    """A velocity of the body over ground, in the body's level frame."""

    x: float = 0.0  # forward in [m/s]
    y: float = 0.0  # to the left in [m/s]
    yaw: float = 0.0  # turning to the left in [rad/s]

    def __str__(self) -> str:
        """Return a readable text."""
        return f'{self.x:.2f} {self.y:.2f} m/s {self.yaw:.2f} rad/s'

    @property
    def finite(self) -> bool:
        """Whether all components are finite."""
        return all(map(math.isfinite, self))

    @property
    def at_rest(self) -> bool:
        """Whether it is exactly zero."""
        return self.x == self.y == self.yaw == 0.0

    def scaled(self, factor: float) -> Velocity:
        """Return the velocity multiplied by a factor."""
        return Velocity(self.x * factor, self.y * factor, self.yaw * factor)


REST = Velocity()


@dataclass(frozen=True, slots=True)
class VelocityLimits:
    """Velocity and acceleration limits of the robot."""

    x: float  # forward and backward in [m/s]
    y: float  # to a side in [m/s]
    yaw: float  # turning in [rad/s]
    acceleration: float = 1.0  # change of x and y together in [m/s^2]
    yaw_acceleration: float = 4.0  # change of the turning in [rad/s^2]
    dead_linear: float = 0.002  # slower than this is standing in [m/s]
    dead_yaw: float = 0.01  # slower than this is no turning in [rad/s]

    def clamp(self, velocity: Velocity) -> Velocity:
        """Clamp x and y to the limit ellipse and keep their direction; clamp the turning rate."""
        over = math.hypot(velocity.x / self.x, velocity.y / self.y)
        scale = 1.0 / over if over > 1.0 else 1.0
        yaw = min(max(velocity.yaw, -self.yaw), self.yaw)
        moves = math.hypot(velocity.x, velocity.y) >= self.dead_linear
        return Velocity(
            velocity.x * scale if moves else 0.0,
            velocity.y * scale if moves else 0.0,
            yaw if abs(yaw) >= self.dead_yaw else 0.0,
        )

    def bound(self, velocity: Velocity) -> Velocity:
        """Clamp only the turning rate, for a velocity that was clamped before."""
        yaw = min(max(velocity.yaw, -self.yaw), self.yaw)
        return Velocity(velocity.x, velocity.y, yaw)

    def approach(self, velocity: Velocity, target: Velocity, dt: float) -> Velocity:
        """Move the velocity towards a target by ``dt`` [s] of limited acceleration."""
        change_x, change_y = target.x - velocity.x, target.y - velocity.y
        change, most = math.hypot(change_x, change_y), self.acceleration * dt
        yaw = approach(velocity.yaw, target.yaw, self.yaw_acceleration * dt)
        if change <= most:
            return Velocity(target.x, target.y, yaw)
        share = most / change
        return Velocity(velocity.x + share * change_x, velocity.y + share * change_y, yaw)


def approach(value: float, target: float, most: float) -> float:
    """Move a value towards a target by at most one step."""
    return target if abs(target - value) <= most else value + math.copysign(most, target - value)


class BodyPose(NamedTuple):
    """Pose of the body relative to its normal pose over the feet."""

    x: float = 0.0  # forward in [m]
    y: float = 0.0  # to the left in [m]
    z: float = 0.0  # up in [m]
    roll: float = 0.0  # about x in [rad]
    pitch: float = 0.0  # about y, positive is nose down, in [rad]
    yaw: float = 0.0  # about z in [rad]

    @property
    def finite(self) -> bool:
        """Whether all components are finite."""
        return all(map(math.isfinite, self))


UPRIGHT = BodyPose()


@dataclass(frozen=True, slots=True)
class BodyLimits:
    """Range and speed limits of the body pose."""

    shift: float = 0.025  # along x and y in [m]
    height: float = 0.03  # along z, up and down, in [m]
    roll: float = 0.35  # about x in [rad]
    pitch: float = 0.3  # about y in [rad]
    yaw: float = 0.25  # about z in [rad]
    speed: float = 0.05  # along all axes in [m/s]
    turn_speed: float = 0.8  # about all axes in [rad/s]

    def clamp(self, pose: BodyPose) -> BodyPose:
        """Return the nearest pose within the limits."""
        most = (self.shift, self.shift, self.height, self.roll, self.pitch, self.yaw)
        return BodyPose(
            *(min(max(part, -limit), limit) for part, limit in zip(pose, most, strict=True))
        )

    def approach(self, pose: BodyPose, target: BodyPose, dt: float) -> BodyPose:
        """Move the pose towards a target by one step of limited speed."""
        if pose == target:
            return pose
        most = (*[self.speed * dt] * 3, *[self.turn_speed * dt] * 3)
        return BodyPose(*map(approach, pose, target, most))


def feet_in_body(feet: Sequence[Vector], pose: BodyPose, centre: Vector) -> list[Vector]:
    """Return the positions of fixed feet [m] in a body that is moved and turned about a centre."""
    axes = axes_from_rpy(pose.roll, pose.pitch, pose.yaw)
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = axes
    cx, cy, cz = centre
    moved_x, moved_y, moved_z = cx + pose.x, cy + pose.y, cz + pose.z
    moved = []
    for foot_x, foot_y, foot_z in feet:
        x, y, z = foot_x - moved_x, foot_y - moved_y, foot_z - moved_z
        moved.append(
            (
                cx + xx * x + xy * y + xz * z,
                cy + yx * x + yy * y + yz * z,
                cz + zx * x + zy * y + zz * z,
            )
        )
    return moved


class Leveller:
    """Levels the body against the measured tilt: proportional, filtered, bounded."""

    def __init__(self, gain: float, most: float = 0.2, cut_off: float = 4.0) -> None:
        """Start level.

        Args:
            gain: Correction per tilt; 0 disables levelling.
            most: Largest correction in [rad].
            cut_off: Cut-off frequency of the low-pass filter in [Hz].
        """
        self._gain = gain
        self._most = most
        self._rate = math.tau * cut_off
        self._roll = 0.0
        self._pitch = 0.0

    def step(
        self, attitude: tuple[float, float, float] | None, pose: BodyPose, dt: float
    ) -> BodyPose:
        """Add the correction to the requested pose; without an attitude it fades out."""
        roll = pitch = 0.0
        if attitude is not None:
            roll, pitch = attitude[0] - pose.roll, attitude[1] - pose.pitch
        share = 1.0 - math.exp(-self._rate * dt)
        self._roll += share * (self._bounded(roll) - self._roll)
        self._pitch += share * (self._bounded(pitch) - self._pitch)
        return pose._replace(roll=pose.roll + self._roll, pitch=pose.pitch + self._pitch)

    def _bounded(self, error: float) -> float:
        return min(max(-self._gain * error, -self._most), self._most)

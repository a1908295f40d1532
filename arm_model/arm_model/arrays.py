# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Basic types: arrays of numbers, poses of frames, states of joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
import pinocchio as pin

from .exceptions import CommandError

Array = NDArray[np.float64]
"""Double-precision numbers; each use documents the shape."""

Places = NDArray[np.int_]  # numbers of rows, from 0

Mask = NDArray[np.bool_]  # yes or no for each joint or axis

Native = Any  # an object of a library that has no types


def frozen(values: Sequence[float] | Array) -> Array:
    """Return a read-only copy."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def checked(values: Sequence[float] | Array, length: int, what: str) -> Array:
    """Return a read-only copy; check that it has ``count`` finite numbers.

    Raises:
        CommandError: The count is wrong, or a number is not finite.
    """
    array = frozen(values)
    if array.shape != (length,):
        raise CommandError(f'{what}: {array.size} numbers, {length} are needed')
    if not np.isfinite(array).all():
        place = int(np.flatnonzero(~np.isfinite(array))[0])
        raise CommandError(
            f'{what}: number {place} is {array[place]}; every number must be finite'
        )
    return array


UNIT_LENGTH_TOLERANCE = 1e-3  # how far the length of a quaternion may be off

ROUNDING_TOLERANCE = 1e-9
"""Rounding tolerance between equal poses that were computed in different ways."""


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Pose of one frame in another."""

    rotation: Array  # rotation matrix (3, 3), from the frame to the other
    position: Array  # origin of the frame in the other in [m]

    def is_close(self, other: Pose) -> bool:
        """Whether another pose is equal up to rounding."""
        return bool(
            np.allclose(self.rotation, other.rotation, rtol=0.0, atol=ROUNDING_TOLERANCE)
            and np.allclose(self.position, other.position, rtol=0.0, atol=ROUNDING_TOLERANCE)
        )


ORIGIN = Pose(frozen(np.eye(3)), frozen(np.zeros(3)))  # where a frame is in itself


def combined(outer: Pose, inner: Pose) -> Pose:
    """Return the composition of two poses: the inner one in the parent frame of the outer."""
    return Pose(outer.rotation @ inner.rotation, outer.position + outer.rotation @ inner.position)


def rotation_of(quaternion: Sequence[float]) -> Array:
    """Return the rotation matrix of a quaternion.

    Args:
        quaternion: x, y, z, w.

    Raises:
        CommandError: A number is not finite, or the length is not 1.
    """
    length = math.hypot(*quaternion)
    if not abs(length - 1.0) < UNIT_LENGTH_TOLERANCE:
        raise CommandError(f'orientation {list(quaternion)}: its length is {length:.4g}, not 1')
    matrix: Array = pin.Quaternion(np.array(quaternion) / length).toRotationMatrix()
    return matrix


def inverse(pose: Pose) -> Pose:
    """Return the inverse pose: the outer frame in the inner."""
    return Pose(pose.rotation.T, -pose.rotation.T @ pose.position)


def turned_twists(axes: Array, twists: Array) -> Array:
    """Rotate twists into other axes.

    Args:
        axes: Rotation (3, 3) from the other axes to those of the twists.
        twists: Twists as columns (6, n), or one twist (6).
    """
    parts = twists.reshape(2, 3, -1)
    turned: Array = np.matmul(axes.T, parts).reshape(twists.shape)
    return turned


@dataclass(frozen=True, slots=True, eq=False)
class RobotState:
    """Position, velocity and acceleration of every joint."""

    position: Array  # positions in [rad]
    velocity: Array  # velocities in [rad/s]
    acceleration: Array  # accelerations in [rad/s2]

    @classmethod
    def at_rest(cls, position: Sequence[float] | Array) -> RobotState:
        """Return a state at rest."""
        zero = np.zeros(len(position))
        return cls(frozen(position), frozen(zero), frozen(zero))

    @property
    def moving(self) -> bool:
        """Whether any joint has a velocity or an acceleration."""
        return bool(self.velocity.any() or self.acceleration.any())

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of geometry_msgs and builtin_interfaces as arrays, poses and seconds."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array, checked
from ..exceptions import CommandError, SceneError
from ..pose import ORIGIN, Pose, rotation_of


def xyz(vector: Any) -> Array:  # noqa: ANN401  # Vector3 or Point; message classes have no type
    """Return a vector or a point."""
    return np.array([vector.x, vector.y, vector.z])


def xyzw(quaternion: Any) -> list[float]:  # noqa: ANN401
    """Return the numbers of a quaternion."""
    return [quaternion.x, quaternion.y, quaternion.z, quaternion.w]


def pose_of(position: Any, orientation: Any, what: str) -> Pose:  # noqa: ANN401
    """Return a pose of a point or vector and a quaternion; one of zeros is no turn, as in MoveIt.

    Args:
        what: What the message of a refusal begins with.

    Raises:
        SceneError: A number is not finite, or the length of the quaternion is not 1.
    """
    quaternion = xyzw(orientation)
    try:
        rotation = rotation_of(quaternion) if any(quaternion) else ORIGIN.rotation
        return Pose(rotation, checked(xyz(position), 3, 'position'))
    except CommandError as error:
        raise SceneError(f'{what}: {error}') from error


def seconds(stamp: Any) -> float:  # noqa: ANN401  # Time and Duration
    """Return a stamp or a duration in [s]."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def duration_fields(time: float) -> dict[str, int]:
    """Return the fields of a duration."""
    total = round(time * 1e9)
    return {'sec': total // 1_000_000_000, 'nanosec': total % 1_000_000_000}

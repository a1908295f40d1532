# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands from outside, checked before anything moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math

import numpy as np

from .arrays import Array, checked, Mask
from .exceptions import CommandError
from .model import Pose, RobotModel
from .servo import PoseCommand, TwistCommand

SKEW = 1e-3
"""How far a rotation may be from one, for rounding of quaternions."""


def by_joint(model: RobotModel, values: Mapping[str, float], what: str) -> tuple[Array, Mask]:
    """Put numbers in the order of the joints.

    Args:
        model: The arm.
        values: Numbers by joint.
        what: What they are, for the message.

    Returns:
        The numbers, 0 where none is given, and the mask of those that are.

    Raises:
        CommandError: No joint is named, one is unknown, or a number is not finite.
    """
    if not values:
        raise CommandError(f'{what}: no joint is named')
    places = [model.index(name) for name in values]
    numbers = checked(list(values.values()), len(values), what)
    ordered, mask = np.zeros(len(model)), np.zeros(len(model), dtype=np.bool_)
    ordered[places], mask[places] = numbers, True
    return ordered, mask


def twist_command(
    model: RobotModel, twist: Sequence[float] | Array, link: str | None, axes: Array | None
) -> TwistCommand:
    """Check a speed of the tool.

    Args:
        model: The arm.
        twist: Linear [m/s], then angular [rad/s] (6).
        link: Link along whose axes it is given; the base when None.
        axes: Rotation (3, 3) from other axes to the base, in place of a link.

    Raises:
        CommandError: A number is not finite, the count is wrong, the link is unknown, or the
            axes are no rotation.
    """
    values = checked(twist, 6, 'twist')
    model.check_link(link)
    return TwistCommand(values, link, None if axes is None else _rotation(axes, 'axes'))


def pose_command(pose: Pose) -> PoseCommand:
    """Check a pose.

    Args:
        pose: Pose of the tip in the base.

    Raises:
        CommandError: A number is not finite, or the rotation is none.
    """
    position = checked(pose.position, 3, 'position')
    return PoseCommand(Pose(_rotation(pose.rotation, 'rotation'), position))


def duration_of(duration: float | None, default: float) -> float:
    """Check how long a command counts.

    Args:
        duration: Asked time in [s]; None for the default.
        default: The default in [s].

    Raises:
        CommandError: It is negative, infinite or not a number: a command must run out.
    """
    if duration is None:
        return default
    if not (math.isfinite(duration) and duration >= 0.0):
        raise CommandError(f'duration {duration} s: it must be finite, and 0 or more')
    return duration


def _rotation(values: Array, what: str) -> Array:
    rotation = checked(np.ravel(values), 9, what).reshape(3, 3)
    off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if off > SKEW or np.linalg.det(rotation) < 0.0:
        raise CommandError(f'{what}: it is no rotation; is the quaternion of unit length?')
    return rotation

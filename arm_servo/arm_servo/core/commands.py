# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands from outside, checked before anything moves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math

import numpy as np

from arm_model import Array, checked, combined, CommandError, Mask, Pose, RobotModel

from ..jog.servo_source import Command, JointCommand, PoseCommand, TwistCommand
from .requests import JogRequest

ROTATION_TOLERANCE = 1e-3
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


def pose_command(pose: Pose, linear_speed: float = 0.4, angular_speed: float = 0.8) -> PoseCommand:
    """Check a pose.

    Args:
        pose: Pose of the tip in the base.
        linear_speed: Greatest speed of the tip on the way there in [m/s].
        angular_speed: Greatest angular speed of the tip on the way there in [rad/s].

    Raises:
        CommandError: A number is not finite, or the rotation is none.
    """
    position = checked(pose.position, 3, 'position')
    return PoseCommand(
        Pose(_rotation(pose.rotation, 'rotation'), position),
        linear_speed,
        angular_speed,
    )


def in_base(model: RobotModel, positions: Array, request: JogRequest) -> Command:
    """Return the command of a request, about the tip and in the base.

    Args:
        model: The arm.
        positions: Positions of the joints in [rad], for frames that move with the arm.
        request: What is asked, in its frame.
    """
    command, frame = request.command, request.frame
    if frame is None or isinstance(command, JointCommand):
        return command
    place = model.pose(positions, frame) if isinstance(frame, str) else frame
    if isinstance(command, PoseCommand):
        return replace(command, pose=combined(place, command.pose))
    linear, angular = place.rotation @ command.twist[:3], place.rotation @ command.twist[3:]
    lever = model.pose(positions).position - place.position
    return TwistCommand(np.concatenate((linear + np.cross(angular, lever), angular)))


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
    if off > ROTATION_TOLERANCE or np.linalg.det(rotation) < 0.0:
        raise CommandError(f'{what}: it is no rotation; is the quaternion of unit length?')
    return rotation

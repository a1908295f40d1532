# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands from outside, checked before anything moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from arm_model import Array, checked, combined, CommandError, Mask, RobotModel

from ..jog.servo_source import Command, JointCommand, PoseCommand, TwistCommand
from .requests import JogRequest

ROTATION_TOLERANCE = 1e-3  # how far a rotation may be from one, for rounding of quaternions


def by_joint(model: RobotModel, values: Mapping[str, float], what: str) -> tuple[Array, Mask]:
    """Put numbers in the order of the joints.

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


def check_command(model: RobotModel, command: Command) -> None:
    """Check a jog.

    Raises:
        CommandError: A number is not finite, the count is wrong, the link is unknown, or the axes
            are no rotation.
    """
    if isinstance(command, TwistCommand):
        checked(command.twist, 6, 'twist')
        model.check_link(command.link)
        if command.axes is not None:
            _check_rotation(command.axes, 'axes')
    elif isinstance(command, PoseCommand):
        checked(command.pose.position, 3, 'position')
        _check_rotation(command.pose.rotation, 'rotation')
    else:
        checked(command.velocity, len(model), 'velocities')


def in_base(model: RobotModel, positions: Array, request: JogRequest) -> Command:
    """Return the command of a request, about the tip and in the base."""
    command, frame = request.command, request.frame
    if frame is None or isinstance(command, JointCommand):
        return command
    place = model.pose(positions, frame) if isinstance(frame, str) else frame
    if isinstance(command, PoseCommand):
        return replace(command, pose=combined(place, command.pose))
    linear, angular = place.rotation @ command.twist[:3], place.rotation @ command.twist[3:]
    lever = model.pose(positions).position - place.position
    return TwistCommand(np.concatenate((linear + np.cross(angular, lever), angular)))


def _check_rotation(values: Array, what: str) -> None:
    rotation = checked(np.ravel(values), 9, what).reshape(3, 3)
    off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if off > ROTATION_TOLERANCE or np.linalg.det(rotation) < 0.0:
        raise CommandError(f'{what}: not a rotation; is the quaternion of unit length?')

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The movable joints of a URDF, in its order."""

from __future__ import annotations

from dataclasses import dataclass

from urdf_reader import DescriptionError, Mimic, read_urdf

from canopen_core import CanopenError


@dataclass(frozen=True, slots=True)
class RobotJoint:
    """A joint with one variable."""

    name: str  # name in the URDF
    mimic: Mimic | None = None  # what it follows, None when it moves by itself


def movable_joints(robot_description: str) -> list[RobotJoint]:
    """Return the revolute, continuous and prismatic joints in the order of the URDF, XML text.

    Raises:
        CanopenError: It is no URDF, or has no movable joint.
    """
    try:
        tree = read_urdf(robot_description)
    except DescriptionError as error:
        raise CanopenError(str(error)) from error
    joints = [RobotJoint(joint.name, joint.mimic) for joint in tree.movable()]
    if not joints:
        raise CanopenError('the robot description has no revolute, continuous or prismatic joint')
    return joints

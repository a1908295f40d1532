# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which groups of an SRDF are moved: arms, and the tools at their ends."""

from __future__ import annotations

from dataclasses import dataclass

import urdf_reader
from urdf_reader import parse_srdf, SemanticDescription

from .description import read_semantic
from .exceptions import DescriptionError, RobotError
from .robots import Robot, SETTINGS


@dataclass(frozen=True, slots=True)
class MovedGroups:
    """The groups of a robot that are moved.

    Attributes:
        arms: Groups that are jogged and follow trajectories; the first is the main one.
        tools: Groups of end effectors.
    """

    arms: tuple[str, ...]
    tools: tuple[str, ...]


def moved_groups(robot: Robot) -> MovedGroups:
    """Choose the groups of a robot folder that are moved; as :func:`choose_groups`.

    Args:
        robot: A robot with an SRDF.

    Raises:
        RobotError: The SRDF cannot be read, or has no such group.
    """
    try:
        semantic = parse_srdf(read_semantic(robot))
    except (DescriptionError, urdf_reader.DescriptionError) as error:
        raise RobotError(f'{robot.semantic}: {error}') from error
    return choose_groups(robot, semantic)


def choose_groups(robot: Robot, semantic: SemanticDescription) -> MovedGroups:
    """Choose the groups that are moved: what the robot folder names, else all arms of the SRDF.

    Args:
        robot: The robot.
        semantic: Its SRDF.

    Raises:
        RobotError: The SRDF has no such group, or none at all.
    """
    chosen = (robot.group,) if robot.group else semantic.arms or tuple(semantic.groups)
    lost = [name for name in chosen if name not in semantic.groups]
    if lost or not chosen:
        known = ', '.join(semantic.groups) or 'none'
        raise RobotError(
            f'{robot.semantic.name} has no group {", ".join(lost) or "to move"}; groups: {known}. '
            f'Choose with group in {SETTINGS}, or --group NAME'
        )
    return MovedGroups(chosen, tuple(name for name in semantic.tools if name not in chosen))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where simulated drives stand at power-on: at 0, unless the arm cannot stand there.

Real arms have absolute encoders and are switched on somewhere in their ranges. At 0 some joints
are beyond their limits, and links may collide; from there nothing moves.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import urdf_reader
from urdf_reader import parse_srdf

from .description import joint_limits, read_semantic
from .exceptions import BringupError, DescriptionError, RobotError
from .groups import moved_groups
from .robots import Robot, SETTINGS, START_POSITIONS

if TYPE_CHECKING:
    from arm_model import Array, RobotModel


@dataclass(frozen=True, slots=True)
class StartPositions:
    """Where simulated drives stand at power-on.

    Attributes:
        positions: Positions that are not 0, by joint, in [rad or m].
        reason: Why they are not 0, in words.
    """

    positions: Mapping[str, float] = field(default_factory=dict)
    reason: str = ''

    def __str__(self) -> str:
        """Return one line for the log; empty where all stand at 0."""
        places = ', '.join(f'{name} {place:g}' for name, place in self.positions.items() if place)
        return f'simulated drives start at {places}, because {self.reason}' if places else ''


def start_positions(robot: Robot, urdf: str, drives: Sequence[str]) -> StartPositions:
    """Choose where the simulated drives of a robot stand at power-on.

    What robot.yaml says counts. Otherwise a group that cannot stand at 0 starts from its start
    pose, and another drive that cannot from the middle of its range.

    Raises:
        RobotError: robot.yaml names something that is no drive, or no pose is found.
    """
    if robot.start_positions:
        return StartPositions(given_positions(robot, drives), f'{SETTINGS} has {START_POSITIONS}')
    ranges = {name: each for name, each in joint_limits(urdf).items() if name in drives}
    positions: dict[str, float] = {}
    reasons: list[str] = []
    for model in _models(robot, urdf):
        if reason := _trouble_at_zero(model):
            positions |= _start(model)
            reasons.append(reason)
        for name in model.joints:
            ranges.pop(name, None)
    for name, each in ranges.items():
        if reason := _outside(name, each.lower, each.upper):
            positions[name] = 0.5 * (each.lower + each.upper)
            reasons.append(reason)
    return StartPositions(positions, f'at 0 {"; ".join(reasons)}' if reasons else '')


def given_positions(robot: Robot, drives: Sequence[str]) -> Mapping[str, float]:
    """Return the start positions that robot.yaml gives, by drive in [rad or m].

    Raises:
        RobotError: It names something that is no drive, or a pose that the SRDF does not have.
    """
    given = robot.start_positions
    if isinstance(given, str):
        return {name: at for name, at in _pose(robot, given).items() if name in drives}
    if unknown := [name for name in given if name not in drives]:
        raise RobotError(
            f'{robot.folder / SETTINGS}: {START_POSITIONS}: bus.yml has no drive '
            f'{", ".join(unknown)}; drives: {", ".join(drives)}'
        )
    return given


def _pose(robot: Robot, name: str) -> Mapping[str, float]:
    """Return a pose of the SRDF, of all groups that have one of this name."""
    key = f'{robot.folder / SETTINGS}: {START_POSITIONS}'
    if not robot.semantic.is_file():
        raise RobotError(f'{key}: {name!r} is a pose of the SRDF, and there is none')
    try:
        poses = parse_srdf(read_semantic(robot)).poses.values()
    except (DescriptionError, urdf_reader.DescriptionError) as error:
        raise RobotError(f'{robot.folder}: {error}') from error
    if not any(name in each for each in poses):
        known = ', '.join(dict.fromkeys(pose for each in poses for pose in each)) or 'none'
        raise RobotError(f'{key}: the SRDF has no pose {name!r}; poses: {known}')
    return {joint: at for each in poses for joint, at in each.get(name, {}).items()}


def _models(robot: Robot, urdf: str) -> list[RobotModel]:
    """Return the groups that are moved; none where nothing can move them."""
    if robot.lacking:
        return []
    try:
        from arm_model import ArmError, load_limits, RobotModel
    except ImportError:
        return []
    try:
        semantic, limits = read_semantic(robot), load_limits(robot.limits)
        groups = moved_groups(robot).names
        return [RobotModel(urdf, semantic, limits, group) for group in groups]
    except (ArmError, BringupError):
        return []  # what is to move them reports it


def _trouble_at_zero(model: RobotModel) -> str:
    """Return why a group cannot stand at 0; empty where it can."""
    import numpy as np

    zero = np.zeros(len(model))
    for name, lower, upper in zip(
        model.joints, model.limits.lower, model.limits.upper, strict=True
    ):
        if reason := _outside(name, lower, upper):
            return reason
    nearest = model.nearest(zero, 0.0, 1)
    return ' and '.join(nearest[0].links) + ' collide' if nearest else ''


def _outside(name: str, lower: float, upper: float) -> str:
    if lower <= 0.0 <= upper:
        return ''
    return f'{name} is outside its range of {lower:g} to {upper:g}'


def _start(model: RobotModel) -> dict[str, float]:
    from arm_model import ModelError, start_pose

    try:
        start: Array = start_pose(model)
    except ModelError as error:
        raise RobotError(
            f'{error}; or say where the simulated drives start: {START_POSITIONS} in {SETTINGS}'
        ) from error
    return {name: float(place) for name, place in zip(model.joints, start, strict=True)}

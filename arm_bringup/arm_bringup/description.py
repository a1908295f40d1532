# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""URDF and SRDF of a robot folder, of plain or xacro files, and the limits of the joints.

Files of others are taken as they are: what a xacro file includes for ros2_control or Gazebo is
left out where it is not installed, because the drives are on a CANopen bus here.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
import re

import urdf_reader
from urdf_reader import JointRange, read_urdf

from .exceptions import DescriptionError
from .robots import Robot, SETTINGS

RELATIVE_MESH = re.compile(r'(<mesh\b[^>]*\bfilename\s*=\s*["\'])(?![a-z]+://|/)([^"\']+)')
"""Meshes beside the description, which the nodes that read it would not find."""


def read_description(robot: Robot) -> str:
    """Return the URDF of a robot as XML text.

    Raises:
        DescriptionError: The file cannot be read or expanded.
    """
    urdf = _located(_read(robot.description, robot), robot.packages)
    return RELATIVE_MESH.sub(
        lambda found: found[1] + (robot.description.parent / found[2]).resolve().as_uri(), urdf
    )


def read_semantic(robot: Robot) -> str:
    """Return the SRDF of a robot as XML text.

    Raises:
        DescriptionError: The file cannot be read or expanded.
    """
    return _read(robot.semantic, robot)


def _read(path: Path, robot: Robot) -> str:
    if path.suffix == '.xacro':
        changed = path.stat().st_mtime_ns if path.is_file() else 0
        given = (tuple(each.items()) for each in (robot.xacro_args, robot.packages))
        return _expanded(path, changed, *given)
    try:
        return path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise DescriptionError(f'{path}: {error}') from error


@lru_cache(maxsize=4)
def _expanded(
    path: Path,
    changed: int,
    arguments: tuple[tuple[str, str], ...],
    packages: tuple[tuple[str, Path], ...],
) -> str:
    """Expand a xacro file once as long as it does not change: it takes a tenth of a second."""
    del changed
    return expand_xacro(path, dict(arguments), dict(packages))


def _located(urdf: str, packages: Mapping[str, Path]) -> str:
    """Replace ``package://`` of packages that only this robot folder knows by their folders."""
    for name, folder in packages.items():
        urdf = urdf.replace(f'package://{name}/', f'{folder.as_uri()}/')
    return urdf


def expand_xacro(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    packages: Mapping[str, Path] | None = None,
) -> str:
    """Expand a xacro file.

    Args:
        path: The xacro file.
        arguments: Values for its xacro arguments.
        packages: Folders of packages that are not in AMENT_PREFIX_PATH, by name.

    Returns:
        What it makes, as XML text.

    Raises:
        DescriptionError: The file cannot be expanded; the message is xacro's own, or names the
            package or argument that is missing and the remedy.
    """
    try:
        return urdf_reader.expand_xacro(path, arguments, packages)
    except urdf_reader.XacroError as error:
        remedy = ''
        if error.package:
            remedy = f', or give its folder in {SETTINGS} (packages: {{{error.package}: FOLDER}})'
        elif error.argument:
            remedy = f', or in {SETTINGS} (xacro_args: {{{error.argument}: VALUE}})'
        raise DescriptionError(f'{error}{remedy}') from error


def joint_limits(urdf: str) -> dict[str, JointRange]:
    """Read the limits of all joints that move by themselves, in the order of the URDF.

    Raises:
        DescriptionError: The text is no URDF, or a joint lacks its limits.
    """
    try:
        return read_urdf(urdf).ranges()
    except urdf_reader.DescriptionError as error:
        raise DescriptionError(str(error)) from error

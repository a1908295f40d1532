# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finds the ROS 2 Jazzy below the workspace: a system installation or wheels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
import re

PREFIX_VARIABLE = 'WORKSPACE_ROS_PREFIX'
SYSTEM_PREFIX = '/opt/ros/jazzy'


class UnderlayKind(Enum):
    """Kind of a ROS installation."""

    SYSTEM = 'system'  # installed by apt or in a container
    WHEELS = 'wheels'  # Python wheels in the virtual environment


@dataclass(frozen=True, slots=True)
class Underlay:
    """A ROS installation below the workspace; for wheels, `prefix` is the virtual environment."""

    kind: UnderlayKind
    prefix: Path

    def has_package(self, name: str) -> bool:
        """Return whether the ament index of the installation lists a package."""
        index = self.prefix / 'share' / 'ament_index' / 'resource_index' / 'packages'
        return (index / name).exists()

    def has_command(self, name: str) -> bool:
        """Return whether the installation has a program."""
        return (self.prefix / 'bin' / name).exists()

    @property
    def python_name(self) -> str | None:
        """Name of the Python that a system installation is built for; None if any works."""
        if self.kind is UnderlayKind.WHEELS:
            return None
        for folder in sorted(self.prefix.glob('lib/python3.*/site-packages/rclpy')):
            match = re.fullmatch(r'python3\.\d+', folder.parents[1].name)
            if match:
                return match.group()
        return None

    @property
    def python(self) -> str | None:
        """That Python: its path beside its ROS or in /usr/bin, else its name.

        A Python that conda or pyenv put first on PATH lacks the packages installed by apt.
        """
        name = self.python_name
        if name is None:
            return None
        places = (self.prefix / 'bin' / name, Path('/usr/bin') / name)
        return next((str(path) for path in places if path.exists()), name)


def find_underlay(environ: Mapping[str, str], venv: Path) -> Underlay:
    """Choose the system's ROS if it exists, else the wheels in `venv`.

    `WORKSPACE_ROS_PREFIX` replaces /opt/ros/jazzy; if it is empty, the wheels are chosen.
    """
    prefix = environ.get(PREFIX_VARIABLE, SYSTEM_PREFIX)
    if prefix and (Path(prefix) / 'local_setup.bash').is_file():
        return Underlay(UnderlayKind.SYSTEM, Path(prefix).resolve())
    return Underlay(UnderlayKind.WHEELS, venv)

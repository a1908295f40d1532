# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot folders: what makes a robot, by convention of file names.

::

    <robot>/
      bus.yml               the CANopen bus, in ros2_canopen's format
      *.eds                 what bus.yml names
      <robot>.urdf.xacro    the description; its joints have the names of the devices in bus.yml
      <robot>.srdf          for motion: the group that is moved, and its poses; "ready" is where
                            to start from
      limits.yaml           for motion: speeds, accelerations and jerks, in MoveIt's format
      controllers.yaml      for motion, optional: parameters of the nodes that move the arm

A robot is asked for by name, which means a folder that this package installs, or by a path, which
means a folder of the user's own.
"""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path

from .exceptions import RobotError

BUS_CONFIG = 'bus.yml'
"""Name of the bus configuration in a robot folder."""


@dataclass(frozen=True, slots=True)
class Robot:
    """A complete robot folder.

    Attributes:
        name: Name of the folder.
        bus_config: Its bus.yml.
        description: Its xacro file.
    """

    name: str
    bus_config: Path
    description: Path

    @property
    def folder(self) -> Path:
        """The folder."""
        return self.bus_config.parent

    @property
    def semantic(self) -> Path:
        """Its SRDF, if it is there."""
        return self.folder / f'{self.name}.srdf'

    @property
    def limits(self) -> Path:
        """Its limits of motion, if they are there."""
        return self.folder / 'limits.yaml'

    @property
    def controllers(self) -> Path:
        """Parameters of the nodes that move it, if they are there."""
        return self.folder / 'controllers.yaml'

    @property
    def lacking(self) -> str:
        """Names of the files that it lacks for trajectories and jogging; empty when it moves."""
        files = (self.semantic, self.limits)
        return ' and '.join(path.name for path in files if not path.is_file())


def installed_robots_folder() -> Path:
    """Return the folder with the robots of this package.

    Raises:
        RobotError: The package is not installed where ROS looks for it.
    """
    from ament_index_python import get_package_share_path, PackageNotFoundError

    try:
        return Path(get_package_share_path('arm_bringup')) / 'robots'
    except PackageNotFoundError as error:
        raise RobotError(
            'the package arm_bringup is not in AMENT_PREFIX_PATH; '
            'build the workspace (make build) and source env.sh'
        ) from error


def robot_names(folder: Path) -> list[str]:
    """List the robots of a folder.

    Args:
        folder: A folder with one folder per robot.
    """
    return sorted(config.parent.name for config in folder.glob(f'*/{BUS_CONFIG}'))


def find_robot(wanted: str, folder: Path) -> Robot:
    """Find a robot by name or path.

    Args:
        wanted: Name of a robot in ``folder``, or path of a robot folder (it has a slash).
        folder: A folder with one folder per robot.

    Returns:
        The robot, its files checked to be there.

    Raises:
        RobotError: There is no such robot, or a file is missing.
    """
    if os.sep in wanted:
        return _robot(Path(wanted).expanduser().resolve())
    if not (folder / wanted).is_dir():
        names = ', '.join(robot_names(folder)) or 'none'
        raise RobotError(
            f'there is no robot {wanted!r}; robots: {names}. A folder of your own is given by a '
            f'path with a slash, such as ./{wanted}'
        )
    return _robot(folder / wanted)


def _robot(folder: Path) -> Robot:
    if not folder.is_dir():
        raise RobotError(f'the robot folder {folder} does not exist')
    robot = Robot(folder.name, folder / BUS_CONFIG, folder / f'{folder.name}.urdf.xacro')
    missing = [path.name for path in (robot.bus_config, robot.description) if not path.is_file()]
    if missing:
        raise RobotError(f'the robot folder {folder} lacks {" and ".join(missing)}')
    return robot

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot folders: what makes a robot, by convention of file names.

::

    <robot>/
      bus.yml               the CANopen bus, in ros2_canopen's format
      *.eds                 what bus.yml names
      <robot>.urdf.xacro    the description (or .xacro, .urdf); its joints have the names of the
                            devices in bus.yml
      <robot>.srdf          for motion (or .srdf.xacro): groups, named poses, collision pairs
      limits.yaml           for motion (or joint_limits.yaml): MoveIt's format
      controllers.yaml      for motion, optional: parameters of the nodes that move the arm
      robot.yaml            optional: files of other names, xacro arguments, packages, group

A robot is asked for by name, which means a folder that this package installs, or by a path, which
means a folder of the user's own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import os
from pathlib import Path
from typing import Any

import yaml

from .exceptions import RobotError

BUS_CONFIG = 'bus.yml'  # name of the bus configuration in a robot folder
SETTINGS = 'robot.yaml'  # name of the file with what the names of files do not say
FILES: Mapping[str, Sequence[str]] = {
    'description': ('{name}.urdf.xacro', '{name}.xacro', '{name}.urdf'),
    'semantic': ('{name}.srdf', '{name}.srdf.xacro'),
    'limits': ('limits.yaml', 'joint_limits.yaml'),
    'controllers': ('controllers.yaml',),
}
"""Names of each file of a robot folder; the first that exists is taken."""
TABLES, WORDS = ('xacro_args', 'packages'), ('tip_link',)
"""Keys of :data:`SETTINGS` that are tables of text, and those that are text."""
GROUP = 'group'  # key of one group, or of a list
START_POSITIONS = 'start_positions'  # key of the positions of simulated drives at power-on
KEYS = (*FILES, *TABLES, *WORDS, GROUP, START_POSITIONS)
"""All keys of :data:`SETTINGS`."""


@dataclass(frozen=True, slots=True)
class Robot:
    """A complete robot folder.

    Attributes:
        name: Name of the folder.
        bus_config: Its bus.yml.
        description: Its URDF or xacro file.
        semantic: Its SRDF, if it is there.
        limits: Its limits of motion, if they are there.
        controllers: Parameters of the nodes that move it, if they are there.
        xacro_args: Values for the xacro arguments of description and SRDF.
        packages: Folders of packages that are not in AMENT_PREFIX_PATH, by name.
        groups: Groups of the SRDF that are moved; empty takes all arms of it.
        tip_link: Link that is moved; empty takes the end of the first group.
        start_positions: Where simulated drives stand at power-on, by name, in [rad or m]; or the
            name of a pose of the SRDF.
    """

    name: str
    bus_config: Path
    description: Path
    semantic: Path = Path()
    limits: Path = Path()
    controllers: Path = Path()
    xacro_args: Mapping[str, str] = field(default_factory=dict)
    packages: Mapping[str, Path] = field(default_factory=dict)
    groups: tuple[str, ...] = ()
    tip_link: str = ''
    start_positions: Mapping[str, float] | str = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """Where its files are: that of bus.yml."""
        return self.bus_config.parent

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
            'source env.sh in this shell again; if that does not help, run make build before it'
        ) from error


def robot_names(folder: Path) -> list[str]:
    """List the robots of a folder."""
    return sorted(config.parent.name for config in folder.glob(f'*/{BUS_CONFIG}'))


def find_robot(wanted: str, folder: Path) -> Robot:
    """Find a robot by its name in a folder of robots, or by a path, which has a slash.

    Returns:
        The robot, its files checked to be there.

    Raises:
        RobotError: There is no such robot, a file is missing, or robot.yaml cannot be used.
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
    settings = _settings(folder / SETTINGS)
    files = {key: _file(folder, key, settings.pop(key, '')) for key in FILES}
    config = folder / BUS_CONFIG
    missing = [path.name for path in (config, files['description']) if not path.is_file()]
    if missing:
        raise RobotError(f'the robot folder {folder} lacks {" and ".join(missing)}')
    packages = {
        name: (folder / Path(place).expanduser()).resolve()
        for name, place in settings.pop('packages', {}).items()
    }
    for name, place in packages.items():
        if not place.is_dir():
            raise RobotError(f'{folder / SETTINGS}: packages: {name}: there is no folder {place}')
    return Robot(
        folder.name,
        config,
        files['description'],
        files['semantic'],
        files['limits'],
        files['controllers'],
        packages=packages,
        **settings,
    )


def _file(folder: Path, key: str, named: str) -> Path:
    """Return the file of a key: that which robot.yaml names, or the first that exists."""
    if named:
        path = (folder / Path(named).expanduser()).resolve()
        if not path.is_file():
            raise RobotError(f'{folder / SETTINGS}: {key}: there is no file {path}')
        return path
    paths = [folder / name.format(name=folder.name) for name in FILES[key]]
    return next((path for path in paths if path.is_file()), paths[0])


def _settings(path: Path) -> dict[str, Any]:
    """Read robot.yaml: words by key, and tables of words."""
    try:
        document = yaml.safe_load(path.read_text(encoding='utf-8')) if path.is_file() else None
    except (OSError, yaml.YAMLError) as error:
        raise RobotError(f'{path}: {error}') from error
    if document is not None and not isinstance(document, dict):
        raise RobotError(f'{path}: it is no table of keys')
    settings: dict[str, Any] = {}
    for key, value in (document or {}).items():
        if key not in KEYS:
            raise RobotError(f'{path}: unknown key {key!r}; keys: {", ".join(KEYS)}')
        if key == START_POSITIONS:
            settings[key] = _positions(path, value)
        elif key in TABLES and isinstance(value, dict):
            settings[key] = {str(name): _word(path, key, word) for name, word in value.items()}
        elif key == GROUP:
            names = value if isinstance(value, list) else [value]
            settings['groups'] = tuple(_word(path, key, name) for name in names)
        elif key in TABLES:
            raise RobotError(f'{path}: {key}: a table of names and values is needed')
        else:
            settings[key] = _word(path, key, value)
    return settings


def _positions(path: Path, value: object) -> dict[str, float] | str:
    if isinstance(value, str):
        return value
    if not isinstance(value, dict):
        raise RobotError(
            f'{path}: {START_POSITIONS}: a table of drives and numbers is needed, or a pose of the'
            ' SRDF'
        )
    for name, number in value.items():
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise RobotError(f'{path}: {START_POSITIONS}: {name}: {number!r} is no number')
    return {str(name): float(number) for name, number in value.items()}


def _word(path: Path, key: str, value: object) -> str:
    """Return a value as text, booleans as xacro writes them."""
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, (str, int, float)):
        raise RobotError(f'{path}: {key}: {value!r} is no text or number')
    return str(value)

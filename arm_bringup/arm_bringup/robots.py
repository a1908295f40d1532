# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot folders: their files, bus and description, and the errors of this package.

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

A robot is selected by name (a folder that this package installs) or by path (a folder of the
user). Third-party files work unchanged: includes of a xacro file for ros2_control or Gazebo are
skipped if they are not installed, because the drives are on a CANopen bus here.

::

    BringupError
    ├── RobotError (ValueError)   a robot folder is unknown or incomplete; lists the alternatives
    ├── DescriptionError (ValueError)   a xacro file cannot be expanded, or its URDF is unusable
    └── WaveError (ValueError)    the wave cannot be planned within the limits of a joint

Programs that fail to start and services that refuse raise errors of ``process_supervisor``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
import os
from pathlib import Path
import re
from typing import Any, TYPE_CHECKING

import urdf_reader
from urdf_reader import JointRange, read_urdf
import yaml

from process_supervisor import RosOptions

if TYPE_CHECKING:
    from arm_canopen import BusConfig, NodeConfig


class BringupError(Exception):
    """Root of all errors of this package."""


class RobotError(BringupError, ValueError):
    """A robot folder is unknown or incomplete.

    Scenarios: a name misspelt, a folder without bus.yml, a bus.yml whose EDS is missing.
    """


class DescriptionError(BringupError, ValueError):
    """A xacro file cannot be expanded, or the URDF that it makes is not usable.

    Scenarios: malformed XML, an undefined xacro property, a movable joint without limits.
    """


class WaveError(BringupError, ValueError):
    """The wave cannot be planned within the limits of a joint.

    Scenarios: a joint's range is narrower than the margins, its velocity limit is zero.
    """


BUS_CONFIG = 'bus.yml'  # name of the bus configuration in a robot folder
SETTINGS = 'robot.yaml'  # name of the settings file
FILES: Mapping[str, Sequence[str]] = {
    'description': ('{name}.urdf.xacro', '{name}.xacro', '{name}.urdf'),
    'semantic': ('{name}.srdf', '{name}.srdf.xacro'),
    'limits': ('limits.yaml', 'joint_limits.yaml'),
    'controllers': ('controllers.yaml',),
}
"""File name patterns of a robot folder by key; the first existing file is used."""
TABLES, WORDS = ('xacro_args', 'packages'), ('tip_link',)
"""Keys of :data:`SETTINGS` with tables of strings, and those with strings."""
GROUP = 'group'  # key of one group, or of a list
START_POSITIONS = 'start_positions'  # key of the positions of simulated drives at power-on
KEYS = (*FILES, *TABLES, *WORDS, GROUP, START_POSITIONS)  # all keys of SETTINGS


@dataclass(frozen=True, slots=True)
class Robot:
    """A complete robot folder.

    Optional files may not exist.
    """

    name: str  # of the folder
    bus_config: Path
    description: Path
    semantic: Path = Path()
    limits: Path = Path()
    controllers: Path = Path()
    xacro_args: Mapping[str, str] = field(default_factory=dict)  # for description and SRDF
    packages: Mapping[str, Path] = field(default_factory=dict)  # not in AMENT_PREFIX_PATH
    groups: tuple[str, ...] = ()  # SRDF groups to move; empty selects all arms
    tip_link: str = ''  # link to move; empty selects the end of the first group
    start_positions: Mapping[str, float] | str = field(default_factory=dict)
    """Positions of simulated drives at power-on, by name in [rad or m], or an SRDF pose."""
    expanded: dict[Path, str] = field(default_factory=dict, init=False, repr=False, compare=False)
    """Cache of expanded xacro files as XML text, as each expansion takes 0.1 s."""

    @property
    def folder(self) -> Path:
        """The folder of bus.yml, which contains the robot's files."""
        return self.bus_config.parent

    @property
    def lacking(self) -> str:
        """Names of missing files for trajectories and jogging; empty if none is missing."""
        files = (self.semantic, self.limits)
        return ' and '.join(path.name for path in files if not path.is_file())


def installed_robots_folder() -> Path:
    """Return the folder with the robots of this package.

    Raises:
        RobotError: ROS does not find the installed package.
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
    """Find a robot by its name in a folder of robots, or by a path, which contains a slash.

    Raises:
        RobotError: The robot does not exist, a file is missing, or robot.yaml is invalid.
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
    """Return the file of a key: the one named in robot.yaml, or the first existing one."""
    if named:
        path = (folder / Path(named).expanduser()).resolve()
        if not path.is_file():
            raise RobotError(f'{folder / SETTINGS}: {key}: there is no file {path}')
        return path
    paths = [folder / name.format(name=folder.name) for name in FILES[key]]
    return next((path for path in paths if path.is_file()), paths[0])


def _settings(path: Path) -> dict[str, Any]:
    """Read the settings in robot.yaml, by key."""
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
    """Convert a value to a string, booleans as in xacro."""
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, (str, int, float)):
        raise RobotError(f'{path}: {key}: {value!r} is no text or number')
    return str(value)


def read_bus(robot: Robot) -> BusConfig:
    """Read the bus.yml of a robot, which finds errors in it before anything starts.

    Raises:
        RobotError: The file or an EDS that it names is invalid, or it defines no drive; the
            message gives place and problem.
    """
    from arm_canopen import CanopenError, load_bus

    try:
        bus = load_bus(robot.bus_config)
    except CanopenError as error:
        raise RobotError(str(error)) from error
    if not bus.joints:
        raise RobotError(f'{robot.bus_config} has no drive (a node with a Cia402 driver)')
    return bus


def in_namespace_of_bus(ros: RosOptions, bus: BusConfig) -> RosOptions:
    """Use the namespace of bus.yml for all nodes, unless the command line sets one.

    Raises:
        RobotError: The nodes of bus.yml are in several namespaces.
    """
    named = [bus.master.namespace, *(node.namespace for node in bus.nodes)]
    given = {namespace.strip('/') for namespace in named} - {''}
    if len(given) > 1 and not ros.namespace:
        raise RobotError(
            f'bus.yml puts its nodes into several namespaces ({", ".join(sorted(given))}); '
            'choose one for all with --namespace'
        )
    return ros.within(next(iter(given), ''))


INTERPOLATED_POSITION = 7  # mode of operation (CiA 402-2, 0x6060)


def stream_mode_service(bus: BusConfig) -> str:
    """Return the service for the streaming mode: as set in bus.yml, else cyclic position."""
    drives: list[NodeConfig] = [node for node in bus.nodes if node.is_drive]
    if all(drive.drive.position_mode == INTERPOLATED_POSITION for drive in drives):
        return 'interpolated_position_mode'
    return 'cyclic_position_mode'


RELATIVE_MESH = re.compile(r'(<mesh\b[^>]*\bfilename\s*=\s*["\'])(?![a-z]+://|/)([^"\']+)')
"""Pattern of mesh paths relative to the description, which nodes could not resolve."""


def read_description(robot: Robot) -> str:
    """Return the URDF of a robot as XML text."""
    urdf = _read(robot.description, robot)
    for name, folder in robot.packages.items():  # known only to this robot folder
        urdf = urdf.replace(f'package://{name}/', f'{folder.as_uri()}/')
    return RELATIVE_MESH.sub(
        lambda found: found[1] + (robot.description.parent / found[2]).resolve().as_uri(), urdf
    )


def read_semantic(robot: Robot) -> str:
    """Return the SRDF of a robot as XML text."""
    return _read(robot.semantic, robot)


def _read(path: Path, robot: Robot) -> str:
    if path.suffix == '.xacro':
        if path not in robot.expanded:
            robot.expanded[path] = expand_xacro(path, robot.xacro_args, robot.packages)
        return robot.expanded[path]
    try:
        return path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise DescriptionError(f'{path}: {error}') from error


def expand_xacro(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    packages: Mapping[str, Path] | None = None,
) -> str:
    """Expand a xacro file to XML text.

    ``packages`` maps names of packages that are not in AMENT_PREFIX_PATH to their folders.

    Raises:
        DescriptionError: The file cannot be expanded; the message is from xacro, or names the
            missing package or argument and the remedy.
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
    """Read the limits of all movable joints except mimic joints, in URDF order."""
    try:
        return read_urdf(urdf).ranges()
    except urdf_reader.DescriptionError as error:
        raise DescriptionError(str(error)) from error

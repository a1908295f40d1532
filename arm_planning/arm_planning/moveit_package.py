# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads packages of the MoveIt Setup Assistant into parameters of move_group.

::

    .setup_assistant                             which URDF and SRDF, and xacro arguments
    config/<robot>.urdf.xacro, <robot>.srdf
    config/kinematics.yaml                       robot_description_kinematics
    config/joint_limits.yaml                     robot_description_planning
    config/pilz_cartesian_limits.yaml            robot_description_planning
    config/<pipeline>_planning.yaml              <pipeline>
    config/moveit_controllers.yaml, sensors_3d.yaml, moveit_cpp.yaml

MoveIt's launch files pass the same parameters. Other files (ros2_controllers.yaml,
initial_positions.yaml, launch/) are ignored. Each parameter keeps its file and line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
import re

from urdf_reader import DescriptionError, expand_xacro, find_package, MeshFileError
import yaml

from .exceptions import ConfigError

PLANNING = 'robot_description_planning.'  # before the names of limits and scaling factors

EXPONENT = re.compile(r'[-+]?\d+(\.\d*)?[eE][-+]?\d+')
"""Numbers that YAML 1.1 reads as text, but ROS reads as numbers."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a parameter comes from."""

    file: Path  # the file
    line: int  # its line, from 1 on

    def __str__(self) -> str:
        """Return ``file:line``, as compilers write it."""
        return f'{self.file}:{self.line}'


@dataclass(frozen=True, slots=True)
class FlatYaml:
    """A file."""

    values: Mapping[str, object]  # its scalars and lists by name, with dots between the keys
    places: Mapping[str, Place]  # where each of them is, and each table


def read_flat(path: Path, prefix: str = '') -> FlatYaml:
    """Read a file, with a prefix before each name; refuse duplicate keys."""
    try:
        loader = yaml.SafeLoader(path.read_text(encoding='utf-8'))
        root = loader.get_single_node()
        if root is None:
            return FlatYaml({}, {})
        if not isinstance(root, yaml.MappingNode):
            raise ConfigError(f'{path}:1: a table is needed: keys with values')
        entries = list(_walk(path, loader, root, prefix))
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: {error}') from error
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise ConfigError(f'{path}:{line}: no YAML: {error.problem}') from error
    except yaml.YAMLError as error:
        raise ConfigError(f'{path}: no YAML: {error}') from error
    return FlatYaml(
        {name: value for name, value, _ in entries if not isinstance(value, _Table)},
        {name: Place(path, line) for name, _, line in entries},
    )


class _Table:
    """Placeholder for a table, whose entries follow."""


def _walk(
    path: Path, loader: yaml.SafeLoader, node: yaml.MappingNode, prefix: str
) -> Iterator[tuple[str, object, int]]:
    seen: dict[str, int] = {}
    for key_node, value_node in node.value:
        line = key_node.start_mark.line + 1
        key = str(loader.construct_object(key_node, deep=True))
        if key in seen:
            raise ConfigError(
                f'{path}:{line}: {key} is there twice, in line {seen[key]} too; remove one'
            )
        seen[key] = line
        name = f'{prefix}{key}'
        if isinstance(value_node, yaml.MappingNode):
            yield name, _Table(), line
            # some files have the table of their prefix around all of it
            inner = prefix if f'{key}.' == prefix else f'{name}.'
            yield from _walk(path, loader, value_node, inner)
        else:
            value = loader.construct_object(value_node, deep=True)
            is_plain = isinstance(value_node, yaml.ScalarNode) and value_node.style is None
            if is_plain and isinstance(value, str) and EXPONENT.fullmatch(value):
                value = float(value)
            yield name, value, line


FILES: Sequence[tuple[Sequence[str], str]] = (
    (('kinematics.yaml',), 'robot_description_kinematics.'),
    (('joint_limits.yaml',), PLANNING),
    (('pilz_cartesian_limits.yaml', 'cartesian_limits.yaml'), PLANNING),
    (('sensors_3d.yaml',), ''),
    (('moveit_cpp.yaml',), ''),
)
"""Alternative file names, of which the first existing one is read, and the prefix of its keys."""

OTHERS_CONTROLLERS = frozenset({'ros2_controllers.yaml', 'ros_controllers.yaml'})
"""File of ros2_control controllers, read by the controller_manager."""

ASSISTANT = 'moveit_setup_assistant_config'


@dataclass(frozen=True, slots=True)
class MoveItPackage:
    """Content of a MoveIt configuration package."""

    folder: Path  # its folder
    # parameters of move_group by name, the descriptions of the robot too
    parameters: Mapping[str, object]
    places: Mapping[str, Place] = field(default_factory=dict)  # where they are


def read_package(folder: Path, xacro_args: Mapping[str, str] | None = None) -> MoveItPackage:
    """Read a package from its folder, or from the folder ``config`` in it.

    Args:
        xacro_args: Values for xacro arguments, in addition to those of the package.

    Raises:
        ConfigError: The folder is no such package, or a file in it is invalid; the message
            names file, line and key.
    """
    if not folder.is_dir():
        raise ConfigError(f'{folder}: no folder; give that of a package of the Setup Assistant')
    config = folder / 'config' if (folder / 'config').is_dir() else folder
    root = config.parent if config.name == 'config' else folder
    assistant = _assistant(root)
    arguments = {**_xacro_args(root, assistant.values), **(xacro_args or {})}
    values: dict[str, object] = {
        'robot_description': _expanded(_urdf(root, config, assistant), arguments),
        'robot_description_semantic': _expanded(_srdf(root, config, assistant), arguments),
    }
    places: dict[str, Place] = {}
    for file in _files(config):
        values |= file.values
        places |= file.places
    return MoveItPackage(root, values, places)


def _files(config: Path) -> list[FlatYaml]:
    """Read all files of parameters."""
    found = []
    for names, prefix in FILES:
        path = next((config / name for name in names if (config / name).is_file()), None)
        if path is not None:
            found.append(read_flat(path, prefix))
    found += [
        read_flat(path, f'{path.name.removesuffix("_planning.yaml")}.')
        for path in sorted(config.glob('*_planning.yaml'))
    ]
    controllers = _controllers(config)
    if controllers is not None:
        found.append(read_flat(controllers))
    return found


def _controllers(config: Path) -> Path | None:
    """Return the file of MoveIt's controllers that MoveIt would choose."""
    path = config / 'moveit_controllers.yaml'
    if path.is_file():
        return path
    found = sorted(
        each for each in config.glob('*_controllers.yaml') if each.name not in OTHERS_CONTROLLERS
    )
    return _only(config, found, 'moveit_controllers.yaml') if found else None


def _assistant(root: Path) -> FlatYaml:
    path = root / '.setup_assistant'
    if not path.is_file():
        return FlatYaml({}, {})
    flat = read_flat(path)
    if not any(name.startswith(f'{ASSISTANT}.') for name in flat.places):
        raise ConfigError(
            f'{path}:1: no table {ASSISTANT}; write the file anew with the assistant'
        )
    return flat


def _entry(values: Mapping[str, object], table: str, key: str) -> str:
    """Return an entry of .setup_assistant; older files have tables in capitals."""
    for name in (table, table.upper()):
        value = values.get(f'{ASSISTANT}.{name}.{key}')
        if value is not None:
            return str(value)
    return ''


def _xacro_args(root: Path, values: Mapping[str, object]) -> dict[str, str]:
    pairs = [each.partition(':=') for each in _entry(values, 'urdf', 'xacro_args').split()]
    for name, assignment, _ in pairs:
        if not (name and assignment):
            raise ConfigError(
                f'{root / ".setup_assistant"}: xacro_args has {name!r}; write NAME:=VALUE'
            )
    return {name: value for name, _, value in pairs}


def _urdf(root: Path, config: Path, assistant: FlatYaml) -> Path:
    """Return the file of the URDF: that of the package, else that of .setup_assistant."""
    found = sorted([*config.glob('*.urdf.xacro'), *config.glob('*.urdf')])
    if len(found) > 1:
        stem = Path(_entry(assistant.values, 'srdf', 'relative_path')).name.partition('.')[0]
        found = [each for each in found if each.name.partition('.')[0] == stem] or found
    if found:
        return _only(config, found, '<robot>.urdf.xacro')
    package = _entry(assistant.values, 'urdf', 'package')
    inside = _entry(assistant.values, 'urdf', 'relative_path')
    if not inside:
        raise ConfigError(
            f'{config}: no *.urdf.xacro or *.urdf, and no .setup_assistant that names one; add one'
        )
    try:
        path = (find_package(package, root) if package else root) / inside
    except MeshFileError as error:
        raise ConfigError(f'{root / ".setup_assistant"}: urdf: {error}') from error
    if not path.is_file():
        raise ConfigError(f'{root / ".setup_assistant"}: urdf: no file {path}; correct it')
    return path


def _srdf(root: Path, config: Path, assistant: FlatYaml) -> Path:
    inside = _entry(assistant.values, 'srdf', 'relative_path')
    if inside:
        path = root / inside
        if not path.is_file():
            raise ConfigError(f'{root / ".setup_assistant"}: srdf: no file {path}; correct it')
        return path
    found = sorted([*config.glob('*.srdf'), *config.glob('*.srdf.xacro')])
    if not found:
        raise ConfigError(f'{config}: no *.srdf or *.srdf.xacro; add one')
    return _only(config, found, '<robot>.srdf')


def _only(config: Path, found: Sequence[Path], wanted: str) -> Path:
    if len(found) > 1:
        names = ', '.join(each.name for each in found)
        raise ConfigError(f'{config}: several files may be {wanted}: {names}; keep one')
    return found[0]


def _expanded(path: Path, arguments: Mapping[str, str]) -> str:
    """Return a file as XML text, with xacro expanded."""
    if path.suffix == '.xacro':
        try:
            return expand_xacro(path, arguments)
        except DescriptionError as error:
            raise ConfigError(str(error)) from error
    try:
        return path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f'{path}: {error}') from error

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes as processes: where their executables are, and how parameters reach them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
import json
import os
from pathlib import Path

from .exceptions import StartError
from .ros_options import RosOptions

DOMAIN_MAX = 232
"""Highest ROS domain whose UDP ports exist."""

LOG_FORMAT = {
    'RCUTILS_CONSOLE_OUTPUT_FORMAT': '[{severity}] [{name}]: {message}',
    'RCUTILS_COLORIZED_OUTPUT': '0',
    'PYTHONUNBUFFERED': '1',
}
"""Short lines without colours: a bring-up adds its own, and searches in them."""

FindExecutable = Callable[[str, str], 'Path | None']
"""Package and executable to its file; None when the package does not exist."""


@dataclass(frozen=True, slots=True)
class Executable:
    """An executable of a ROS package.

    Attributes:
        package: Name of the package.
        name: Name of the executable.
    """

    package: str
    name: str


def find_executable(package: str, name: str) -> Path | None:
    """Find an executable as ``ros2 run`` does.

    Args:
        package: Its package.
        name: Its name.

    Returns:
        Where it should be; None when the package does not exist.
    """
    from ament_index_python import get_package_prefix, PackageNotFoundError

    try:
        return Path(get_package_prefix(package)) / 'lib' / package / name
    except PackageNotFoundError:
        return None


def first_found(candidates: Iterable[Executable], find: FindExecutable) -> Executable | None:
    """Choose an executable out of several that do the same.

    Args:
        candidates: The executables, the best first.
        find: Finds executables.

    Returns:
        The first whose package exists; None when none does.
    """
    for candidate in candidates:
        if find(candidate.package, candidate.name) is not None:
            return candidate
    return None


def node_argv(
    executable: Executable,
    find: FindExecutable,
    values: Mapping[str, str] | None = None,
    parameters: Path | None = None,
    ros: RosOptions | None = None,
) -> tuple[str, ...]:
    """Make the command line of a node.

    Args:
        executable: What to run.
        find: Finds executables.
        values: ROS parameters as the command line takes them.
        parameters: A ROS parameter file.
        ros: Options of all nodes.

    Returns:
        Program and arguments.

    Raises:
        StartError: The executable is missing; the message says how to get it.
    """
    file = find(executable.package, executable.name)
    if file is None:
        raise StartError(
            f'the package {executable.package} is not in AMENT_PREFIX_PATH; '
            'build the workspace (make build) and source env.sh'
        )
    if not os.access(file, os.X_OK):
        raise StartError(f'{file} does not exist; build the workspace (make build)')
    argv = [str(file), '--ros-args']
    if parameters is not None:
        argv += ['--params-file', str(parameters)]
    for name, value in (values or {}).items():
        argv += ['-p', f'{name}:={value}']
    return (*argv, *(ros.node_arguments if ros is not None else ()))


def write_parameters(file: Path, urdf: str) -> None:
    """Write a ROS parameter file with the description of the robot, for every node.

    Args:
        file: Where to.
        urdf: The description.
    """
    # a JSON string is a YAML string, whatever characters are in it
    file.write_text(f'/**:\n  ros__parameters:\n    robot_description: {json.dumps(urdf)}\n')


def namespaced_parameters(file: Path, ros: RosOptions, folder: Path) -> Path:
    """Make a parameter file that names its nodes reach them in a namespace.

    Args:
        file: A ROS parameter file.
        ros: Options of all nodes.
        folder: Where to write the copy.

    Returns:
        The file itself where there is no namespace.

    Raises:
        StartError: It is no YAML map.
    """
    if not ros.namespace:
        return file
    import yaml

    try:
        nodes = dict(yaml.safe_load(file.read_text(encoding='utf-8')) or {})
    except (OSError, yaml.YAMLError, TypeError, ValueError) as error:
        raise StartError(f'{file}: no ROS parameter file: {error}') from error
    moved = {
        name if name.startswith('/**') else ros.resolve(name.lstrip('/')): values
        for name, values in nodes.items()
    }
    copy = folder / f'{ros.namespace.replace("/", "-")}-{file.name}'
    copy.write_text(json.dumps(moved), encoding='utf-8')  # JSON is YAML
    return copy


def ros_domain(environment: Mapping[str, str]) -> str:
    """Return the ROS domain that all processes will be in.

    Args:
        environment: Environment variables.

    Raises:
        StartError: ROS_DOMAIN_ID is no domain; every process would fail with its own words.
    """
    domain = environment.get('ROS_DOMAIN_ID') or '0'
    if not domain.isdecimal() or int(domain) > DOMAIN_MAX:
        raise StartError(
            f'ROS_DOMAIN_ID is {domain!r}; it must be a whole number from 0 to {DOMAIN_MAX}'
        )
    return domain

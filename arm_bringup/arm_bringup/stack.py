# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The processes of an arm: which there are, with which arguments, and when each is ready."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import json
import os
from pathlib import Path

from .exceptions import StartError
from .robots import Robot
from .supervisor import ProcessSpec

MASTER_READY = r'all \d+ devices operational'
"""What the master logs when every drive of the bus has booted."""
SLAVES_READY = r'\d+ simulated drives.* on '
"""What the simulated slaves log when they are on the bus."""
PUBLISHER_READY = r'publishing \d+ joints'
"""What the publisher of /joint_states logs when it has subscribed to the drives."""

MASTER_FIRST, THEN_LISTENERS, SLAVES_LAST = range(3)
"""Order of stopping: the master disables the drives, so they must still be there."""

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


@dataclass(frozen=True, slots=True)
class Stack:
    """What is to be brought up.

    Attributes:
        robot: The robot.
        bus: Name of the CAN bus.
        simulate: With simulated slaves for all devices of the bus.
        ready_timeout: How long each process may take to be ready in [s].
        master: What runs the bus.
        master_parameters: ROS parameters for it beside the usual ones.
    """

    robot: Robot
    bus: str
    simulate: bool
    ready_timeout: float = 30.0
    master: Executable = Executable('arm_canopen', 'master')
    master_parameters: Mapping[str, str] = field(default_factory=dict)


def write_parameters(file: Path, urdf: str) -> None:
    """Write a ROS parameter file with the description of the robot, for every node.

    Args:
        file: Where to.
        urdf: The description.
    """
    # a JSON string is a YAML string, whatever characters are in it
    file.write_text(f'/**:\n  ros__parameters:\n    robot_description: {json.dumps(urdf)}\n')


def arm_processes(stack: Stack, parameters: Path, find: FindExecutable) -> list[ProcessSpec]:
    """Say which processes make an arm.

    Args:
        stack: What is to be brought up.
        parameters: The file of :func:`write_parameters`.
        find: Finds executables.

    Returns:
        The processes; they start side by side.

    Raises:
        StartError: An executable is missing.
    """
    bus = {'bus_config': str(stack.robot.bus_config), 'can_interface_name': stack.bus}
    everything = [
        _slaves(stack, bus, find),
        _master(stack, bus, parameters, find),
        _publisher(stack, parameters, find),
        _state_publisher(parameters, find),
    ]
    return [spec for spec in everything if spec is not None]


def _slaves(stack: Stack, bus: Mapping[str, str], find: FindExecutable) -> ProcessSpec | None:
    if not stack.simulate:
        return None
    return ProcessSpec(
        name='slaves',
        argv=_argv(Executable('arm_canopen', 'fake_slaves'), find, bus),
        environment=LOG_FORMAT,
        ready=SLAVES_READY,
        ready_timeout=stack.ready_timeout,
        stop_order=SLAVES_LAST,
    )


def _master(
    stack: Stack, bus: Mapping[str, str], parameters: Path, find: FindExecutable
) -> ProcessSpec:
    return ProcessSpec(
        name='master',
        argv=_argv(stack.master, find, {**bus, **stack.master_parameters}, parameters),
        environment=LOG_FORMAT,
        ready=MASTER_READY,
        ready_timeout=stack.ready_timeout,
        stop_order=MASTER_FIRST,
    )


def _publisher(stack: Stack, parameters: Path, find: FindExecutable) -> ProcessSpec:
    executable = Executable('arm_canopen', 'canopen_joint_state_publisher')
    return ProcessSpec(
        name='joint_states',
        argv=_argv(executable, find, {}, parameters),
        environment=LOG_FORMAT,
        ready=PUBLISHER_READY,
        ready_timeout=stack.ready_timeout,
        stop_order=THEN_LISTENERS,
    )


def _state_publisher(parameters: Path, find: FindExecutable) -> ProcessSpec | None:
    name = 'robot_state_publisher'
    if find(name, name) is None:
        return None  # not on PyPI; the arm moves without TF
    return ProcessSpec(
        name='robot_state',
        argv=_argv(Executable(name, name), find, {}, parameters),
        environment=LOG_FORMAT,
        required=False,
        stop_order=THEN_LISTENERS,
    )


LOG_FORMAT = {
    'RCUTILS_CONSOLE_OUTPUT_FORMAT': '[{severity}] [{name}]: {message}',
    'RCUTILS_COLORIZED_OUTPUT': '0',
    'PYTHONUNBUFFERED': '1',
}
"""Short lines without colours: the bring-up adds its own, and searches in them."""


def _argv(
    executable: Executable,
    find: FindExecutable,
    values: Mapping[str, str],
    parameters: Path | None = None,
) -> tuple[str, ...]:
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
    for name, value in values.items():
        argv += ['-p', f'{name}:={value}']
    return tuple(argv)


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

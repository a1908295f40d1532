# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS nodes as processes of a bring-up: executables, parameters, shared nodes.

A bring-up holds its bus or port exclusively.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass
import errno
import hashlib
import json
import os
from pathlib import Path
from signal import Signals
import socket
import struct
import tempfile
from typing import Any

from .ros_options import RosOptions
from .spec import ProcessSpec, StartError, StopStep

DOMAIN_MAX = 232  # highest ROS domain whose UDP ports exist

ANY_NODE = '/**'
EVERY_NODE = f'{ANY_NODE}{ANY_NODE}'
"""All nodes, in our own files. rcl keeps one entry per spelling, and later entries override
earlier ones: thus the user's -p or /**, which are the same, override ours."""
VALUES = 'ros__parameters'
YAML_TAG = 'tag:yaml.org,2002:'

FindExecutable = Callable[[str, str], 'Path | None']
"""Package and executable to its file; None when the package does not exist."""


@dataclass(frozen=True, slots=True)
class Executable:
    """An executable of a ROS package."""

    package: str  # name of the package
    name: str  # name of the executable
    notifies_ready: bool = True  # it reports that it is ready, as in :class:`.ProcessSpec`


def find_executable(package: str, name: str) -> Path | None:
    """Find an executable as ``ros2 run`` does; None when the package does not exist."""
    from ament_index_python import get_package_prefix, PackageNotFoundError

    try:
        return Path(get_package_prefix(package)) / 'lib' / package / name
    except PackageNotFoundError:
        return None


def node_argv(
    executable: Executable,
    find: FindExecutable,
    values: Mapping[str, str] | None = None,
    parameters: Sequence[Path] = (),
    ros: RosOptions | None = None,
) -> tuple[str, ...]:
    """Make the command line of a node.

    Args:
        values: ROS parameters as the command line takes them.
        parameters: ROS parameter files, this program's own or from :func:`namespaced_parameters`;
            later files override earlier ones.
        ros: Options of all nodes; values set there override all others.

    Raises:
        StartError: The executable is missing; the message has the remedy.
    """
    file = find(executable.package, executable.name)
    if file is None:
        raise StartError(
            f'the package {executable.package} is not in AMENT_PREFIX_PATH; '
            'source env.sh in this shell again; if that does not help, run make build before it'
        )
    if not os.access(file, os.X_OK):
        raise StartError(f'{file} does not exist; build the workspace (make build)')
    argv = [str(file), '--ros-args']
    for parameter_file in parameters:
        argv += ['--params-file', str(parameter_file)]
    for name, value in (values or {}).items():
        argv += ['-p', f'{name}:={value}']
    return (*argv, *(ros.node_arguments if ros is not None else ()))


def write_parameters(file: Path, urdf: str) -> None:
    """Write a ROS parameter file that gives every node the robot description."""
    # a JSON string is a YAML string, whatever characters are in it
    file.write_text(
        f'{EVERY_NODE}:\n  ros__parameters:\n    robot_description: {json.dumps(urdf)}\n'
    )


def namespaced_parameters(file: Path, ros: RosOptions, folder: Path) -> Path:
    """Adapt a parameter file to a namespace; the user's own settings override it."""
    import yaml

    moved: dict[str, object] = {}
    for name, values in _read_parameters(file, _verbatim):
        full = ros.node_name(name)
        if full.startswith(ANY_NODE):
            full = f'{ANY_NODE}{full}'
        moved = _merged(moved, {full: {VALUES: values}})
    copy = folder / f'{ros.namespace.replace("/", "-")}-{file.name}'
    copy.write_text(yaml.serialize(_yaml_node(moved)), encoding='utf-8')
    return copy


def parameters_by_node(file: Path) -> dict[str, Any]:
    """Read a parameter file by node name, ignoring namespaces.

    Returns:
        The ``ros__parameters`` of each node; those for all nodes under ``/**``.

    Raises:
        StartError: It is no parameter file.
    """
    import yaml

    found: dict[str, Any] = {}
    for name, values in _read_parameters(file, yaml.safe_load):
        own = name.rpartition('/')[2]
        found = _merged(found, {ANY_NODE if own.strip('*') == '' else own: {VALUES: values}})
    return found


def _read_parameters(file: Path, read: Callable[[str], Any]) -> list[tuple[str, dict[str, Any]]]:
    import yaml

    try:
        return list(_nodes_of(read(file.read_text(encoding='utf-8')) or {}))
    except (OSError, yaml.YAMLError, TypeError, AttributeError, ValueError) as error:
        raise StartError(f'{file}: no ROS parameter file: {error}') from error


def _verbatim(text: str) -> Any:  # noqa: ANN401  # whatever stands in a file
    """Read mappings, but keep values as text: rcl parses 1e-3 and 1:30 differently."""
    import yaml

    def tree(node: yaml.Node | None) -> Any:  # noqa: ANN401
        if isinstance(node, yaml.MappingNode):
            return {str(key.value): tree(value) for key, value in node.value}
        return None if node is None or node.tag == f'{YAML_TAG}null' else node

    return tree(yaml.compose(text, yaml.SafeLoader))


def _yaml_node(tree: Any) -> Any:  # noqa: ANN401
    import yaml

    if tree is None:
        return yaml.ScalarNode(f'{YAML_TAG}null', 'null')
    if not isinstance(tree, dict):
        return tree
    pairs = [(yaml.ScalarNode(f'{YAML_TAG}str', k), _yaml_node(v)) for k, v in tree.items()]
    return yaml.MappingNode(f'{YAML_TAG}map', pairs)


def _nodes_of(table: Mapping[str, Any], within: str = '') -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the nodes of a parameter file and their parameters; namespaces may be nested."""
    for name, entry in table.items():
        full = f'{within}/{name.strip("/")}'
        if VALUES in entry:
            yield full, dict(entry[VALUES] or {})
        yield from _nodes_of({key: entry[key] for key in entry if key != VALUES}, full)


def _merged(base: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    """Merge two mappings; the second one overrides the first."""
    both = dict(base)
    for key, value in more.items():
        nested = isinstance(value, dict) and isinstance(both.get(key), dict)
        both[key] = _merged(both[key], value) if nested else value
    return both


def ros_domain(environment: Mapping[str, str]) -> str:
    """Return the ROS domain of all processes.

    Raises:
        StartError: ROS_DOMAIN_ID is no domain; each process would fail with a different message.
    """
    domain = environment.get('ROS_DOMAIN_ID') or '0'
    if not domain.isdecimal() or int(domain) > DOMAIN_MAX:
        raise StartError(
            f'ROS_DOMAIN_ID is {domain!r}; it must be a whole number from 0 to {DOMAIN_MAX}'
        )
    return domain


_CREDENTIALS = struct.Struct('3i')  # struct ucred: process, user, group
_LONGEST_NAME = 100  # [byte] of the 107 that an abstract name may have

STATE_PUBLISHERS = (
    Executable('robot_state_publisher', 'robot_state_publisher', notifies_ready=False),
    Executable('robot_viewer', 'robot_state_publisher'),
)
"""The standard one if ROS has it, else ours."""
TF_RATE = 100.0
"""Maximum rate of /tf in [Hz]; the default of 20 would halve the rate of /joint_states."""
VIEWER = Executable('robot_viewer', 'web_viewer')
"""Serves the page, and reports its URL when it is ready."""
NO_VIEW = 'NO_VIEW'  # variable that leaves the page out, where it is neither empty nor 0
VIEWER_NICENESS = ('nice', '-n', '5')
"""Programs that move the robot have priority, from the start on."""
VIEWER_STOP_STEPS = (
    StopStep(Signals.SIGTERM, 10.0),
    StopStep(Signals.SIGABRT, 1.0),
    StopStep(Signals.SIGKILL, 1.0),
)
"""The viewer holds no resource to release. On a busy computer Python takes seconds to end."""


@contextlib.contextmanager
def exclusive(thing: str, remedy: str) -> Iterator[None]:
    """Hold a resource such as ``bus vcan0`` exclusively while the block runs.

    Raises:
        StartError: Another process holds it; the message names it, and the remedy.
    """
    name = _abstract_name(thing)
    with socket.socket(socket.AF_UNIX) as holder:
        try:
            holder.bind(name)
        except OSError as error:
            if error.errno != errno.EADDRINUSE:
                raise
            raise StartError(
                f'another bring-up{_process_of(name)} is on {thing}; stop it, or take {remedy}'
            ) from error
        holder.listen()
        yield


def _abstract_name(thing: str) -> bytes:
    name = f'\0bringup {thing}'.encode()
    if len(name) <= _LONGEST_NAME:
        return name
    digest = hashlib.blake2b(name, digest_size=16).hexdigest().encode()
    return name[: _LONGEST_NAME - len(digest)] + digest


def _process_of(name: bytes) -> str:
    """Return the process that holds a socket; empty if it has just been closed."""
    with socket.socket(socket.AF_UNIX) as probe:
        probe.setblocking(False)
        try:
            probe.connect(name)
            raw = probe.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
        except OSError:
            return ''
    process, user, _ = _CREDENTIALS.unpack(raw)
    return f' (process {process} of user {user})'


@contextlib.contextmanager
def bring_up_place(package: str, ros: RosOptions) -> Iterator[Path]:
    """Hold a namespace of the ROS domain, and provide a temporary folder, while the block runs.

    Raises:
        StartError: Another bring-up is in this namespace.
    """
    place = f'namespace /{ros.namespace} of ROS domain {ros_domain(os.environ)}'
    with (
        exclusive(place, 'another --namespace'),
        tempfile.TemporaryDirectory(prefix=f'{package}-') as folder,
    ):
        yield Path(folder)


ENVIRONMENT = {
    'RCUTILS_CONSOLE_OUTPUT_FORMAT': '[{severity}] [{name}]: {message}',
    'RCUTILS_COLORIZED_OUTPUT': '0',
    'PYTHONUNBUFFERED': '1',
    'OPENBLAS_NUM_THREADS': '1',
}
"""Short lines without colours: a bring-up adds its own, and searches in them. Matrices of a robot
are small: a second thread of BLAS only spins, for 0.1 s of the start of each node."""


def node_process(
    name: str,
    executable: Executable,
    find: FindExecutable,
    ros: RosOptions,
    *,
    values: Mapping[str, str] | None = None,
    parameters: Sequence[Path] = (),
    options: Sequence[str] = (),
    ready_timeout: float,
    stop_order: int,
) -> ProcessSpec:
    """Return the process of a node that reports when it is ready."""
    program, *ros_arguments = node_argv(executable, find, values, parameters, ros)
    return ProcessSpec(
        name=name,
        argv=(program, *options, *ros_arguments),
        environment=ENVIRONMENT,
        notifies_ready=True,
        ready_timeout=ready_timeout,
        stop_order=stop_order,
    )


def state_publisher(
    parameters: Path, find: FindExecutable, ros: RosOptions, *, ready_timeout: float, order: int
) -> ProcessSpec | None:
    """Return the process of the state publisher; the bring-up continues if it ends.

    None if neither program is installed.
    """
    installed = (each for each in STATE_PUBLISHERS if find(each.package, each.name) is not None)
    executable = next(installed, None)
    if executable is None:
        return None
    values = {'publish_frequency': f'{TF_RATE}', **ros.frame_parameters}
    return ProcessSpec(
        name='robot_state',
        argv=node_argv(executable, find, values, (parameters,), ros),
        environment=ENVIRONMENT,
        notifies_ready=executable.notifies_ready,
        ready_timeout=ready_timeout,
        required=False,
        stop_order=order,
    )


def add_view(parser: argparse.ArgumentParser) -> None:
    """Declare ``--no-view``."""
    parser.add_argument(
        '--no-view',
        dest='view',
        action='store_false',
        default=os.environ.get(NO_VIEW, '') in {'', '0'},
        help='without the page on which the robot is seen, whose URL is printed (default: with '
        f'it, but where the variable {NO_VIEW} is 1)',
    )


def view_process(
    find: FindExecutable, ros: RosOptions, *, ready_timeout: float, stop_order: int
) -> ProcessSpec | None:
    """Return the process that serves the web page; the bring-up continues if it ends.

    None if it is not built.
    """
    if find(VIEWER.package, VIEWER.name) is None:
        return None
    return ProcessSpec(
        name='viewer',
        argv=(*VIEWER_NICENESS, *node_argv(VIEWER, find, ros.frame_parameters, ros=ros)),
        environment=ENVIRONMENT,
        notifies_ready=True,
        ready_timeout=ready_timeout,
        required=False,
        awaited=False,
        stop_order=stop_order,
        stop_steps=VIEWER_STOP_STEPS,
    )

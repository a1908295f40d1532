# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parts that all bring-ups share: exclusive use of a bus or port, and processes of nodes."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
import contextlib
import errno
import hashlib
import os
from pathlib import Path
from signal import Signals
import socket
import struct
import tempfile

from .exceptions import StartError
from .nodes import Executable, FindExecutable, LOG_FORMAT, node_argv, ros_domain
from .ros_options import RosOptions
from .spec import ProcessSpec, StopStep

_CREDENTIALS = struct.Struct('3i')  # struct ucred: process, user, group
_LONGEST_NAME = 100  # [byte] of the 107 that an abstract name may have

STATE_PUBLISHERS = (
    Executable('robot_state_publisher', 'robot_state_publisher', notifies_ready=False),
    Executable('robot_viewer', 'robot_state_publisher'),
)
"""The public one where ROS has it, else ours."""
TF_RATE = 100.0
"""Greatest rate of /tf in [Hz]; its default of 20 would halve what /joint_states has."""
VIEWER = Executable('robot_viewer', 'web_viewer')
"""Serves the page, and says its URL when it is ready."""
NO_VIEW = 'NO_VIEW'  # variable that leaves the page out, where it is neither empty nor 0
VIEWER_NICENESS = ('nice', '-n', '5')
"""Whatever moves the robot comes first, from the start of the program on."""
VIEWER_STOP_STEPS = (
    StopStep(Signals.SIGTERM, 10.0),
    StopStep(Signals.SIGABRT, 1.0),
    StopStep(Signals.SIGKILL, 1.0),
)
"""The viewer holds nothing that would have to be put down. On a busy computer Python takes
seconds to end."""


@contextlib.contextmanager
def exclusive(thing: str, remedy: str) -> Iterator[None]:
    """Hold a resource exclusively while the block runs.

    Args:
        thing: Name of the resource for the user: ``bus vcan0``.
        remedy: Alternative to name in the message: ``another bus with --can``.

    Raises:
        StartError: Another process holds it; the message names it.
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
    """Return whose socket it is; nothing when it has just been closed."""
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
    """Return the process of a node that reports when it is ready.

    Raises:
        StartError: The executable is missing.
    """
    program, *ros_arguments = node_argv(executable, find, values, parameters, ros)
    return ProcessSpec(
        name=name,
        argv=(program, *options, *ros_arguments),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=ready_timeout,
        stop_order=stop_order,
    )


def state_publisher(
    parameters: Path, find: FindExecutable, ros: RosOptions, *, ready_timeout: float, order: int
) -> ProcessSpec | None:
    """Return the process; the bring-up goes on without it when it ends.

    Returns:
        The process; None where neither program is installed.
    """
    installed = (each for each in STATE_PUBLISHERS if find(each.package, each.name) is not None)
    executable = next(installed, None)
    if executable is None:
        return None
    values = {'publish_frequency': f'{TF_RATE}', **ros.frame_parameters}
    return ProcessSpec(
        name='robot_state',
        argv=node_argv(executable, find, values, (parameters,), ros),
        environment=LOG_FORMAT,
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
    """Return the process that serves the page, without which the bring-up goes on.

    None where it is not built.
    """
    if find(VIEWER.package, VIEWER.name) is None:
        return None
    return ProcessSpec(
        name='viewer',
        argv=(*VIEWER_NICENESS, *node_argv(VIEWER, find, ros.frame_parameters, ros=ros)),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=ready_timeout,
        required=False,
        awaited=False,
        stop_order=stop_order,
        stop_steps=VIEWER_STOP_STEPS,
    )

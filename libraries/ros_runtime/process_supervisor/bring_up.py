# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the bring-ups of all robots have in common: their place, and processes of nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
import contextlib
import os
from pathlib import Path
import tempfile

from .exclusive import exclusive
from .nodes import Executable, FindExecutable, LOG_FORMAT, node_argv, ros_domain
from .ros_options import RosOptions
from .spec import ProcessSpec


@contextlib.contextmanager
def bring_up_place(package: str, ros: RosOptions) -> Iterator[Path]:
    """Hold a namespace of the ROS domain, and lend a temporary folder, as long as the block runs.

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

    Args:
        name: As in :class:`.ProcessSpec`, as the last two.
        executable: As in :func:`.node_argv`, as the next four.
        find: Finds executables.
        ros: Options of all nodes.
        values: ROS parameters.
        parameters: ROS parameter files.
        options: Arguments in front of those of ROS.
        ready_timeout: How long it may take to be ready in [s].
        stop_order: Those with a lower number are stopped before.

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

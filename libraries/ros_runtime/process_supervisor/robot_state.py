# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The process that makes /tf of a description and /joint_states."""

from __future__ import annotations

from pathlib import Path

from .nodes import Executable, FindExecutable, first_found, LOG_FORMAT, node_argv
from .ros_options import RosOptions
from .spec import ProcessSpec

STATE_PUBLISHERS = (
    Executable('robot_state_publisher', 'robot_state_publisher', notifies_ready=False),
    Executable('robot_viewer', 'robot_state_publisher'),
)
"""The public one where ROS has it, else ours."""
TF_RATE = 100.0
"""Greatest rate of /tf in [Hz]; its default of 20 would halve what /joint_states has."""


def state_publisher(
    parameters: Path, find: FindExecutable, ros: RosOptions, *, ready_timeout: float, order: int
) -> ProcessSpec | None:
    """Return the process; the bring-up goes on without it when it ends.

    Args:
        parameters: File of :func:`.write_parameters`, with the description.
        find: Finds executables.
        ros: Options of all nodes.
        ready_timeout: How long it may take to be ready in [s].
        order: Its ``stop_order``.

    Returns:
        The process; None where neither program is installed.
    """
    executable = first_found(STATE_PUBLISHERS, find)
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

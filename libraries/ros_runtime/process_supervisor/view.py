# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page on which the robot of a bring-up is seen: a process that the robot never waits for."""

from __future__ import annotations

import argparse
import os
from signal import Signals

from .nodes import Executable, FindExecutable, LOG_FORMAT, node_argv
from .ros_options import RosOptions
from .spec import ProcessSpec, StopStep

VIEWER = Executable('robot_viewer', 'web_viewer')
"""Serves the page, and says its URL when it is ready."""
OFF = 'NO_VIEW'
"""Variable that leaves the page out, where it is neither empty nor 0."""
POLITE = ('nice', '-n', '5')
"""Whatever moves the robot comes first, from the start of the program on."""
STOP_STEPS = (
    StopStep(Signals.SIGTERM, 3.0),
    StopStep(Signals.SIGABRT, 1.0),
    StopStep(Signals.SIGKILL, 1.0),
)
"""It holds nothing that would have to be put down."""


def add_view(parser: argparse.ArgumentParser) -> None:
    """Declare ``--no-view``."""
    parser.add_argument(
        '--no-view',
        dest='view',
        action='store_false',
        default=os.environ.get(OFF, '') in {'', '0'},
        help='without the page on which the robot is seen, whose URL is printed (default: with '
        f'it, but where the variable {OFF} is 1)',
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
        argv=(*POLITE, *node_argv(VIEWER, find, ros.frame_parameters, ros=ros)),
        environment=LOG_FORMAT,
        notifies_ready=True,
        ready_timeout=ready_timeout,
        required=False,
        awaited=False,
        stop_order=stop_order,
        stop_steps=STOP_STEPS,
    )

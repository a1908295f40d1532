# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_bringup bringup``: all processes of a quadruped with one command."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from process_supervisor import supervise, SupervisorError, USAGE_ERROR

from .exceptions import BringupError
from .session import add_arguments, session


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line.

    Args:
        argv: Arguments without the program's name; None takes those of the process.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run quad_bringup bringup',
        description='Bring a quadruped up: serial bridge, controller and /tf; with --simulate '
        'also the robot itself, in physics, on a pseudo-serial port. It stays as it is until it '
        'is told to stand up: by teleop_keyboard, or by /set_mode. Ctrl-C ends everything; the '
        'servos hold their last position then, so let it lie down before.',
    )
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument(
        '--simulate', action='store_true', help='start a simulated robot and use its port'
    )
    where.add_argument(
        '--port', metavar='PATH', help='serial port of the robot, e.g. /dev/ttyAMA0'
    )
    parser.add_argument(
        '--calibration',
        metavar='FILE',
        type=Path,
        help='parameters of the serial bridge, as "ros2 run quad_hardware calibrate" writes them',
    )
    add_arguments(parser)
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Bring a quadruped up and stay until it is to go down.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 when a process failed, 2 when nothing was started.
    """
    arguments = parse(argv)
    try:
        with session(arguments, arguments.port) as quad:
            sys.stdout.write(f'{quad.title}\n')
            return supervise(quad.processes).exit_code
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR

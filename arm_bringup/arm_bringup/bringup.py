# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup bringup``: all processes of an arm with one command."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import sys

from process_supervisor import supervise, SupervisorError, USAGE_ERROR

from .exceptions import BringupError
from .session import add_arguments, REAL_BUS, robots_epilog, session, SIMULATED_BUS
from .stack import MASTER


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line.

    Args:
        argv: Arguments without the program's name; None takes those of the process.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run arm_bringup bringup',
        description='Bring an arm up: CANopen master with all its drives and /joint_states; '
        'with --simulate also the drives themselves. Ctrl-C stops and disables the drives and '
        'ends everything.',
        epilog=robots_epilog(),
    )
    default_bus = f'{REAL_BUS}; with --simulate {SIMULATED_BUS}, which is vcan0 when it is there'
    add_arguments(parser, default_bus=default_bus)
    parser.add_argument(
        '--simulate',
        action='store_true',
        help='start a simulated drive for each device of the bus',
    )
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Bring an arm up and stay until it is to go down.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 when a process failed, 2 when nothing was started.
    """
    arguments = parse(argv)
    try:
        with session(arguments, simulate=arguments.simulate, master=MASTER) as arm:
            sys.stdout.write(f'{arm.robot.name} on CAN bus {arm.bus}\n')
            return supervise(arm.processes).exit_code
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR

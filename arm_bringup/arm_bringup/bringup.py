# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup bringup``: all processes of an arm with one command."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
import sys

from .exceptions import BringupError
from .session import add_arguments, REAL_BUS, robots_epilog, session, SIMULATED_BUS
from .stack import Executable
from .supervisor import Notice, Outcome, ProcessSpec, Runner, Severity
from .terminal import LineWriter, Painter, wants_colour

USAGE_ERROR = 2
"""Exit code when nothing was started."""


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


def supervise(processes: Sequence[ProcessSpec]) -> Outcome:
    """Run processes with their output on standard output, until Ctrl-C or one ends.

    Args:
        processes: What to run.

    Returns:
        How it ended.
    """
    names = [spec.name for spec in processes]
    painter = Painter('bringup', names, wants_colour(sys.stdout, os.environ))
    write = LineWriter(sys.stdout)
    with Runner(
        processes,
        lambda name, line: write(painter.line(name, line)),
        lambda notice: write(painter.notice(notice)),
    ) as runner:
        outcome = runner.run()
    if outcome.exit_code:
        write(painter.notice(Notice(Severity.ERROR, explain(outcome))))
    return outcome


def explain(outcome: Outcome) -> str:
    """Say why a bring-up failed, with what the process wrote last.

    Args:
        outcome: How it ended.
    """
    if not outcome.last_lines:
        return outcome.reason
    quoted = '\n'.join(f'    {line}' for line in outcome.last_lines)
    return f'{outcome.reason}; it wrote last:\n{quoted}'


def main(argv: Sequence[str] | None = None) -> int:
    """Bring an arm up and stay until it is to go down.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 when a process failed, 2 when nothing was started.
    """
    arguments = parse(argv)
    master = Executable('arm_canopen', 'master')
    try:
        with session(arguments, simulate=arguments.simulate, master=master) as arm:
            sys.stdout.write(f'{arm.robot.name} on CAN bus {arm.bus}\n')
            return supervise(arm.processes).exit_code
    except BringupError as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR

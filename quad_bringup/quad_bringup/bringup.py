# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_bringup bringup``: all processes of a quadruped with one command."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
import sys

from process_supervisor import (
    parse_with_ros,
    RosOptions,
    supervise,
    SupervisorError,
    USAGE_ERROR,
)

from .exceptions import BringupError
from .shutdown import leave
from .stack import add_arguments, session

HINT = """in a second terminal:
    ros2 run quad_teleop teleop_keyboard{hint}
    ros2 service call {set_mode} quad_msgs/srv/SetMode "{{mode: stand}}\""""
"""What to do with a robot that has been brought up."""


def parse(argv: Sequence[str]) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line.

    Returns:
        What was requested, and the options of all nodes.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run quad_bringup bringup',
        description='Bring a quadruped up: serial bridge, controller and /tf; with --simulate '
        'also the robot itself, in physics, on a pseudo-serial port. It stays as it is until a '
        'mode is requested, by teleop_keyboard or /set_mode. Ctrl-C lets it lie down and '
        'ends everything; Ctrl-C again ends it at once, and the servos hold their last position '
        '(the bridge folds legs that were walking).',
        allow_abbrev=False,
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
    parser.add_argument(
        '--hold',
        action='store_true',
        help='at Ctrl-C let the robot end its gait and the servos hold it standing, '
        'instead of lying down first',
    )
    add_arguments(parser)
    return parse_with_ros(parser, argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Bring a quadruped up and stay until it is to go down.

    Returns:
        0 after Ctrl-C or SIGTERM, 1 when a process failed, 2 when nothing was started.
    """
    arguments, ros = parse(sys.argv[1:] if argv is None else argv)
    try:
        with session(arguments, ros, arguments.port) as quad:
            hint = HINT.format(hint=ros.hint, set_mode=ros.resolve('set_mode'))
            sys.stdout.write(f'{quad.title}\n{hint}\n')
            shutdown = partial(leave, namespace=ros.namespace, hold=arguments.hold)
            return supervise(quad.processes, shutdown=shutdown).exit_code
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR

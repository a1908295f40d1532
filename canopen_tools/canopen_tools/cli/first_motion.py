# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen first-motion``: one joint, a little way, slowly, while a key is held."""

from __future__ import annotations

import argparse
from pathlib import Path

from first_motion import JointKind, Quantity, read_quantity

from .arguments import add_bus_argument, SubParsers, UsageError

DISTANCE = '1deg'
SPEEDS = {JointKind.TURNS: '0.5deg', JointKind.SLIDES: '1mm'}
"""Per second: slow enough to release a key in time, whatever the scale is by a factor of ten."""


def add_parser(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'first-motion',
        help='move a joint a little way while a key is held; finds a wrong sign or scale',
        description='Move one joint of a new robot a little way, slowly, while the space bar is '
        'held, ask what you saw, and find a wrong sign or scale of bus.yml. Releasing the key '
        'halts; errors, Ctrl-C and a closed terminal stop and disable the drive. It is the master '
        'of the bus for that time. Exit code: 0 when the joint moved as it should, 1 when not, 2 '
        'wrong usage, 130 interrupted.',
        epilog='example: canopen first-motion bus.yml shoulder --can can0 --distance 2deg',
    )
    add = parser.add_argument
    add('bus_yml', metavar='BUS.yml', type=Path)
    add('joint', metavar='JOINT', help='a drive of bus.yml, or one of its channels')
    add_bus_argument(parser)
    add(
        '--distance',
        metavar='FAR',
        type=_quantity,
        default=read_quantity(DISTANCE),
        help='1deg, 0.02rad or, for a joint that slides, 2mm; --distance=-1deg goes the other '
        f'way (default: {DISTANCE})',
    )
    add(
        '--speed',
        metavar='FAST',
        help='speed in the same units per second (default: '
        f'{SPEEDS[JointKind.TURNS]}, {SPEEDS[JointKind.SLIDES]})',
    )
    add(
        '--write',
        action='store_true',
        help='change bus.yml without asking where one cause alone fits',
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Move the joint; return the exit code."""
    try:  # terminal and master are loaded for this verb alone
        from ..first_motion.motion import Request
        from ..first_motion.program import run as run_motion
    except ModuleNotFoundError as error:
        if error.name != 'operator_input':
            raise
        raise UsageError(
            'first-motion reads the keyboard by operator_input, which is not installed: '
            "pip install './canopen_tools[first_motion]', or make build for `ros2 run`"
        ) from error
    distance: Quantity = options.distance
    try:
        speed = read_quantity(options.speed or SPEEDS[distance.kind], distance.kind)
    except ValueError as error:
        raise UsageError(f'--speed: {error}') from error
    request = Request(options.bus_yml, options.joint, options.can, distance, speed, options.write)
    return run_motion(request)


def _quantity(text: str) -> Quantity:
    try:
        return read_quantity(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_description urdf``: the URDF on standard output, for other tools."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import sys

from urdf_reader import DescriptionError

from .presets import PRESETS, robot_urdf


def run(argv: Sequence[str] | None = None) -> int:
    """Print the URDF that the arguments request; return the exit code."""
    parser = argparse.ArgumentParser(
        description='Print the URDF of the quadruped.', allow_abbrev=False
    )
    parser.add_argument('--preset', default='lite', choices=PRESETS, help='the robot')
    parser.add_argument('--arm', action='store_true', help='with the arm on its back')
    parser.add_argument(
        '--trunk-mass', type=float, metavar='KG', help="mass of the trunk instead of the preset's"
    )
    parser.add_argument(
        '--base-footprint',
        action='store_true',
        help='with that frame on a floating joint, as /robot_description has it',
    )
    options = parser.parse_args(argv)
    try:
        urdf = robot_urdf(
            options.preset,
            options.arm,
            options.trunk_mass,
            base_footprint=options.base_footprint,
        )
    except DescriptionError as error:
        sys.stderr.write(f'urdf: {error}\n')
        return 2
    sys.stdout.write(urdf + '\n')
    return 0


def main() -> None:
    """Entry point."""
    sys.exit(run())


if __name__ == '__main__':
    main()

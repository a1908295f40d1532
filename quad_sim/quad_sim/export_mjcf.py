# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``export_mjcf``: writes the simulated robot as a MuJoCo model."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from quad_description import DescriptionError, PRESETS, robot_urdf

from .exceptions import SetupError
from .plant import parse_servo


def run(arguments: Sequence[str]) -> int:
    """Write the robot as MJCF; return the exit code."""
    parser = argparse.ArgumentParser(
        description='Write the simulated robot as MJCF, for trainers that simulate it themselves.',
        allow_abbrev=False,
    )
    parser.add_argument('path', type=Path, help='file to write')
    parser.add_argument('--preset', choices=list(PRESETS), default='lite', help='the robot')
    parser.add_argument('--servo', default='nominal', help='as of fake_xgo')
    parser.add_argument('--floor', action='store_true', help='with level ground')
    options = parser.parse_args(arguments)
    try:
        from .physics import Robot

        robot = Robot(robot_urdf(options.preset), parse_servo(options.servo))
        text = robot.mjcf(floor=options.floor)
        options.path.write_text(text, encoding='utf-8')
    except (DescriptionError, SetupError, OSError) as error:
        sys.stderr.write(f'export_mjcf: {error}\n')
        return 1
    sys.stdout.write(f'{options.path}: {options.preset} with {options.servo} servos\n')
    return 0


def main() -> None:
    """Entry point."""
    sys.exit(run(sys.argv[1:]))


if __name__ == '__main__':
    main()

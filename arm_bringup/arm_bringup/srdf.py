# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_planning srdf``: create or update the SRDF of a robot, with a report."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from process_supervisor import USAGE_ERROR

from .robots import BringupError, expand_xacro, read_description, read_semantic
from .session import add_robot, locate, robots_epilog

MIN_SAMPLES = 1000  # least number of poses; with fewer, `never` would be unreliable


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(
        prog='ros2 run arm_planning srdf',
        description='Make the SRDF of a robot folder, a URDF or a xacro file: groups from chains, '
        'pairs of links by sampling, a pose ready. What an SRDF of the folder has is kept; its '
        'pairs are sampled anew, but for those whose reason begins with User. The SRDF is '
        'printed, the report goes to stderr.',
        epilog=robots_epilog(),
        allow_abbrev=False,
    )
    add_robot(parser)
    parser.add_argument(
        '--samples',
        type=_samples,
        metavar='N',
        help=f'poses that are drawn, {MIN_SAMPLES} at least (default: 20000)',
    )
    parser.add_argument(
        '--output', type=Path, metavar='FILE', help='write the SRDF there (default: print it)'
    )
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Create or update the SRDF; return 0, or 2 if the robot is missing or unusable."""
    from arm_model import ArmError, load_limits
    from arm_planning import make_srdf, SRDF_SAMPLES

    arguments = parse(sys.argv[1:] if argv is None else argv)
    limits = None
    try:
        file = Path(arguments.robot)
        if file.is_file():
            urdf, previous, folder = _read(file, dict(arguments.xacro_arg)), '', file.parent
        else:
            robot = locate(arguments)
            urdf, folder = read_description(robot), robot.folder
            previous = read_semantic(robot) if robot.semantic.is_file() else ''
            limits = load_limits(robot.limits) if robot.limits.is_file() else None
        draft = make_srdf(urdf, previous, limits, arguments.samples or SRDF_SAMPLES, folder)
        if arguments.output is None:
            sys.stdout.write(draft.text)
        else:
            arguments.output.write_text(draft.text, encoding='utf-8')
    except (ArmError, BringupError, OSError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR
    sys.stderr.write(''.join(f'{line}\n' for line in draft.report))
    return 0


def _read(file: Path, arguments: dict[str, str]) -> str:
    return (
        expand_xacro(file, arguments)
        if file.suffix == '.xacro'
        else file.read_text(encoding='utf-8')
    )


def _samples(text: str) -> int:
    if not text.isdecimal() or int(text) < MIN_SAMPLES:
        raise argparse.ArgumentTypeError(f'{text!r} is no number from {MIN_SAMPLES}')
    return int(text)

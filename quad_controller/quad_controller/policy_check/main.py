# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Command line of ``check_policy``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import math
import sys

from quad_description import PRESETS, robot_urdf

from ..exceptions import QuadControllerError
from ..gait.generator import GaitGenerator
from ..gait.parameters import GaitParameters
from ..gait.velocity import Velocity
from ..model.quadruped import quadruped
from ..policy.load import load_policy
from ..policy.options import GravitySource, ImuFrame, PolicyOptions
from ..policy.shipped import find_policy
from ..states.parameters import StateParameters
from .walk import SERVOS, walk


def run(arguments: Sequence[str]) -> int:
    """Check a policy and print what was found; return 0 when it may be followed."""
    options = _parser().parse_args(arguments)
    urdf = robot_urdf(options.preset, arm=options.arm)
    robot = quadruped(urdf)
    try:
        loaded = load_policy(
            find_policy(options.policy),
            robot,
            GaitGenerator(robot, GaitParameters()).stand_targets,
            PolicyOptions(
                phase_period=options.phase_period,
                imu_frame=ImuFrame(options.imu_frame),
                gravity_source=GravitySource(options.gravity_source),
                hold_missing=options.hold_missing,
            ),
            StateParameters().period,
        )
        _print(str(loaded))
        if options.walk is None:
            return 0
        velocity = Velocity(*options.walk)
        walked = walk(urdf, loaded.runner, velocity, options.duration, options.servo)
    except QuadControllerError as error:
        _print(str(error))
        return 1
    _print(
        f'walked with {options.servo} servos for {options.duration:g} s: commanded '
        f'{_text(velocity)}, went {_text(walked.velocity)}, '
        f'tilt at most {math.degrees(walked.tilt):.1f} deg'
    )
    if walked.trouble:
        _print(f'it did not go well: {walked.trouble}')
    return 1 if walked.trouble else 0


def main() -> None:
    """Entry point."""
    sys.exit(run(sys.argv[1:]))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='check_policy',
        description='Compare an ONNX policy with the robot, and let it walk in physics.',
    )
    parser.add_argument('policy', help='ONNX file, or the name of one that is shipped')
    parser.add_argument('--preset', choices=list(PRESETS), default='lite', help='the robot')
    parser.add_argument('--arm', action='store_true', help='the robot has its arm')
    parser.add_argument(
        '--phase-period', type=float, default=0.0, help='[s]; 0: what the file says'
    )
    parser.add_argument('--imu-frame', choices=[each.value for each in ImuFrame], default='auto')
    parser.add_argument(
        '--gravity-source', choices=[each.value for each in GravitySource], default='blend'
    )
    parser.add_argument('--hold-missing', action='store_true', help='joints that are lacking')
    parser.add_argument(
        '--walk', nargs=3, type=float, metavar=('X', 'Y', 'YAW'), help='[m/s], [m/s], [rad/s]'
    )
    parser.add_argument('--servo', choices=SERVOS, default=SERVOS[0], help='of the simulation')
    parser.add_argument('--duration', type=float, default=10.0, help='of the walk [s]')
    return parser


def _text(velocity: Velocity) -> str:
    return f'{velocity.x:+.3f} {velocity.y:+.3f} m/s {velocity.yaw:+.2f} rad/s'


def _print(text: str) -> None:
    sys.stdout.write(f'{text}\n')


if __name__ == '__main__':
    main()

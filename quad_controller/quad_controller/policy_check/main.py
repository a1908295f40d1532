# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Command line of ``check_policy``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import math
from pathlib import Path
import signal
import sys

from quad_description import Backend, DescriptionError, PRESETS, quadruped, robot_urdf

from ..exceptions import QuadControllerError
from ..gait.generator import GaitGenerator
from ..gait.parameters import GaitParameters
from ..gait.velocity import Velocity
from ..policy.load import load_policy
from ..policy.options import GravitySource, ImuFrame, PolicyOptions
from ..policy.shipped import find_policy
from ..states.parameters import StateParameters
from .walk import walk

SERVOS = ('firm', 'vendor_rl')
"""Servo models of the simulation; policies of the vendor's training expect ``vendor_rl``."""

MIN_DURATION, MAX_DURATION = 0.5, 600.0
"""Times of a walk in [s]."""
MIN_RATIO = 0.5
"""Share of the commanded way below which a policy does not walk."""
REACH = 0.1
"""Distance of a foot from the middle in [m], which weighs turning beside walking."""


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
                contract=options.contract,
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
        with _physics(urdf, options.servo) as backend:
            walked = walk(backend, robot, loaded.runner, velocity, options.duration)
    except (QuadControllerError, DescriptionError) as error:
        _print(str(error))
        return 1
    _print(
        f'walked with {options.servo} servos for {options.duration:g} s: commanded '
        f'{_text(velocity)}, went {_text(walked.velocity)}, '
        f'tilt at most {math.degrees(walked.tilt):.1f} deg'
    )
    trouble = walked.trouble
    if not trouble and (share := _share(walked.velocity, velocity)) < MIN_RATIO:
        trouble = f'it went {100 * share:.0f} % of its way; is it made for other servos (--servo)?'
    if trouble:
        _print(f'it did not go well: {trouble}')
    return 1 if trouble else 0


def main() -> None:
    """Entry point."""
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.exit(run(sys.argv[1:]))


def _physics(urdf: str, servo: str) -> Backend:
    try:
        from quad_sim import ServoModel
        from quad_sim.physics import PhysicsBackend, Robot
    except ImportError as error:
        raise QuadControllerError(f'a walk needs quad_sim and MuJoCo: {error}') from error
    return PhysicsBackend(Robot(urdf, ServoModel(servo)))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description='Compare an ONNX policy with the robot, and let it walk in physics.',
        allow_abbrev=False,
    )
    parser.add_argument('policy', help='ONNX file, or the name of one that is shipped')
    parser.add_argument('--preset', choices=list(PRESETS), default='lite', help='the robot')
    parser.add_argument('--arm', action='store_true', help='the robot has its arm')
    parser.add_argument(
        '--contract',
        type=Path,
        metavar='FILE',
        help='contract of the policy: YAML, deploy.yaml, env.yaml, config.yaml, config.json',
    )
    parser.add_argument('--phase-period', type=_time, default=0.0, help='[s]; 0: that of the file')
    parser.add_argument(
        '--imu-frame',
        choices=[each.value for each in ImuFrame],
        default='auto',
        help='of the angular velocity (policy_imu_frame); needed where the file does not have it',
    )
    parser.add_argument(
        '--gravity-source', choices=[each.value for each in GravitySource], default='blend'
    )
    parser.add_argument(
        '--hold-missing',
        action='store_true',
        help='accept a robot without some joints of the policy',
    )
    parser.add_argument(
        '--walk', nargs=3, type=_finite, metavar=('X', 'Y', 'YAW'), help='[m/s], [m/s], [rad/s]'
    )
    parser.add_argument('--servo', choices=SERVOS, default=SERVOS[0], help='of the simulation')
    parser.add_argument('--duration', type=_duration, default=10.0, help='of the walk [s]')
    return parser


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f'{text} is not a finite number')
    return value


def _time(text: str) -> float:
    value = _finite(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError(f'{text} is not a time in [s]: it must be 0 or more')
    return value


def _duration(text: str) -> float:
    value = _finite(text)
    if not MIN_DURATION <= value <= MAX_DURATION:
        raise argparse.ArgumentTypeError(
            f'{text} is not a duration [s]: it must be {MIN_DURATION:g} to {MAX_DURATION:g}'
        )
    return value


def _share(went: Velocity, commanded: Velocity) -> float:
    """Return which share of what was commanded was gone; 1 where nothing was."""
    pairs = [
        (went.x, commanded.x),
        (went.y, commanded.y),
        (went.yaw * REACH, commanded.yaw * REACH),
    ]
    asked = sum(want**2 for _, want in pairs)
    return sum(got * want for got, want in pairs) / asked if asked else 1.0


def _text(velocity: Velocity) -> str:
    return f'{velocity.x:+.3f} {velocity.y:+.3f} m/s {velocity.yaw:+.2f} rad/s'


def _print(text: str) -> None:
    sys.stdout.write(f'{text}\n')


if __name__ == '__main__':
    main()

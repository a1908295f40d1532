# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Command line of ``check_policy``."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
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
MAX_LACK, MAX_EXCESS = 0.5, 0.2
"""Shares of what is commanded along an axis that may be missing, and be too much."""
MAX_DRIFT = Velocity(0.04, 0.04, 0.1)
"""What a policy may be off along an axis in any case in [m/s] and [rad/s]."""


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
    trouble = walked.trouble or '; '.join(_astray(walked.velocity, velocity))
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


def _astray(went: Velocity, commanded: Velocity) -> Iterator[str]:
    """Yield along which axes it went otherwise than commanded, and what that hints at."""
    for axis in ('x', 'y', 'yaw'):
        got, want, drift = (getattr(each, axis) for each in (went, commanded, MAX_DRIFT))
        most = MAX_EXCESS if got * want > want**2 else MAX_LACK
        if abs(got - want) <= max(most * abs(want), drift):
            continue
        if got * want < 0.0:
            hint = 'the other way: look at the order of its joints, and at signs (scales below 0)'
        elif abs(got) < abs(want):
            hint = 'too slow: is it made for other servos (--servo), or a smaller scale?'
        else:
            hint = 'too far: look at its scales, and at the frame of the IMU'
        yield f'{axis} went {got:+.3f} of {want:+.3f}, {hint}'


def _text(velocity: Velocity) -> str:
    return f'{velocity.x:+.3f} {velocity.y:+.3f} m/s {velocity.yaw:+.2f} rad/s'


def _print(text: str) -> None:
    sys.stdout.write(f'{text}\n')


if __name__ == '__main__':
    main()

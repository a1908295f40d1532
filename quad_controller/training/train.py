# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trains, checks and benchmarks a walking policy: ``make train`` runs it.

It fine-tunes a policy with PPO on randomized servos, ground and sensors. The folder that it
prints contains the policy with its contract (walk.onnx), TensorBoard curves and figures.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import sys
import time

from progress import Progress

from quad_controller.exceptions import PolicyError
from quad_controller.policy.load import find_policy
from quad_controller.policy_check.main import MAX_DURATION, MIN_DURATION, number
from quad_controller.policy_check.main import run as check_policy
from quad_description import run_command

SERVO = 'nominal'  # what it is checked with
WALKS = ((0.2, 0.0, 0.3), (0.0, 0.1, 0.0), (-0.15, 0.0, -0.5))
"""Velocities that a policy has to walk: x, y in [m/s], yaw in [rad/s]."""


def run(arguments: Sequence[str]) -> int:
    """Train; return 0 if the new policy passes the check."""
    options = _parser().parse_args(arguments)
    # a library for a graphics card would only warn that there is none
    os.environ.setdefault('JAX_PLATFORMS', 'cpu')
    try:
        from practice import train
    except ImportError as error:
        sys.stdout.write(f'{error}; `make train` installs what a training needs\n')
        return 1
    folder: Path = options.output or Path('trained') / time.strftime('walk-%Y%m%d-%H%M%S')
    folder.mkdir(parents=True, exist_ok=True)
    progress = Progress(options.minutes)
    progress.say(f'{options.minutes:g} min, seed {options.seed}: {folder}')
    progress.say(f'curves: tensorboard --logdir {folder}')
    path = folder / 'walk.onnx'
    try:
        start = find_policy(options.start)
        settings = {name: getattr(options, name) for name in ('seed', 'environments', 'share')}
        train(start, path, progress, **settings)
    except PolicyError as error:
        progress.say(str(error))
        return 1
    return _judge(path, progress, options.way)


def _judge(path: Path, progress: Progress, duration: float) -> int:
    """Compare a policy with the gait, this long [s] per command; return its exit code."""
    code = max(_check(path, progress, walk) for walk in WALKS)
    figures = ['--duration', f'{duration:g}', '--report', str(path.with_name('figures.csv'))]
    check_policy([str(path), '--servo', SERVO, '--compare', *figures])
    progress.say(f'{path}; check_policy: {"refused" if code else "accepted"}')
    return code


def _check(path: Path, progress: Progress, walk: Sequence[float]) -> int:
    words = [str(path), '--servo', SERVO, '--walk', *map(str, walk)]
    progress.say(f'check_policy {" ".join(words)}')
    return check_policy(words)


def main() -> None:
    """Entry point."""
    run_command(run)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description='Train a policy, check it and compare it.', allow_abbrev=False
    )
    parser.add_argument(
        '--minutes', type=number('time [min]', 0.01), default=30.0, help='how long it learns'
    )
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--environments', type=int, default=64, help='at once')
    parser.add_argument(
        '--from',
        dest='start',
        default='trot_ppo',
        metavar='POLICY',
        help='ONNX file of this training, or a name that is shipped; default: %(default)s',
    )
    parser.add_argument(
        '--share',
        type=number('share', 0.0, 1.0),
        default=0.3,
        help='of what differs, at the beginning; 1 to go on with a policy of this training',
    )
    # check_policy would refuse another one after the training
    duration = number('time in [s]', MIN_DURATION, MAX_DURATION)
    parser.add_argument('--way', type=duration, default=4.0, help='of each command compared [s]')
    parser.add_argument('--output', type=Path, metavar='FOLDER', help='for policy and curves')
    return parser


if __name__ == '__main__':
    main()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trains a policy that walks, checks it, and compares it with the gait: ``make train`` calls it.

It begins with an imitation of the gait and goes on with PPO. The folder that it prints has the
policy with its contract, the curves for TensorBoard, and the figures.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import math
import os
from pathlib import Path
import shutil
import signal
import sys
import time

from comparison import best, compare, table
from progress import Progress

from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.policy.shipped import shipped_policies
from quad_controller.policy_check.main import run as check_policy
from quad_controller.policy_check.trial import Candidate

TASKS = ('walk',)
CHECKED_WALKS = ((0.2, 0.0, 0.3), (0.0, 0.1, 0.0), (-0.15, 0.0, -0.5))
"""Velocities with which check_policy lets it walk: x, y in [m/s], yaw in [rad/s]."""
GAIT, LOW_GAIT = 'gait', 'gait, low and wide'


def run(arguments: Sequence[str]) -> int:
    """Train; return 0 when check_policy accepts what came of it."""
    options = _parser().parse_args(arguments)
    # a library for a graphics card would only warn that there is none
    os.environ.setdefault('JAX_PLATFORMS', 'cpu')
    try:
        from imitation import Lessons
        from learning import Plan, train
    except ImportError as error:
        sys.stdout.write(f'{error}; `make train` installs what a training needs\n')
        return 1
    folder: Path = options.output or Path('trained') / time.strftime(
        f'{options.task}-%Y%m%d-%H%M%S'
    )
    folder.mkdir(parents=True, exist_ok=True)
    progress = Progress(options.minutes, time.monotonic)
    progress.say(f'{options.task}, {options.minutes:g} min, seed {options.seed}: {folder}')
    progress.say(f'curves: tensorboard --logdir {folder}')
    plan = Plan(options.seed, options.environments, Lessons(options.rounds))
    policies = train(folder, plan, progress)
    return judge(folder, policies, progress, options.way)


def judge(folder: Path, policies: dict[str, Path], progress: Progress, way: float) -> int:
    """Compare what was made with the gait and what is shipped; check the better one.

    Args:
        folder: For figures, and the policy that is better.
        policies: Those that were made, by their names.
        progress: Says what is found.
        way: Time of each way of the comparison in [s].

    Returns:
        What check_policy returns.
    """
    progress.say('comparing ...')
    walkers = {GAIT: Candidate(), LOW_GAIT: Candidate(gait=LOW_AND_WIDE)}
    walkers |= {name: Candidate(path) for name, path in (shipped_policies() | policies).items()}
    compared = compare(walkers, way)
    text = table(compared)
    (folder / 'figures.txt').write_text(f'{text}\n', encoding='utf-8')
    chosen = best({name: compared[name] for name in policies})
    path = folder / 'walk.onnx'
    shutil.copyfile(policies[chosen], path)
    code = 0
    for walk in CHECKED_WALKS:
        progress.say(f'check_policy {path} --walk {" ".join(map(str, walk))}')
        code = max(code, check_policy([str(path), '--walk', *map(str, walk)]))
    progress.say(text)
    verdict = 'accepted' if code == 0 else 'refused'
    progress.say(f'{path} is what {chosen} made; check_policy: {verdict}')
    return code


def main() -> None:
    """Entry point."""
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        sys.exit(run(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description='Train a policy, check it and compare it with the gait.', allow_abbrev=False
    )
    parser.add_argument('--task', choices=TASKS, default=TASKS[0])
    parser.add_argument('--minutes', type=_positive, default=30.0, help='how long it learns')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--environments', type=int, default=64, help='at once')
    parser.add_argument('--rounds', type=int, default=6, help='of the imitation')
    parser.add_argument('--way', type=_positive, default=15.0, help='of the comparison [s]')
    parser.add_argument('--output', type=Path, metavar='FOLDER', help='for policy and curves')
    return parser


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f'{text} is not above 0')
    return value


if __name__ == '__main__':
    main()

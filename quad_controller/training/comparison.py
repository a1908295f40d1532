# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Policies and the gait on the same ways in physics: figures, and which policy is better."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
import shutil

from progress import Progress

from quad_controller import Velocity
from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.policy.report import table_text
from quad_controller.policy_check.arenas import (
    AS_MADE,
    Conditions,
    RobotChoice,
    TIPPING_PUSH,
)
from quad_controller.policy_check.course import CourseFigures, Passage
from quad_controller.policy_check.main import run as check_policy
from quad_controller.policy_check.trial import Candidate, run_trials, shipped_walkers, Trial

SERVO = 'firm'  # what it is trained with
CHANCE = 0.25  # share of the falls that may be chance

GAIT, LOW_GAIT = 'gait', 'gait, low and wide'
CHECKED_WALKS = ((0.2, 0.0, 0.3), (0.0, 0.1, 0.0), (-0.15, 0.0, -0.5))
"""Velocities with which check_policy lets it walk: x, y in [m/s], yaw in [rad/s]."""

COMMANDS = (
    Velocity(0.1),
    Velocity(0.2),
    Velocity(0.3),
    Velocity(-0.2),
    Velocity(0.0, 0.1),
    Velocity(yaw=1.0),
    Velocity(0.2, 0.0, 0.5),
)

GROUNDS = {
    'level': AS_MADE,
    'pushed': Conditions(push=TIPPING_PUSH),
    '20 % heavier, smooth ground': Conditions(trunk_mass=1.2, friction=0.4),
}

SEEDS = (1, 2, 3, 4)
"""Of the pushes: falls of one seed are too few to compare."""

Results = Mapping[str, Mapping[str, CourseFigures]]
"""By the name of the walker and the title of the ground."""


def compare(
    walkers: Mapping[str, Candidate],
    duration: float,
    seeds: tuple[int, ...] = SEEDS,
    grounds: Mapping[str, Conditions] = GROUNDS,
    commands: tuple[Velocity, ...] = COMMANDS,
) -> dict[str, dict[str, CourseFigures]]:
    """Run walkers in each direction for a time in [s] on all grounds, on all cores.

    Where nobody is pushed, the first of the seeds is enough.

    Raises:
        CheckError: The physics failed.
        PolicyError: A policy does not fit the robot.
    """
    ways = {
        (name, title, seed): Trial(who, commands, duration, ground, seed)
        for name, who in walkers.items()
        for title, ground in grounds.items()
        for seed in (seeds if ground.push else seeds[:1])
    }
    found = dict(zip(ways, run_trials(list(ways.values())), strict=True))
    passages: dict[str, dict[str, tuple[Passage, ...]]] = {
        name: dict.fromkeys(grounds, ()) for name in walkers
    }
    for (name, title, _), figures in found.items():
        passages[name][title] += figures.passages
    return {
        name: {title: CourseFigures(each) for title, each in ways.items()}
        for name, ways in passages.items()
    }


def best(compared: Results) -> str:
    """Return the name of the one that falls least often; of equals the one that is least off.

    Falls of two walkers that differ by less than a quarter are equal: that is chance.
    """
    falls = {
        name: sum(each.falls_per_minute for each in found.values())
        for name, found in compared.items()
    }
    most = min(falls.values()) / (1.0 - CHANCE) + 1.0
    equals = [name for name in compared if falls[name] <= most]
    return min(
        equals, key=lambda name: sum(each.mean('error') for each in compared[name].values())
    )


def table(compared: Results) -> str:
    """Return the figures as a table for people."""
    rows = [('', 'ground', 'off [m/s]', 'turning off [rad/s]', 'falls in a minute')]
    for name, grounds in compared.items():
        for title, each in grounds.items():
            turning = f'{each.mean("turning_error"):.3f}'
            rows.append(
                (name, title, f'{each.mean("error"):.3f}', turning, f'{each.falls_per_minute:.1f}')
            )
    return table_text(rows)


def judge(folder: Path, policies: Mapping[str, Path], progress: Progress, duration: float) -> int:
    """Compare what was made with the gait and what is shipped; check the better one.

    Args:
        folder: For figures, and the policy that is better.
        policies: Files of those that were made, by their names.
        duration: Of each way in [s].

    Returns:
        What check_policy returns.
    """
    progress.say('comparing ...')
    walkers = {GAIT: Candidate(), LOW_GAIT: Candidate(gait=LOW_AND_WIDE)}
    walkers |= shipped_walkers() | {name: Candidate(path) for name, path in policies.items()}
    trained_on = RobotChoice(servo=SERVO)
    walkers = {name: replace(who, robot=trained_on) for name, who in walkers.items()}
    compared = compare(walkers, duration)
    text = table(compared)
    (folder / 'figures.txt').write_text(f'{text}\n', encoding='utf-8')
    chosen = best({name: compared[name] for name in policies})
    path = folder / 'walk.onnx'
    shutil.copyfile(policies[chosen], path)
    code = 0
    for walk in CHECKED_WALKS:
        progress.say(f'check_policy {path} --walk {" ".join(map(str, walk))}')
        code = max(code, check_policy([str(path), '--servo', SERVO, '--walk', *map(str, walk)]))
    progress.say(text)
    verdict = 'accepted' if code == 0 else 'refused'
    progress.say(f'{path} is what {chosen} made; check_policy: {verdict}')
    return code

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Policies and the gait on the same ways in physics, with figures that can be compared."""

from __future__ import annotations

from collections.abc import Mapping

from quad_controller.gait.velocity import Velocity
from quad_controller.policy_check.conditions import AS_MADE, Conditions, TIPPING_PUSH
from quad_controller.policy_check.course import CourseFigures
from quad_controller.policy_check.trial import Candidate, run_trials, Trial

CHANCE = 0.25  # share of the falls that may be chance

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
    """Let walkers walk, on all cores.

    Args:
        walkers: Who walks, by their names.
        duration: Of each way in [s].
        seeds: Of the pushes; the same for all. Where nobody is pushed, the first one is enough.
        grounds: What differs, by a title for people.
        commands: One after the other.

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
    return {name: {title: _all(found, name, title) for title in grounds} for name in walkers}


def _all(
    found: Mapping[tuple[str, str, int], CourseFigures], name: str, title: str
) -> CourseFigures:
    """Return what came of a walker on a ground with all seeds."""
    return CourseFigures(
        tuple(
            passage
            for (who, where, _), figures in found.items()
            if (who, where) == (name, title)
            for passage in figures.passages
        )
    )


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
    return min(equals, key=lambda name: sum(each.error for each in compared[name].values()))


def table(compared: Results) -> str:
    """Return the figures as a table for people."""
    width = max(map(len, compared))
    lines = [f'{"":{width}}  {"ground":28} off [m/s]  turning off [rad/s]  falls in a minute']
    for name, grounds in compared.items():
        lines += [
            f'{name:{width}}  {title:28} {each.error:9.3f}  {each.mean("turning_error"):19.3f}  '
            f'{each.falls_per_minute:17.1f}'
            for title, each in grounds.items()
        ]
    return '\n'.join(lines)

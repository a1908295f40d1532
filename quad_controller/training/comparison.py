# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Policies and the gait on the same ways in physics, with figures that can be compared."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

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

Results = Mapping[str, Mapping[str, CourseFigures]]
"""By the name of the walker and the title of the ground."""


def compare(
    walkers: Mapping[str, Path | None],
    duration: float,
    seed: int = 1,
    grounds: Mapping[str, Conditions] = GROUNDS,
    commands: tuple[Velocity, ...] = COMMANDS,
) -> dict[str, dict[str, CourseFigures]]:
    """Let walkers walk, on all cores.

    Args:
        walkers: Files of policies by their names; None is the gait.
        duration: Of each way in [s].
        seed: Of the pushes; the same for all.
        grounds: What differs, by a title for people.
        commands: One after the other.

    Raises:
        CheckError: The physics failed.
        PolicyError: A policy does not fit the robot.
    """
    trials = [
        Trial(Candidate(path), commands, duration, ground, seed)
        for path in walkers.values()
        for ground in grounds.values()
    ]
    found = iter(run_trials(trials))
    return {name: {title: next(found) for title in grounds} for name in walkers}


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

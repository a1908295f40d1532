#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Benchmarks the gait and the example policy on varied servos and grounds.

Runs in virtual time on all cores. It judges none of the figures: `check_policy` does that, and
also walks the course over a serial line in real time (`--chain`).

    python bench_walking.py --duration 30     # for figures that are steadier
"""

from __future__ import annotations

import argparse
from dataclasses import replace

from quad_controller import Velocity
from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.policy.options import table_text
from quad_controller.policy_check.arenas import AS_MADE, Conditions, RobotChoice, TIPPING_PUSH
from quad_controller.policy_check.course import course_for, CourseFigures
from quad_controller.policy_check.findings import Table
from quad_controller.policy_check.trial import Candidate, run_trials, shipped_walkers, Trial
from quad_sim import ServoModel

GROUNDS = {
    'level': AS_MADE,
    'bytes of v1': Conditions(v1=True),
    f'pushed by {TIPPING_PUSH:g} m/s': Conditions(push=TIPPING_PUSH),
    'rough, 2 cm': Conditions(roughness=0.02),
    '20 % heavier': Conditions(trunk_mass=1.2),
    'rough and pushed': Conditions(roughness=0.02, push=TIPPING_PUSH),
}
STIFFNESSES = (1.1, 1.7, 2.45, 4.0, 8.0, 10.0)  # [N m/rad]
DELAYS = (0.02, 0.04, 0.06)  # [s]
HELD_OUT = [(kp, delay) for kp in (1.7, 4.0, 8.0) for delay in (0.025, 0.05)]
"""Servos by which a policy is judged: stiffness [N m/rad] and delay [s]."""
SERVO_COMMANDS = (Velocity(0.2), Velocity(-0.15), Velocity(0.0, -0.1), Velocity(0.0, 0.0, -1.0))
HEADINGS = (
    *('', 'ground', 'forward [m/s]', 'lateral [m/s]', 'turn [rad/s]'),
    *('falls/min', 'success', 'transport'),
)


def row(who: str, ground: str, figures: CourseFigures) -> tuple[str, ...]:
    """Return the results of a candidate on a ground; success: commands without a fall."""
    upright = sum(not each.falls for each in figures.passages) / len(figures.passages)
    return (
        who,
        ground,
        *(f'{figures.mean("error", axis):.3f}' for axis in ('forward', 'lateral')),
        f'{figures.mean("turning_error", "turn"):.3f}',
        f'{figures.falls_per_minute:.1f}',
        f'{upright:.0%}',
        f'{figures.mean("cost_of_transport"):.2f}',
    )


def servo(stiffness: float, delay: float) -> str:
    """Return the nominal servos with another stiffness and delay, in fake_xgo's syntax."""
    nominal = ServoModel.NOMINAL.parameters
    return (
        f'kp={stiffness},kv={nominal.velocity_gain * stiffness / nominal.stiffness:.4g},'
        f'interpolation={nominal.interpolation},deadband={nominal.deadband},'
        f'backlash={nominal.backlash},delay={delay}'
    )


def servos(walkers: dict[str, Candidate], duration: float) -> None:
    """Print the influence of servos: speed error, falls, cost of transport."""
    trials = {
        (name, kp, delay): Trial(
            replace(who, robot=RobotChoice(servo=servo(kp, delay))), SERVO_COMMANDS, duration
        )
        for name, who in walkers.items()
        for kp in STIFFNESSES
        for delay in DELAYS
    }
    found = dict(zip(trials, run_trials(list(trials.values())), strict=True))
    table: Table = [('', 'N m/rad', *(f'after {delay * 1e3:.0f} ms' for delay in DELAYS))]
    for name in walkers:
        for kp in STIFFNESSES:
            cells = (found[name, kp, delay] for delay in DELAYS)
            texts = (
                f'{each.mean("error"):.3f} m/s {each.falls_per_minute:.0f}/min '
                f'{each.mean("cost_of_transport"):.1f}'
                for each in cells
            )
            table.append((name, f'{kp:g}', *texts))
    print('\nby stiffness and delay of the servos: speed error, falls a minute, cost of transport')
    print(table_text(table, numbers=True))


def held_out(walkers: dict[str, Candidate], duration: float) -> None:
    """Print speed errors and falls with the held-out servos, on each ground."""
    table: Table = [('', *GROUNDS)]
    for name, who in walkers.items():
        robots = [replace(who, robot=RobotChoice(servo=servo(*each))) for each in HELD_OUT]
        cells = []
        for ground in GROUNDS.values():
            found = run_trials([Trial(each, SERVO_COMMANDS, duration, ground) for each in robots])
            whole = CourseFigures(tuple(one for each in found for one in each.passages))
            largest = max(each.error for each in whole.passages)
            falls = f'{whole.falls_per_minute:.1f}/min'
            cells.append(f'{whole.mean("error"):.3f} {largest:.3f} m/s {falls}')
        table.append((name, *cells))
    print('\nservos of 1.7, 4 and 8 N m/rad, 25 and 50 ms late: mean and largest error, falls')
    print(table_text(table, numbers=True))


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--duration', type=float, default=4.0, help='of each command [s]')
    options = parser.parse_args()
    walkers = {'gait': Candidate(), 'gait, low, wide': Candidate(gait=LOW_AND_WIDE)}
    walkers |= shipped_walkers()
    commands = course_for(None)
    trials = {
        (name, title): Trial(who, commands, options.duration, ground)
        for title, ground in GROUNDS.items()
        for name, who in walkers.items()
    }
    figures = run_trials(list(trials.values()))
    table: Table = [HEADINGS]
    table += [row(*key, each) for key, each in zip(trials, figures, strict=True)]
    print(f'off by, falls, commands without one; {len(commands)} commands of {options.duration} s')
    print(table_text(table, numbers=True))
    servos({'gait': Candidate()} | shipped_walkers(), options.duration)
    held_out(walkers, options.duration)


if __name__ == '__main__':
    main()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Disturbs an arm and a quadruped in motion at random moments, and watches them from outside.

Run it with ``make chaos``, or ``python tests/chaos.py [--duration S] [--seed N] [--robot NAME]``
in the environment. Equal seeds draw equal disturbances; where they hit depends on the machine.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import secrets
import sys
from tempfile import TemporaryDirectory
import time

from chaos_arm import ArmVictim
from chaos_quad import QuadVictim
from disturbance import draw, Report, run, until
from isolation import reserve

DURATION = 600.0
"""Of all disturbances together in [s]."""
ROBOTS: dict[str, type[ArmVictim | QuadVictim]] = {'arm': ArmVictim, 'quad': QuadVictim}


def chaos(robot: str, seed: int, duration: float, folder: Path) -> Report:
    """Start a robot and disturb it for a time in [s]."""
    with reserve() as isolation, ROBOTS[robot](isolation, folder, seed) as victim:
        return run(victim, until(time.monotonic() + duration, draw(victim, seed)))


def main() -> None:
    """Run it and print what happened; the exit code is 1 when a law was broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--duration', type=float, default=DURATION, help='in s (default: 600)')
    parser.add_argument('--seed', type=int, default=secrets.randbelow(10**6))
    parser.add_argument('--robot', choices=ROBOTS, action='append')
    arguments = parser.parse_args()
    robots = arguments.robot or list(ROBOTS)
    failed = False
    for robot in robots:
        print(f'\n== {robot}, seed {arguments.seed}', flush=True)
        with TemporaryDirectory() as folder:
            report = chaos(robot, arguments.seed, arguments.duration / len(robots), Path(folder))
        for title, counts in (('disturbances', report.events), ('motions', report.outcomes)):
            print(f'{title}: ' + ', '.join(f'{n} x {what}' for what, n in counts.most_common()))
        print(f'violations: {len(report.violations)}')
        print(*report.violations, sep='\n')
        failed |= bool(report.violations) or not report.events
    sys.exit(int(failed))


if __name__ == '__main__':
    main()

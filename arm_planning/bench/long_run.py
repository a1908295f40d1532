# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The best length of each generated problem, as a long run finds it, for bench_planning.py.

Run: ``python arm_planning/bench/long_run.py`` in the sourced workspace, after the problems were
changed; it takes some minutes and writes ``best_lengths.json``. Where it finds no way, the number
is null, and the problem does not count: nobody knows whether it can be solved.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

import numpy as np
from planning_problems import KINDS, panda, Problem, problem, PROBLEMS

from arm_model import Array, RobotModel
from arm_planning import ValidityCheck
from arm_planning.free.motion_check import MotionCheck
from arm_planning.free.search import rrt_connect, shortened

FILE = Path(__file__).with_name('best_lengths.json')

RUNS, SHORTCUTS = 16, 6  # how often a way is searched, and how often each is shortened
LONGEST = 30.0  # time for one problem in [s]


def length(places: Array) -> float:
    """Return the length of the straight motions between places in [rad]."""
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def best_length(model: RobotModel, asked: Problem) -> float | None:
    """Return the length of the shortest valid way that is found; None for none."""
    deadline, check = time.monotonic() + LONGEST, ValidityCheck(model.limits, asked.scene)
    draw = np.random.default_rng(asked.seed)
    motions = MotionCheck(check, (asked.start, asked.goal))
    found = []

    def expired() -> bool:
        return time.monotonic() > deadline

    for _ in range(RUNS):
        places = rrt_connect(
            asked.start,
            [asked.goal],
            lambda: draw.uniform(model.limits.lower, model.limits.upper),
            motions,
            expired,
            further=iter(()),
        )
        if places is None:
            break
        for _ in range(SHORTCUTS):
            places = shortened(places, draw, motions, expired)
        if check.waypoints(places) is None:
            found.append(length(places))
    return min(found, default=None)


def main() -> None:
    """Write the data, after each scene."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--problems', type=int, default=PROBLEMS, help='problems of each scene')
    count, model, found = parser.parse_args().problems, panda(), {}
    for kind in KINDS:
        lengths = [best_length(model, problem(model, kind, seed)) for seed in range(count)]
        found[kind] = [None if each is None else round(each, 3) for each in lengths]
        FILE.write_text(json.dumps(found), encoding='utf-8')
        print(kind, lengths.count(None), 'not solved', flush=True)


if __name__ == '__main__':
    main()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of industrial motion: time of planning PTP, LIN and CIRC to goals about a pose.

Run: ``python arm_planning/bench/bench_industrial.py`` in the sourced workspace.

Times are those of the processor, so that other programs do not count.
"""

from __future__ import annotations

import os
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

from bench_ik import robot
import numpy as np

from arm_model import Pose, start_pose
from arm_planning import (
    CircPoint,
    CircPointKind,
    MotionRequest,
    Planner,
    PlanningError,
    PoseGoal,
)

GOALS = 60

REACH = 0.25  # greatest way along each axis in [m]


def main() -> None:
    """Print the figures."""
    for name in ('prbt', 'gp110', 'panda'):
        model = robot(name)
        planner, start = Planner(model), start_pose(model)
        pose = model.kinematics.link_pose(model.tip, start)
        for kind in ('PTP', 'LIN', 'CIRC'):
            draw, took, slowed = np.random.default_rng(0), [], 0
            for way in draw.uniform(-REACH, REACH, (GOALS, 3)):
                goal = PoseGoal(Pose(pose.rotation, pose.position + way))
                side = np.cross(way, (0.0, 0.0, 1.0)) * 0.3
                via = CircPoint(CircPointKind.INTERIM, pose.position + 0.5 * way + side)
                begin = time.process_time()
                try:
                    plan = planner.plan(MotionRequest(start, [goal], kind, via=via))
                except PlanningError:
                    continue
                took.append(1e3 * (time.process_time() - begin))
                slowed += bool(plan.notes)
            p50, p95 = np.percentile(took, (50, 95))
            print(
                f'{name} {kind:4}: p50 {p50:5.1f} ms, p95 {p95:5.1f} ms;'
                f' {len(took)} of {GOALS} planned, {slowed} slower for a joint'
            )


if __name__ == '__main__':
    main()

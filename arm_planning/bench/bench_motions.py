# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of inverse kinematics, closed and numeric, and of PTP, LIN and CIRC.

Run: ``python arm_planning/bench/bench_motions.py`` in the sourced workspace.

Times are those of the processor, so that other programs do not count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
import os
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

import numpy as np

from arm_bringup.description import expand_xacro
from arm_bringup.robots import installed_robots_folder
from arm_model import Array, load_limits, Pose, RobotModel, start_pose
from arm_planning import (
    CircPoint,
    CircPointKind,
    MotionRequest,
    Planner,
    PlanningError,
    PoseGoal,
)
from arm_planning.ik.solver import IkSolver

POSES, GOALS = 300, 60
REACH = 0.25  # greatest way along each axis in [m]


def robot(name: str) -> RobotModel:
    """Return a robot of arm_bringup."""
    folder = installed_robots_folder() / name
    semantic = (folder / f'{name}.srdf').read_text(encoding='utf-8')
    urdf = expand_xacro(folder / f'{name}.urdf.xacro')
    return RobotModel(urdf, semantic, load_limits(folder / 'limits.yaml'))


def solve(inverse: IkSolver, pose: Pose, seed: Array) -> bool:
    """Whether a pose has a solution."""
    try:
        return bool(inverse.solve(pose, seed, timeout=5.0))
    except PlanningError:
        return False


def quantiles(calls: Sequence[Callable[[], object]]) -> tuple[str, int]:
    """Return median and 95th percentile of calls in [us], and how many had an answer."""
    took, answered = [], 0
    for call in calls:
        begin = time.process_time()
        answered += bool(call())
        took.append(1e6 * (time.process_time() - begin))
    p50, p95 = np.percentile(took, (50, 95))
    return f'p50 {p50:7.0f} us, p95 {p95:7.0f} us', answered


def inverse_kinematics(name: str, model: RobotModel) -> None:
    """Print the figures of inverse kinematics."""
    inverse, draw = IkSolver(model), np.random.default_rng(0)
    lower, upper = model.limits.lower, model.limits.upper
    joints = [draw.uniform(lower, upper) for _ in range(2 * POSES)]
    poses = [inverse.link.pose(each) for each in joints[:POSES]]
    asked = list(zip(poses, joints[POSES:], strict=True))
    if (form := inverse.closed_form) is not None:
        core = [partial(form.solutions, *each) for each in asked]
        print(f'{name}: closed form, all solutions   {quantiles(core)[0]}')
    whole = [partial(solve, inverse, *each) for each in asked]
    figures, solved = quantiles(whole)
    print(f'{name}: solve(), from another pose    {figures}, {solved} of {POSES}')


def motions(name: str, model: RobotModel) -> None:
    """Print the figures of motions to goals about a pose."""
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


def main() -> None:
    """Print the figures."""
    for name in ('prbt', 'gp110', 'panda'):
        model = robot(name)
        inverse_kinematics(name, model)
        motions(name, model)


if __name__ == '__main__':
    main()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Free motion on generated scenes: success, time and length; beside plain OMPL where it is.

Run it with a count of problems per scene. Time of planning is that of the whole pipeline: search,
shortening, timing and the proof that nothing touches. Plain OMPL is its RRT-Connect and its own
simplification on the same scene, without timing: its state check is called back, one at a time.
A path is invalid where the validity check refuses it: a pair touches, or is nearer than 1 mm.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

import numpy as np
import pinocchio as pin
from planning_problems import KINDS, Problem, problem

from arm_bringup.description import expand_xacro
from arm_bringup.robots import installed_robots_folder
from arm_model import Array, load_limits, RobotModel
from arm_planning import JointGoal, MotionRequest, Planner, PlanningError, ValidityCheck

try:
    from ompl import base, geometric, util
except ImportError:
    base = None

TIMEOUT = 1.0
"""Time for one problem in [s]."""

RESOLUTION = 0.01
"""Of OMPL's motion check, as a share of the space: MoveIt's longest_valid_segment_fraction."""

Answer = Array | None
"""Places of a path (m, n); None where none was found in time."""


def panda() -> RobotModel:
    """Return the Panda."""
    folder = installed_robots_folder() / 'panda'
    urdf, srdf = expand_xacro(folder / 'panda.urdf.xacro'), (folder / 'panda.srdf').read_text()
    return RobotModel(urdf, srdf, load_limits(folder / 'limits.yaml'))


def ours(model: RobotModel, asked: Problem) -> Answer:
    """Plan with the whole pipeline."""
    request = MotionRequest(asked.start, [JointGoal(asked.goal)], timeout=TIMEOUT)
    try:
        path = Planner(model, seed=asked.seed).plan(request, asked.scene).path
    except PlanningError:
        return None
    return path.positions(np.linspace(0.0, path.duration, 500))


def plain_ompl(model: RobotModel, asked: Problem) -> Answer:
    """Plan with RRT-Connect of OMPL, as its users write it in Python."""
    scene = asked.scene
    native, geometry = scene.kinematics.native, scene.geometry
    data, results = native.createData(), geometry.createData()
    count = len(model)
    space = base.RealVectorStateSpace(count)
    bounds = base.RealVectorBounds(count)
    for joint in range(count):
        bounds.setLow(joint, float(model.limits.lower[joint]))
        bounds.setHigh(joint, float(model.limits.upper[joint]))
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)

    def numbers(state: object) -> Array:
        return np.array([state[joint] for joint in range(count)])  # type: ignore[index]

    def valid(state: object) -> bool:
        return not pin.computeCollisions(native, data, geometry, results, numbers(state), True)

    setup.setStateValidityChecker(valid)
    setup.getSpaceInformation().setStateValidityCheckingResolution(RESOLUTION)
    ends = []
    for positions in (asked.start, asked.goal):
        state = space.allocState()
        for joint, position in enumerate(positions.tolist()):
            state[joint] = position
        ends.append(state)
    setup.setStartAndGoalStates(*ends)
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    setup.solve(TIMEOUT)
    if not setup.haveExactSolutionPath():
        return None
    setup.simplifySolution(TIMEOUT)
    path = setup.getSolutionPath()
    return np.array([numbers(state) for state in path.getStates()])


def measure(
    model: RobotModel,
    name: str,
    plan: Callable[[RobotModel, Problem], Answer],
    problems: list[Problem],
) -> None:
    """Print what a planner does with the problems of one kind."""
    times, busy, lengths, invalid = [], [], [], 0
    for asked in problems:
        began, worked = time.perf_counter(), time.process_time()
        places = plan(model, asked)
        times.append(time.perf_counter() - began)
        busy.append(time.process_time() - worked)
        if places is None:
            continue
        straight = float(np.linalg.norm(asked.goal - asked.start))
        lengths.append(float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum()) / straight)
        invalid += ValidityCheck(model.limits, asked.scene).waypoints(places) is not None
    p50, p95 = (1e3 * np.percentile(times, (50, 95))).tolist()
    c50, c95 = (1e3 * np.percentile(busy, (50, 95))).tolist()
    print(
        f'{problems[0].kind:6} {name:10} {len(lengths):4}/{len(problems):<4} {p50:8.1f} {p95:8.1f}'
        f' {c50:8.1f} {c95:8.1f} {np.median(lengths):8.2f} {invalid:8}'
    )


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--problems', type=int, default=20, help='problems of each kind')
    count = parser.parse_args().problems
    planners, model = {'ours': ours}, panda()
    if base is None:
        print('OMPL is not installed: pip install ompl')
    else:
        util.setLogLevel(util.LogLevel.LOG_ERROR)
        planners['plain OMPL'] = plain_ompl
    print(
        'scene  planner      solved  p50 [ms] p95 [ms]  CPU p50  CPU p95   length  invalid\n'
        f'(within {TIMEOUT:g} s; length by that of the straight motion)'
    )
    for kind in KINDS:
        problems = [problem(model, kind, seed) for seed in range(count)]
        for name, plan in planners.items():
            measure(model, name, plan, problems)


if __name__ == '__main__':
    main()

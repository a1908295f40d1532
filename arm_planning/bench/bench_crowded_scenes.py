# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Free motion where a thousand boxes and an octomap of 20,000 cells surround the obstacles.

Run: ``python arm_planning/bench/bench_crowded_scenes.py`` in the sourced workspace.

The problems are those of the table in bench_planning.py. Times are those of the processor; a scene
is taken over once, as by move_group, and planned in after that.
"""

from __future__ import annotations

import os
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

import numpy as np
from planning_problems import panda, Problem, problem

from arm_model import (
    Box,
    Cells,
    Clearances,
    CollisionObject,
    frozen,
    OCTOMAP_NAME,
    ORIGIN,
    PlacedShape,
    PlanningScene,
    Pose,
)
from arm_planning import JointGoal, MotionRequest, Planner

PROBLEMS = 10
BOXES, EDGE, CELLS, BLOCK = 1000, 0.02, 142, 256  # edge of a cell [m], cells along the floor
CLEARANCE = 0.02  # of what is added at start and goal [m]


def crowded(asked: Problem) -> PlanningScene:
    """Return the scene of a problem with boxes all around that leave room at start and goal."""
    draw, objects = np.random.default_rng(asked.seed), dict(asked.scene.objects)
    for number in range(BOXES):
        radius, angle, height = draw.uniform((0.75, -np.pi, 0.0), (1.4, np.pi, 1.2)).tolist()
        place = frozen([radius * np.cos(angle), radius * np.sin(angle), height])
        box = Box(*draw.uniform(0.01, 0.04, 3).tolist())
        name = f'box_{number}'
        objects[name] = CollisionObject(name, box, pose=Pose(ORIGIN.rotation, place))
    scene = asked.scene.with_contents(objects=objects)
    clearances = Clearances(scene)
    for state in (asked.start, asked.goal):
        for pair in (clearances.least(state, CLEARANCE) < CLEARANCE).nonzero()[0].tolist():
            for name in scene.pairs[pair]:
                if name.startswith('box_'):
                    objects.pop(name, None)
    return scene.with_contents(objects=objects)


def with_floor(scene: PlanningScene) -> PlanningScene:
    """Return a scene with an octomap below."""
    along = (np.arange(CELLS) - CELLS // 2 + 0.5) * EDGE
    middles = np.array([(x, y, -0.11) for x in along for y in along])
    shapes = [
        PlacedShape(Cells(middles[begin : begin + BLOCK], EDGE))
        for begin in range(0, len(middles), BLOCK)
    ]
    return scene.with_object(CollisionObject(OCTOMAP_NAME, *shapes))


def main() -> None:
    """Print the medians."""
    model = panda()
    asked = [problem(model, 'table', seed) for seed in range(PROBLEMS)]
    first = 0.0
    for label in ('obstacles alone', 'and 1,000 boxes', 'and 20,000 cells'):
        took = []
        for each in asked:
            scene = each.scene if label == 'obstacles alone' else crowded(each)
            scene = with_floor(scene) if label == 'and 20,000 cells' else scene
            planner = Planner(model, seed=each.seed)
            planner.is_valid(each.start, scene)  # takes it over
            began = time.process_time()
            planner.plan(MotionRequest(each.start, [JointGoal(each.goal)], timeout=60.0), scene)
            took.append(1e3 * (time.process_time() - began))
        p50, p95 = np.percentile(took, (50, 95)).tolist()
        first = first or p50
        print(
            f'{label:17}: p50 {p50:6.1f} ms, p95 {p95:6.1f} ms, p50 by the first {p50 / first:.1f}'
        )


if __name__ == '__main__':
    main()

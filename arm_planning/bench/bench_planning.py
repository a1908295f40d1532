# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Free motion on generated scenes: success, time and length; beside plain OMPL and roboplan.

Run: ``python arm_planning/bench/bench_planning.py`` in the sourced workspace, with ``--all`` for
the 100 problems of each scene instead of the first 10.

Each planner has a process of its own. OMPL and roboplan are no part of the environment; they are
measured with ``--wheels DIR``, after ``pip install --target DIR ompl roboplan``.

- Ours is the whole pipeline: search, shortening, timing and the proof that nothing touches.
- OMPL is its RRT-Connect and its own simplification on the same scene, without timing: its check
  of a state is called back, one at a time.
- roboplan is its RRT-Connect and its own shortcuts, in C++, without timing.

Times are those of the processor: other programs do not count. Lengths are by those of a long run
of minutes (``--long-run``), which writes ``best_lengths.json``; where it finds no way, the number
is null, and the problem does not count. A path is invalid where a sampler that looks at it every
milliradian, and asks nothing but pinocchio, finds a contact.

``--crowded`` surrounds the obstacles of the table with a thousand boxes and an octomap of 20,000
cells; a scene is taken over once, as by move_group, and planned in after that.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import cache
from itertools import combinations, pairwise
import json
import os
from pathlib import Path
import subprocess
import sys
import time

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

import numpy as np
import pinocchio as pin
from planning_problems import KINDS, panda, Problem, problem, PROBLEMS

from arm_bringup.robots import expand_xacro, installed_robots_folder
from arm_model import (
    Array,
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
    RobotModel,
)
from arm_planning import JointGoal, MotionRequest, Planner, PlanningError, ValidityCheck
from arm_planning.rrt_connect import MotionCheck, rrt_connect, shortened

try:
    from ompl import base, geometric, util
except ImportError:
    base = None
try:
    import roboplan.core as roboplan
    import roboplan.rrt as roboplan_rrt
except ImportError:
    roboplan = None

TIMEOUT = 1.0  # time for one problem in [s]
FEW = 10  # problems of each scene, unless all are asked for
DENSE = 1e-3  # motion of a joint from one look of the sampler to the next in [rad]
SAMPLES = 2000  # places of a timed path that are compared

RUNS, SHORTCUTS = 16, 6  # how often a long run searches a way, and how often it shortens each
SAMPLES_OF_RUN = 100_000  # samples of such a search at most
LONGEST = 30.0  # time for one problem of a long run in [s]

RESOLUTION = 0.01
"""Of OMPL's motion check, as a share of the space: MoveIt's longest_valid_segment_fraction."""

BOXES, EDGE, CELLS, BLOCK = 1000, 0.02, 142, 256  # edge of a cell [m], cells along the floor
CLEARANCE = 0.02  # of what is added at start and goal [m]

BEST_LENGTHS = Path(__file__).with_name('best_lengths.json')

Planning = Callable[[], Array | None]
"""What is timed: gives the places of a path (m, n), or None where none was found in time."""


def ours(model: RobotModel, asked: Problem) -> Planning:
    """Plan with the whole pipeline."""
    request = MotionRequest(asked.start, [JointGoal(asked.goal)], timeout=TIMEOUT)

    def plan() -> Array | None:
        try:
            path = Planner(model, seed=asked.seed).plan(request, asked.scene).path
        except PlanningError:
            return None
        return path.positions(np.linspace(0.0, path.duration, SAMPLES))

    return plan


def proof(model: RobotModel, asked: Problem) -> float:
    """Return the time that the proof of our path takes in [s]."""
    request = MotionRequest(asked.start, [JointGoal(asked.goal)], timeout=60.0)
    path = Planner(model, seed=asked.seed).plan(request, asked.scene).path
    check = ValidityCheck(model.limits, asked.scene)
    began = time.process_time()
    check.path(path)
    return time.process_time() - began


def plain_ompl(model: RobotModel, asked: Problem) -> Planning:
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

    def plan() -> Array | None:
        setup.solve(TIMEOUT)
        if not setup.haveExactSolutionPath():
            return None
        setup.simplifySolution(TIMEOUT)
        return np.array([numbers(state) for state in setup.getSolutionPath().getStates()])

    return plan


@cache
def _panda_of_roboplan() -> tuple[str, str]:
    folder = installed_robots_folder() / 'panda'
    return expand_xacro(folder / 'panda.urdf.xacro'), (folder / 'panda.srdf').read_text()


def with_roboplan(model: RobotModel, asked: Problem) -> Planning:
    """Plan with RRT-Connect and the shortcuts of roboplan, with its own settings."""
    urdf, srdf = _panda_of_roboplan()
    scene = roboplan.Scene('panda', roboplan.loadUrdfSceneDescriptionFromXml(urdf))
    scene.importSrdf(srdf)
    for name, thing in asked.scene.objects.items():
        place = np.eye(4, order='F')
        place[:3, 3] = thing.pose.position
        (placed,) = thing.shapes
        if not isinstance(placed.shape, Box):
            raise TypeError(f'{name} is a {type(placed.shape).__name__}; only boxes are taken')
        box = roboplan.Box(placed.shape.x, placed.shape.y, placed.shape.z)
        scene.addBoxGeometry(name, 'universe', box, place, np.ones(4))
    # what stands still does not collide: neither objects with each other, nor the base
    checked = set(map(frozenset, asked.scene.pairs))
    bodies = (*asked.scene.link_shapes, *asked.scene.objects)
    for pair in combinations(bodies, 2):
        if frozenset(pair) not in checked and pair[1] in asked.scene.objects:
            scene.setCollisions(*pair, False)
    options = roboplan_rrt.RRTOptions(
        group_name=model.group, rrt_connect=True, max_planning_time=TIMEOUT, max_nodes=100_000
    )
    planner = roboplan_rrt.RRT(scene, options)
    planner.setRngSeed(asked.seed)
    short = roboplan.PathShortcuttingOptions(group_name=model.group, seed=asked.seed)
    shortcuts, names = roboplan.PathShortcutter(scene, short), list(model.joints)
    start, goal = (roboplan.JointConfiguration(names, each) for each in (asked.start, asked.goal))

    def plan() -> Array | None:
        try:
            path = shortcuts.shortcut(planner.plan(start, goal))
        except RuntimeError:
            return None
        return np.array(path.positions)

    return plan


def touches(places: Array, scene: PlanningScene) -> bool:
    """Whether anything touches on a path, as pinocchio alone sees it every milliradian."""
    native, data = scene.kinematics.native, scene.kinematics.native.createData()
    results = scene.geometry.createData()
    for begin, end in pairwise(places):
        count = int(np.ceil(np.abs(end - begin).max() / DENSE)) + 1
        for place in np.linspace(begin, end, count):
            if pin.computeCollisions(native, data, scene.geometry, results, place, True):
                return True
    return False


def length_of(places: Array) -> float:
    """Return the length of the straight motions between places in [rad]."""
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def best_length(model: RobotModel, asked: Problem) -> float | None:
    """Return the length of the shortest valid way that is found; None for none."""
    deadline, check = time.monotonic() + LONGEST, ValidityCheck(model.limits, asked.scene)
    draw = np.random.default_rng(asked.seed)
    motions = MotionCheck(check, (asked.start, asked.goal))
    lower, upper = model.limits.lower, model.limits.upper
    found = []

    def expired() -> bool:
        return time.monotonic() > deadline

    for _ in range(RUNS):
        places = rrt_connect(
            asked.start,
            [asked.goal],
            lambda count: draw.uniform(lower, upper, (count, len(model))),
            motions,
            expired,
            further=iter(()),
            most=SAMPLES_OF_RUN,
        )
        if places is None:
            break
        for _ in range(SHORTCUTS):
            places = shortened(places, draw, motions, expired)
        if check.waypoints(places) is None:
            found.append(length_of(places))
    return min(found, default=None)


def long_run(count: int) -> None:
    """Write the best lengths, after each scene."""
    model, found = panda(), {}
    for kind in KINDS:
        lengths = [best_length(model, problem(model, kind, seed)) for seed in range(count)]
        found[kind] = [None if each is None else round(each, 3) for each in lengths]
        BEST_LENGTHS.write_text(json.dumps(found), encoding='utf-8')
        print(kind, lengths.count(None), 'not solved', flush=True)


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


def crowded_scenes() -> None:
    """Print the medians in scenes that are more and more crowded."""
    model = panda()
    asked = [problem(model, 'table', seed) for seed in range(FEW)]
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


PLANNERS: dict[str, Callable[[RobotModel, Problem], Planning]] = {
    'ours': ours,
    'OMPL': plain_ompl,
    'roboplan': with_roboplan,
}


def measured(name: str, count: int) -> None:
    """Print what a planner does with the problems of each scene, a line of JSON for each."""
    if {'OMPL': base, 'roboplan': roboplan}.get(name, True) is None:
        print(json.dumps({'missing': name}))
        return
    if base is not None:
        util.setLogLevel(util.LogLevel.LOG_ERROR)
    best, model, prepared = json.loads(BEST_LENGTHS.read_text('utf-8')), panda(), PLANNERS[name]
    for kind in KINDS:
        figures: dict[str, list[float]] = {'times': [], 'lengths': [], 'invalid': [], 'proof': []}
        known = [seed for seed, length in enumerate(best[kind][:count]) if length is not None]
        for seed in known:
            asked = problem(model, kind, seed)
            plan = prepared(model, asked)
            began = time.process_time()
            places = plan()
            figures['times'].append(time.process_time() - began)
            if places is None:
                continue
            figures['lengths'].append(length_of(places) / best[kind][seed])
            figures['invalid'].append(touches(places, asked.scene))
            if name == 'ours':
                figures['proof'].append(proof(model, asked))
        print(json.dumps({'kind': kind, 'problems': len(known), **figures}), flush=True)


def row(label: str, found: list[dict[str, list[float]]]) -> str:
    """Return a line of the table."""
    times, lengths, invalid, proofs = (
        np.concatenate([each[key] for each in found])
        for key in ('times', 'lengths', 'invalid', 'proof')
    )
    p50, p95 = (1e3 * np.percentile(times, (50, 95))).tolist()
    cost = f'{1e3 * np.median(proofs):9.1f}' if len(proofs) else ' ' * 9
    return (
        f'{label:16} {len(lengths):4}/{len(times):<4} {p50:8.1f} {p95:8.1f}'
        f' {np.median(lengths):7.2f} {np.percentile(lengths, 95):7.2f}'
        f' {int(invalid.sum()):8} {cost}'
    )


def _places(wheels: Path) -> list[Path]:
    """Return where Python finds wheels that pip has put into a folder."""
    return [wheels, *wheels.glob('cmeel.prefix/lib/python*/site-packages')]


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--all', action='store_true', help=f'{PROBLEMS} problems of each scene')
    parser.add_argument('--problems', type=int, default=FEW, help='problems of each scene')
    parser.add_argument('--wheels', type=Path, help='where OMPL and roboplan are installed')
    parser.add_argument('--long-run', action='store_true', help='write best_lengths.json')
    parser.add_argument('--crowded', action='store_true', help='among 1,000 boxes, 20,000 cells')
    parser.add_argument('--planner', choices=PLANNERS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    count = PROBLEMS if options.all else options.problems
    if options.long_run:
        long_run(PROBLEMS)
        return
    if options.crowded:
        crowded_scenes()
        return
    if options.planner is not None:
        measured(options.planner, count)
        return
    print('scene, planner    solved p50 [ms] p95 [ms]  length     p95  invalid proof [ms]')
    for name in PLANNERS:
        command = [sys.executable, __file__, '--planner', name, '--problems', str(count)]
        places = [] if name == 'ours' or options.wheels is None else _places(options.wheels)
        paths = [os.environ.get('PYTHONPATH', ''), *map(str, places)]
        environment = os.environ | {'PYTHONPATH': os.pathsep.join(filter(None, paths))}
        run = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment)
        lines = run.stdout.decode()
        found = [json.loads(line) for line in lines.splitlines() if line.startswith('{')]
        if 'missing' in found[0]:
            print(f'{name}: not installed; see --wheels')
            continue
        for each in found:
            print(row(f'{each["kind"]:6} {name}', [each]))
        print(row(f'all    {name}', found), flush=True)


if __name__ == '__main__':
    main()

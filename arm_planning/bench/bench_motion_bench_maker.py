# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Free motion on the 700 problems of MotionBenchMaker for the Panda, judged by MuJoCo.

They are in the source distribution of vamp-planner; get it, unpack it, and run this in the
sourced workspace with the folder that has them::

    curl -LO https://files.pythonhosted.org/packages/source/v/vamp-planner/vamp_planner-0.6.4.tar.gz
    tar xzf vamp_planner-0.6.4.tar.gz
    (cd vamp_planner-0.6.4/resources/panda && tar xjf problems.tar.bz2)
    python arm_planning/bench/bench_motion_bench_maker.py vamp_planner-0.6.4/resources/panda

Times are those of the processor, with timing and proof. A path is invalid where MuJoCo, which
makes hulls of the mesh files itself, finds a contact on it at any milliradian (``--proof``).
``ARM_MODEL_COMPILED=0`` measures the planner without its compiled core.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import os
from pathlib import Path
import time
from typing import Any
import xml.etree.ElementTree as ET

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

import mujoco
import numpy as np
import yaml

from arm_model import (
    Array,
    Box,
    CollisionObject,
    Cylinder,
    example_files,
    frozen,
    PlanningScene,
    Pose,
    RobotModel,
    rotation_of,
)
from arm_planning import JointGoal, MotionRequest, Planner, PlanningError

FEW = 10  # problems of each kind, unless all are asked for
TIMEOUT = 60.0  # time for one problem in [s]: other programs may keep this one waiting
DENSE = 1e-3  # motion of a joint from one look of MuJoCo to the next in [rad]
TOUCH = 1e-5  # depth below which a contact counts as rounding in [m]
SLOWEST = 2e-4  # time between two places of a path before it is looked at densely in [s]


class Problems:
    """The problems of a folder, and the arm that they are for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.urdf = (folder / 'panda.urdf').read_text().replace('package://', '')
        self.srdf = (folder / 'panda.srdf').read_text()
        limits = yaml.safe_load(Path(example_files()[2]).read_text())['joint_limits']
        self.model = RobotModel(self.urdf, self.srdf, limits, folder=folder)
        self.kinds = sorted(each.name for each in (folder / 'problems').iterdir())

    def ends(self, kind: str, number: int) -> tuple[Array, Array]:
        """Return start and goal."""
        request = self._read(kind, f'request{number:04}')
        state = request['start_state']['joint_state']
        start = dict(zip(state['name'], state['position'], strict=True))
        wanted = request['goal_constraints'][0]['joint_constraints']
        goal = {each['joint_name']: each['position'] for each in wanted}
        limits = self.model.limits
        rows = ([each[name] for name in self.model.joints] for each in (start, goal))
        first, last = (np.clip(row, limits.lower, limits.upper) for row in rows)
        return first, last

    def shapes(self, kind: str, number: int) -> Iterator[tuple[str, Any, Any]]:
        """Yield name, primitive and pose of each object."""
        for thing in self._read(kind, f'scene{number:04}')['world']['collision_objects']:
            both = zip(thing['primitives'], thing['primitive_poses'], strict=True)
            for place, (shape, pose) in enumerate(both):
                yield f'{thing["id"]}_{place}', shape, pose

    def scene(self, kind: str, number: int) -> PlanningScene:
        """Return the scene of a problem."""
        objects = {}
        for name, shape, at in self.shapes(kind, number):
            size, turn = shape['dimensions'], np.array(at['orientation'], float)
            solid = Box(*size) if shape['type'] == 'box' else Cylinder(size[1], size[0])
            pose = Pose(rotation_of(turn / np.linalg.norm(turn)), frozen(at['position']))
            objects[name] = CollisionObject(name, solid, pose=pose)
        return self.model.scene.with_contents(objects=objects)

    def _read(self, kind: str, name: str) -> Any:  # noqa: ANN401
        text = (self.folder / 'problems' / kind / f'{name}.yaml').read_text()
        return yaml.load(text, getattr(yaml, 'CSafeLoader', yaml.SafeLoader))  # noqa: S506


def deepest(problems: Problems, kind: str, number: int, places: Array) -> float:
    """Return how deep anything overlaps on a way in [m], as MuJoCo sees it."""
    root = ET.fromstring(problems.urdf)  # noqa: S314
    for link in root.iter('link'):
        for visual in link.findall('visual'):
            link.remove(visual)
    meshes = str(problems.folder / 'meshes' / 'collision')
    settings = ET.SubElement(root, 'mujoco')
    ET.SubElement(settings, 'compiler', meshdir=meshes, strippath='true', fusestatic='false')
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding='unicode'))
    for name, shape, at in problems.shapes(kind, number):
        x, y, z, w = at['orientation']
        size, is_box = shape['dimensions'], shape['type'] == 'box'
        spec.worldbody.add_geom(
            name=f'object {name}',
            type=mujoco.mjtGeom.mjGEOM_BOX if is_box else mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[each / 2 for each in size] if is_box else [size[1], size[0] / 2, 0.0],
            pos=at['position'],
            quat=[w, x, y, z],
        )
    native = spec.compile()
    data = mujoco.MjData(native)
    columns = [native.joint(name).qposadr[0] for name in problems.model.joints]
    checked = set(map(frozenset, problems.model.pairs))
    worst = 0.0
    for place in places:
        data.qpos[columns] = place
        mujoco.mj_kinematics(native, data)
        mujoco.mj_collision(native, data)
        for contact in data.contact[: data.ncon]:
            bodies = {native.body(native.geom_bodyid[geom]).name for geom in contact.geom}
            moving = 'world' in bodies and 'panda_link0' not in bodies
            if moving or frozenset(bodies) in checked:
                worst = max(worst, -contact.dist)
    return worst


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path, help='resources/panda of vamp-planner')
    parser.add_argument(
        '--problems', type=int, default=FEW, help='problems of each kind; 100: all'
    )
    parser.add_argument('--proof', action='store_true', help='look at each path with MuJoCo')
    options = parser.parse_args()
    problems, every, planned = Problems(options.folder), list[float](), 0
    for kind in problems.kinds:
        times, invalid, solved = list[float](), 0, 0
        for number in range(1, 101, max(100 // options.problems, 1)):
            scene, (start, goal) = problems.scene(kind, number), problems.ends(kind, number)
            request = MotionRequest(start, [JointGoal(goal)], timeout=TIMEOUT)
            began = time.process_time()
            try:
                path = Planner(problems.model, seed=number).plan(request, scene).path
            except PlanningError as error:
                print(f'{kind} {number}: {error}')
                continue
            finally:
                times.append(time.process_time() - began)
            solved += 1
            if options.proof:
                fine = path.positions(np.arange(0.0, path.duration, SLOWEST))
                along = np.cumsum(np.abs(np.diff(fine, axis=0, prepend=fine[:1])).max(axis=1))
                looks = np.searchsorted(along, np.arange(0.0, along[-1], DENSE))
                invalid += deepest(problems, kind, number, fine[looks]) > TOUCH
        every, planned = every + times, planned + solved
        print(_row(kind, times, solved, invalid if options.proof else None), flush=True)
    print(_row('all', every, planned, None))


def _row(label: str, times: list[float], solved: int, invalid: int | None) -> str:
    p50, p95, most = (1e3 * np.percentile(times, (50, 95, 100))).tolist()
    judged = '' if invalid is None else f', {invalid} invalid'
    return f'{label:24} {solved:3}/{len(times):<3} {p50:7.1f} {p95:7.1f} {most:7.1f} ms{judged}'


if __name__ == '__main__':
    main()

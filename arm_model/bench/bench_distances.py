# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of distances: seven joints with capsules, with hulls of meshes, and among objects.

Run: ``python arm_model/bench/bench_distances.py`` in the sourced workspace.

``all pairs`` measures each distance anew at a random pose; ``a cycle`` is what the safety filter
asks for at 1 kHz on a way of 2 rad/s: the four nearest pairs within 0.1 m, with gradients.
"""

from __future__ import annotations

from itertools import product
import os
from pathlib import Path
import tempfile
import time
from typing import Any
from xml.etree import ElementTree as ET

os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')  # before numpy is imported

import numpy as np

from arm_bringup.robots import expand_xacro, installed_robots_folder
from arm_model import Box, Clearances, CollisionObject, load_limits, Pose, RobotModel

CYCLE = 0.001  # period of the cycle in [s]
SPEED = 2.0  # of each joint in [rad/s]

CYCLES, POSES = 4000, 500


def files() -> tuple[str, str, dict[str, Any]]:
    """Return URDF, SRDF and limits of the Panda, whose links are capsules."""
    folder = installed_robots_folder() / 'panda'
    semantic = (folder / 'panda.srdf').read_text(encoding='utf-8')
    urdf = expand_xacro(folder / 'panda.urdf.xacro')
    return urdf, semantic, dict(load_limits(folder / 'limits.yaml'))


def with_meshes(urdf: str, corners: int, folder: Path) -> str:
    """Return the URDF with a mesh of some corners in the place of each capsule."""
    robot = ET.fromstring(urdf)  # noqa: S314  our own
    for link in robot.iter('link'):
        collisions = link.findall('collision')
        if not any(each.find('geometry/cylinder') is not None for each in collisions):
            continue
        for each in collisions:
            cylinder = each.find('geometry/cylinder')
            if cylinder is None:
                link.remove(each)  # an end of the capsule
                continue
            path = folder / f'{link.get("name")}_{corners}_{collisions.index(each)}.obj'
            radius, length = (float(cylinder.get(key, 0)) for key in ('radius', 'length'))
            path.write_text(obj(radius, length, corners), encoding='utf-8')
            geometry = each.find('geometry')
            assert geometry is not None
            geometry.remove(cylinder)
            ET.SubElement(geometry, 'mesh', filename=path.as_uri())
    return ET.tostring(robot, encoding='unicode')


def obj(radius: float, length: float, corners: int) -> str:
    """Return points on a capsule as Wavefront OBJ."""
    steps = np.arange(corners)
    around = 2.4 * steps  # about the golden angle: spread evenly
    height = 1.0 - 2.0 * (steps + 0.5) / corners
    width = radius * np.sqrt(1.0 - height**2)
    height = radius * height + 0.5 * length * np.sign(height)
    places = np.stack((width * np.cos(around), width * np.sin(around), height), axis=1)
    lines = [f'v {x} {y} {z}' for x, y, z in places]
    return '\n'.join([*lines, *(f'f {n} {n + 1} {n + 2}' for n in range(1, corners - 1))])


def figures(name: str, model: RobotModel, clearances: Clearances) -> None:
    """Print what distances cost."""
    draw = np.random.default_rng(0)
    lower, upper = model.limits.lower, model.limits.upper
    anew = []
    for _ in range(POSES):
        at = draw.uniform(lower, upper)
        begin = time.perf_counter()
        Clearances(clearances.scene).least(at, np.inf)
        anew.append(time.perf_counter() - begin)
    cycles = []
    at, speed = model.poses['ready'], np.zeros(len(model))
    for cycle in range(CYCLES):
        speed = draw.choice((-SPEED, SPEED), len(model)) if cycle % 250 == 0 else speed
        at = np.clip(at + CYCLE * speed, lower, upper)
        begin = time.perf_counter()
        clearances.nearest(at, 0.1, 4)
        cycles.append(time.perf_counter() - begin)
    every, median, late = np.median(anew), *np.percentile(cycles, [50, 99])
    print(
        f'{name:32} {len(clearances.pairs):5} pairs   all pairs {1e6 * every:6.0f} us'
        f'   a cycle {1e6 * median:4.0f} us, p99 {1e6 * late:4.0f} us'
    )


def timed(urdf: str, rest: tuple[str, dict[str, Any]], words: str) -> RobotModel:
    """Build a model and print how long it took and what it needs."""
    before, begin = resident(), time.perf_counter()
    model = RobotModel(urdf, *rest)
    took = time.perf_counter() - begin
    print(f'{words:32} {1e3 * took:6.0f} ms   {max(resident() - before, 0.0):5.1f} MB')
    return model


def resident() -> float:
    """Return the memory of this process in [MB]."""
    pages = int(Path('/proc/self/statm').read_text(encoding='ascii').split()[1])
    return pages * os.sysconf('SC_PAGE_SIZE') / 1e6


def objects(model: RobotModel, count: int) -> Clearances:
    """Return the arm among boxes on a grid about it."""
    scene = model.scene
    places = [place for place in product((-0.8, 0.0, 0.8), repeat=3) if any(place[:2])]
    for number, place in enumerate(places[:count]):
        pose = Pose(np.eye(3), np.add(place, (0.0, 0.0, 0.5)))
        scene = scene.with_object(CollisionObject(f'box_{number}', Box(0.1, 0.1, 0.1), pose=pose))
    return Clearances(scene)


def main() -> None:
    """Print all figures."""
    urdf, semantic, limits = files()
    rest = semantic, limits
    with tempfile.TemporaryDirectory() as folder:
        os.environ['XDG_CACHE_HOME'] = folder
        capsules = timed(urdf, rest, 'start, capsules')
        models = {}
        for corners in (150, 2000):
            text = with_meshes(urdf, corners, Path(folder))
            models[corners] = timed(text, rest, f'start, meshes of {corners} corners')
            timed(text, rest, '  again')
    figures('capsules', capsules, Clearances(capsules.scene))
    for corners, model in models.items():
        figures(f'hulls of {corners} corners', model, Clearances(model.scene))
    for count in (5, 24):
        figures(f'capsules among {count} boxes', capsules, objects(capsules, count))


if __name__ == '__main__':
    main()

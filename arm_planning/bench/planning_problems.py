# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes and problems for planners, made from seeds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from arm_bringup.robots import expand_xacro, installed_robots_folder
from arm_model import (
    Array,
    Box,
    Clearances,
    CollisionObject,
    frozen,
    load_limits,
    ORIGIN,
    PlanningScene,
    Pose,
    RobotModel,
)
from arm_planning import ValidityCheck

CLEARANCE = 0.01  # least distance at start and goal in [m]
MIN_DISTANCE = 1.5  # least distance of start and goal in [rad]: what is nearer is no problem
PROBLEMS = 100  # problems of each kind: their seeds are 0 to 99
MAX_DRAWS = 3000  # states that are drawn for a problem at most


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """A planning problem."""

    kind: str  # what the scene is
    seed: int  # seed that it was made of
    scene: PlanningScene  # the scene
    start: Array  # where the arm is in [rad]
    goal: Array  # where it is to go in [rad]


Boxes = Iterator[tuple[Box, tuple[float, float, float]]]


def _table(draw: np.random.Generator) -> Boxes:
    yield Box(1.6, 1.6, 0.04), (0.4, 0.0, -0.03)
    for _ in range(6):
        height = draw.uniform(0.1, 0.5)
        x, y = draw.uniform(0.3, 0.8), draw.uniform(-0.6, 0.6)
        length, width = draw.uniform(0.05, 0.2, 2).tolist()
        yield Box(length, width, height), (x, y, height / 2)


def _shelf(draw: np.random.Generator) -> Boxes:
    x = draw.uniform(0.6, 0.75)
    for level in (0.1, 0.45, 0.8, 1.15):
        yield Box(0.3, 1.0, 0.02), (x, 0.0, level)
    for y in (-0.5, 0.0, 0.5):
        yield Box(0.3, 0.02, 1.05), (x, y, 0.625)
    yield Box(0.02, 1.0, 1.05), (x + 0.15, 0.0, 0.625)


def _cage(draw: np.random.Generator) -> Boxes:
    half = draw.uniform(0.65, 0.8)
    yield Box(2.0, 2.0, 0.04), (0.0, 0.0, -0.03)
    for angle in np.arange(0.0, 2 * np.pi, np.pi / 6):
        yield Box(0.04, 0.04, 1.2), (half * np.cos(angle), half * np.sin(angle), 0.6)
    yield Box(1.6, 1.6, 0.04), (0.0, 0.0, draw.uniform(1.1, 1.25))


def _gap(draw: np.random.Generator) -> Boxes:
    width, angle = draw.uniform(0.25, 0.35), 0.5
    for side in (-1.0, 1.0):
        y = side * (width / 2 + 0.3)
        yield Box(0.05, 0.6, 1.4), (0.45, y, 0.7)
    yield Box(0.05, width, 0.25 * angle), (0.45, 0.0, 0.06)


def _bin(draw: np.random.Generator) -> Boxes:
    x, y, height = draw.uniform(0.45, 0.6), draw.uniform(-0.3, 0.3), draw.uniform(0.2, 0.3)
    yield Box(1.6, 1.6, 0.04), (0.4, 0.0, -0.03)
    for side in (-1.0, 1.0):
        yield Box(0.4, 0.02, height), (x, y + side * 0.2, height / 2)
        yield Box(0.02, 0.4, height), (x + side * 0.2, y, height / 2)


KINDS: Mapping[str, Callable[[np.random.Generator], Boxes]] = {
    'table': _table,
    'shelf': _shelf,
    'cage': _cage,
    'gap': _gap,
    'bin': _bin,
}


def panda() -> RobotModel:
    """Build the arm of all problems, from its robot folder."""
    folder = installed_robots_folder() / 'panda'
    urdf, srdf = expand_xacro(folder / 'panda.urdf.xacro'), (folder / 'panda.srdf').read_text()
    return RobotModel(urdf, srdf, load_limits(folder / 'limits.yaml'))


def problem(model: RobotModel, kind: str, seed: int) -> Problem:
    """Return the problem of a seed.

    Args:
        kind: One of :data:`KINDS`.
    """
    draw = np.random.default_rng([seed, sorted(KINDS).index(kind)])
    scene = model.scene
    for number, (shape, position) in enumerate(KINDS[kind](draw)):
        place = Pose(ORIGIN.rotation, frozen(position))
        scene = scene.with_object(CollisionObject(f'{kind}_{number}', shape, pose=place))
    scene = _without_mounting(model, scene)
    clearances, check = Clearances(scene), ValidityCheck(model.limits, scene)
    lower, upper = np.maximum(model.limits.lower, -3.0), np.minimum(model.limits.upper, 3.0)
    states: list[Array] = []
    for _ in range(MAX_DRAWS):
        state = draw.uniform(lower, upper)
        if states and np.linalg.norm(state - states[0]) < MIN_DISTANCE:
            continue
        if model.lowest(state) < 0.0 or (clearances.least(state, CLEARANCE) < CLEARANCE).any():
            continue
        tip = model.pose(state).position
        if tip[0] < 0.3 and len(states) == 0:  # begins among the obstacles
            continue
        states.append(frozen(state))
        if len(states) == 2 and check.waypoints(np.array(states)) is None:
            states.pop()  # no problem: the straight motion is free
        if len(states) == 2:
            return Problem(kind, seed, scene, *states)
    raise ValueError(f'{kind} {seed}: too few free states; make more room in the scene')


def _without_mounting(model: RobotModel, scene: PlanningScene) -> PlanningScene:
    """Allow links to touch objects that they cannot leave: the arm stands on the table."""
    here = Clearances(scene)
    for name, other in {contact.bodies for contact in here.contacts(model.poses['ready'])}:
        scene = scene.allowing(name, other)
    return scene

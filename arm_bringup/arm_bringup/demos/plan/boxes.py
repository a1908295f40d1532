# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Boxes that are put in the way of an arm: found on the model, for any arm."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from arm_model import (
    Array,
    Box,
    Clearances,
    CollisionObject,
    combined,
    frozen,
    ORIGIN,
    PlanningScene,
    Pose,
    RobotModel,
)
from arm_planning import JointGoal, MotionPlan, MotionRequest, Planner, PlanningError
from arm_trajectory import PathCheck

from .tool import tool_links

EDGES = (0.08, 0.06, 0.04, 0.03, 0.02)
"""Edges of a box, as shares of the reach; the largest that is possible is taken."""
SHARES = (0.6, 0.55, 0.65, 0.5, 0.7, 0.75, 0.45)
"""Where on a path a box may appear, as shares of its points."""
ROOM = 0.06
"""Least distance of a box from the arm as it appears, and at the goal, as a share of the reach."""
FAR = 1.0
"""Distances beyond this count as this in [m]."""
DRAWS = 100
"""Goals that are tried for a swing."""
PLAN_TIMEOUT = 2.0
"""Longest time of a search for a motion in [s]."""
LEAST_REACH = 0.05
"""Reach of an arm that is shorter in [m]."""
LEAST_SWING = 0.25
"""Least way of the tip on a swing, as a share of the reach."""


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """A motion around a box, for an arm of any number of joints.

    Attributes:
        begin: Joint positions at its begin in [rad] or [m].
        end: Joint positions at its end.
        inside: Joint positions at which the arm touches the box.
        box: The box.
    """

    begin: Array
    end: Array
    inside: Array
    box: CollisionObject


def cube(name: str, edge: float, place: Array) -> CollisionObject:
    """Return a cube.

    Args:
        name: Its name.
        edge: Its edge in [m].
        place: Its middle in the root link in [m].
    """
    pose = Pose(ORIGIN.rotation, frozen(place))
    return CollisionObject(name, Box(edge, edge, edge), pose=pose)


def find_swing(model: RobotModel, begin: Array, name: str) -> Swing | None:
    """Return a motion that a box makes worth planning; None where none was found.

    Args:
        model: The arm.
        begin: Joint positions at its begin in [rad] or [m].
        name: Name of the box.
    """
    planner, scene, end_shape = Planner(model), model.scene, last_shape(model)
    reach = max(model.reach, LEAST_REACH)

    def place(positions: Array) -> Array:
        return end_shape.place(scene, positions)

    for end in _draw(model, begin):
        middle = frozen(0.5 * (begin + end))
        if np.linalg.norm(place(end) - place(begin)) < LEAST_SWING * reach:
            continue
        if planner.is_valid(end) is not None or not is_free(scene, begin, end):
            continue
        for share in EDGES:
            box = cube(name, share * reach, place(middle))
            around = scene.with_object(box)
            clear = min(distance_of(around, at, name) for at in (begin, end))
            blocked = distance_of(around, middle, name) < 0.0
            if blocked and clear > ROOM * reach and plan_free(planner, begin, end, around):
                return Swing(begin, end, middle, box)
    return None


@dataclass(frozen=True, slots=True, eq=False)
class EndShape:
    """A shape at the end of an arm: where a box must be to be in its way.

    Attributes:
        link: Its link.
        pose: Where it is in the link.
    """

    link: str
    pose: Pose

    def place(self, scene: PlanningScene, positions: Array) -> Array:
        """Return where it is in the root link in [m].

        Args:
            scene: Of the arm, or of the whole robot.
            positions: Positions of the joints of the scene in [rad] or [m].
        """
        return combined(scene.kinematics.link_pose(self.link, positions), self.pose).position


def last_shape(model: RobotModel) -> EndShape:
    """Return a shape of the tip, or of what it carries.

    Args:
        model: The arm.
    """
    links, shapes = tool_links(model), model.scene.link_shapes
    link = model.tip if model.tip in shapes or not links else links[-1]
    return EndShape(link, shapes[link][0].pose if link in shapes else ORIGIN)


def _draw(model: RobotModel, begin: Array) -> Iterator[Array]:
    """Draw goals, the same ones each time; no joint is turned by more than a quarter turn."""
    random = np.random.default_rng(0)
    lower = np.maximum(model.limits.lower, begin - np.pi / 2)
    upper = np.minimum(model.limits.upper, begin + np.pi / 2)
    for _ in range(DRAWS):
        yield frozen(random.uniform(lower, upper))


def plan_free(
    planner: Planner, begin: Array, end: Array, scene: PlanningScene
) -> MotionPlan | None:
    """Return a free motion; None where none is found in time.

    Args:
        planner: What plans.
        begin: Joint positions in [rad] or [m].
        end: The same.
        scene: What may touch.
    """
    try:
        request = MotionRequest(begin, [JointGoal(end)], timeout=PLAN_TIMEOUT)
        return planner.plan(request, scene)
    except PlanningError:
        return None


def is_free(scene: PlanningScene, begin: Array, end: Array) -> bool:
    """Whether nothing touches on the straight way between joint positions.

    Args:
        scene: What may touch.
        begin: Joint positions in [rad] or [m].
        end: The same.
    """
    way = end - begin
    return PathCheck(scene).contact(lambda times: begin + np.outer(times, way), 1.0) is None


def distance_of(scene: PlanningScene, positions: Array, name: str) -> float:
    """Return the distance of an object to what is nearest in [m].

    Args:
        scene: With the object.
        positions: Positions of its joints in [rad] or [m].
        name: The object.
    """
    distances = Clearances(scene).least(positions, FAR).tolist()
    pairs = zip(scene.pairs, distances, strict=True)
    return min((distance for pair, distance in pairs if name in pair), default=FAR)


def box_ahead(
    model: RobotModel, scene: PlanningScene, rows: Sequence[Array], name: str
) -> CollisionObject | None:
    """Return a box into which an arm would run, clear of where the arm begins and ends.

    Args:
        model: The arm.
        scene: What is there, with the joints of the arm or of the whole robot.
        rows: Positions of the joints of the scene in [rad] or [m], from where the arm is to the
            end of its way.
        name: Name of the box.
    """
    ends, end_shape = (rows[0], rows[-1]), last_shape(model)
    reach = max(model.reach, LEAST_REACH)
    for edge, share in product(EDGES, SHARES):
        at = rows[int(share * (len(rows) - 1))]
        box = cube(name, edge * reach, end_shape.place(scene, at))
        around = scene.with_object(box)
        meets = distance_of(around, at, name) < 0.0
        if meets and min(distance_of(around, each, name) for each in ends) > ROOM * reach:
            return box
    return None

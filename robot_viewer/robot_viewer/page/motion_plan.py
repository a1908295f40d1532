# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be planned for, what was planned, and what people do; no browser, no ROS."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeAlias

from urdf_reader import (
    DescriptionError,
    find_group,
    KinematicTree,
    parse_srdf,
    Transform,
    Vector,
)

from ..link_poses import link_pose

NO_GOAL, DRAGGED = 'none', 'dragged in the view'
"""Goals that are no states of the SRDF."""
NO_OBJECT = 'none'
LINE_POINTS = 80
"""Of the line that the tip follows."""
PAUSE = 0.8
"""Between two showings of a plan in [s]."""
SHOWINGS = 3
"""How often a plan is shown."""


@dataclass(frozen=True, slots=True)
class PlanGroup:
    """A group of joints that motions are planned for.

    Attributes:
        name: Its name.
        joints: Its joints, from the base out.
        tip: Link that a goal in space is for.
        states: Positions in [rad] or [m] by joint, by the name of the state.
    """

    name: str
    joints: tuple[str, ...]
    tip: str
    states: Mapping[str, Mapping[str, float]]


def plan_groups(tree: KinematicTree, semantic: str) -> dict[str, PlanGroup]:
    """Return the groups of an SRDF that can move, arms first.

    Raises:
        DescriptionError: It is no SRDF, or none of its groups can move.
    """
    description = parse_srdf(semantic)
    found, reasons = {}, []
    for name in dict.fromkeys((*description.arms, *description.groups)):
        try:
            group = find_group(tree, description, name)
        except DescriptionError as error:
            reasons.append(str(error))
            continue
        states = {
            state: {joint: at for joint, at in positions.items() if joint in group.joints}
            for state, positions in description.poses.get(name, {}).items()
        }
        found[name] = PlanGroup(name, group.joints, group.tip, states)
    if not found:
        raise DescriptionError('; '.join(reasons) or 'the SRDF has no groups')
    return found


@dataclass(frozen=True, slots=True)
class PlannedMotion:
    """A motion from its start to its goal.

    Attributes:
        joints: The joints that move.
        times: Of its points in [s], increasing.
        points: Positions in [rad] or [m], in the order of the joints.
    """

    joints: tuple[str, ...]
    times: tuple[float, ...]
    points: tuple[tuple[float, ...], ...]

    @property
    def duration(self) -> float:
        """How long it takes in [s]."""
        return self.times[-1] if self.times else 0.0

    def at(self, time: float) -> dict[str, float]:
        """Return where the joints are in [rad] or [m], between points on a straight line.

        Args:
            time: Since its start in [s]; before and after it they rest.
        """
        after = bisect_right(self.times, time)
        if not 0 < after < len(self.times):
            ends = self.points[min(after, len(self.points) - 1)] if self.points else ()
            return dict(zip(self.joints, ends, strict=True)) if ends else {}
        begin, end = self.times[after - 1 : after + 1]
        share = (time - begin) / (end - begin)
        between = zip(self.points[after - 1], self.points[after], strict=True)
        places = (start + share * (goal - start) for start, goal in between)
        return dict(zip(self.joints, places, strict=True))

    def shown(self, elapsed: float) -> dict[str, float] | None:
        """Return where the joints are as it is shown again and again; None when that has ended.

        Args:
            elapsed: Since the first showing began in [s].
        """
        number, time = divmod(elapsed, self.duration + PAUSE)
        return self.at(time) if number < SHOWINGS else None


def tip_line(
    tree: KinematicTree, tip: str, beside: Mapping[str, float], motion: PlannedMotion
) -> list[Vector]:
    """Return the places in the root link where a link passes, in [m]."""
    step = motion.duration / (LINE_POINTS - 1)
    return [
        link_pose(tree, tip, {**beside, **motion.at(number * step)}).translation
        for number in range(LINE_POINTS)
    ]


@dataclass(frozen=True, slots=True)
class ScenePart:
    """A shape of an object.

    Attributes:
        shape: box, sphere, cylinder (along z), cone (along z) or mesh.
        size: Lengths in [m]: of a box; radius; height and radius of cylinder and cone.
        pose: In the object.
        vertices: Of a mesh in [m].
        triangles: Of a mesh, indices of its vertices.
    """

    shape: str
    size: tuple[float, ...]
    pose: Transform
    vertices: tuple[Vector, ...] = ()
    triangles: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True, slots=True)
class SceneObject:
    """Something that a robot may not touch, or holds.

    Attributes:
        name: Its name.
        frame: In which its pose is.
        pose: Of the object.
        parts: Its shapes.
        attached: The robot holds it.
    """

    name: str
    frame: str
    pose: Transform
    parts: tuple[ScenePart, ...]
    attached: bool = False


class PlanActions(Protocol):
    """What people do to plan motions."""

    def choose_group(self, name: str) -> None:
        """Plan for another group."""

    def choose_goal(self, name: str) -> None:
        """Go to a state of the SRDF, or to where the goal is dragged."""

    def drag_goal(self, pose: Transform) -> None:
        """Set the goal of the tip to a pose in the root link."""

    def plan(self, share: float) -> None:
        """Plan, at a share of the greatest velocity and acceleration."""

    def execute(self, at: float) -> None:
        """Execute what was planned; the button was seen to be held at a steady time in [s]."""

    def go_on(self, at: float) -> None:
        """Go on with the execution: its button was seen to be held at a steady time in [s]."""

    def let_go(self) -> None:
        """Cancel the execution: its button was let go."""

    def show_again(self) -> None:
        """Show once more what was planned."""


class SceneActions(Protocol):
    """What people do with the objects of the planning scene."""

    def choose_object(self, name: str) -> None:
        """Choose an object, to be dragged or removed."""

    def drag_object(self, pose: Transform, *, is_last: bool) -> None:
        """Move the object that is chosen; the last of several says so."""

    def add_box(self, size: tuple[float, float, float]) -> None:
        """Add a box of a size in [m]."""

    def remove_object(self) -> None:
        """Remove the object that is chosen."""


Order: TypeAlias = Callable[[Callable[[], None]], None]
"""Has something done in the thread of the robot."""


def free_name(names: Sequence[str]) -> str:
    """Return a name for one more box."""
    number = 1
    while f'box{number}' in names:
        number += 1
    return f'box{number}'

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be planned for, and what was planned; no browser, no ROS."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass

from urdf_reader import (
    DescriptionError,
    find_group,
    KinematicTree,
    link_poses,
    parse_srdf,
    Vector,
)

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
        link_poses(tree, {**beside, **motion.at(number * step)})[tip].translation
        for number in range(LINE_POINTS)
    ]

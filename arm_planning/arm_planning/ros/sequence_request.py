# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sequences of MoveIt's requests, by the rules of Pilz' planner."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

from ..exceptions import PlanningCode, PlanningError
from ..industrial.sequence import check_radii


@dataclass(frozen=True, slots=True)
class GroupRun:
    """Items of a sequence that follow each other and move the same group: one trajectory."""

    group: str  # name of the group
    first: int  # number of the first item
    items: Sequence[Any]  # the moveit_msgs/MotionSequenceItem


def group_runs(items: Sequence[Any]) -> list[GroupRun]:
    """Return the items of a moveit_msgs/MotionSequenceRequest by group, in their order.

    Raises:
        PlanningError: An item has no group, a radius is none or blends two groups, or an item that
            is not the first of its group has a start state.
    """
    radii = [item.blend_radius for item in items]
    check_radii(radii)
    groups = [item.req.group_name for item in items]
    for number, (item, group) in enumerate(zip(items, groups, strict=True)):
        if not group:
            raise PlanningError(
                PlanningCode.INVALID_GROUP_NAME, f'sequence: item {number}: group_name is empty'
            )
        if group in groups[:number] and has_state(item.req.start_state):
            raise PlanningError(
                PlanningCode.INVALID_ROBOT_STATE,
                f'sequence: item {number} has a start state, and {group} is moved before it; only'
                ' the first item of a group may have one',
            )
    for number, ((group, following), radius) in enumerate(
        zip(pairwise(groups), radii, strict=False)
    ):
        if group != following and radius > 0.0:
            raise PlanningError(
                PlanningCode.INVALID_MOTION_PLAN,
                f'sequence: item {number} has a blend radius of {radius:g} m, and the next moves'
                f' {following} instead of {group}; give 0',
            )
    numbered = groupby(enumerate(items), key=lambda pair: pair[1].req.group_name)
    runs = [(group, list(pairs)) for group, pairs in numbered]
    return [GroupRun(group, pairs[0][0], [item for _, item in pairs]) for group, pairs in runs]


def has_state(message: Any) -> bool:  # noqa: ANN401  # messages have no type
    """Return whether a moveit_msgs/RobotState says where a robot is, or what is attached to it."""
    return bool(message.joint_state.name or message.attached_collision_objects)

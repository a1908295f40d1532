# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Controllers by the kinds of their actions, as moveit_simple_controller_manager has them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from control_msgs.action import FollowJointTrajectory, GripperCommand, ParallelGripperCommand
from trajectory_msgs.msg import JointTrajectory


@dataclass(frozen=True, slots=True)
class ControllerKind:
    """What a controller takes."""

    name: str  # MoveIt's name of it
    action: Any  # class of its action
    namespace: str  # name of its action below that of the controller, by default
    # makes a goal of the part of a trajectory that is for its joints
    goal: Callable[[JointTrajectory], Any]
    single: bool = False  # whether it moves one joint only


@dataclass(frozen=True, slots=True)
class Controller:
    """A controller."""

    joints: Sequence[str]  # joints that it moves
    kind: ControllerKind  # what it takes
    namespace: str  # name of its action below that of the controller
    max_effort: float = 0.0  # greatest effort of a GripperCommand in [N]; 0 for its own

    def goal(self, part: JointTrajectory) -> Any:  # noqa: ANN401  # messages have no type
        """Return the goal of its action for the part of a trajectory that is for its joints."""
        goal = self.kind.goal(part)
        if self.kind.single and self.max_effort:
            goal.command.max_effort = self.max_effort
        return goal

    def action(self, name: str) -> str:
        """Return the name of its action, by its own."""
        return f'{name}/{self.namespace}'


def _follow(part: JointTrajectory) -> Any:  # noqa: ANN401  # messages have no type
    return FollowJointTrajectory.Goal(trajectory=part)


def _grip(part: JointTrajectory) -> Any:  # noqa: ANN401
    """Return where the trajectory ends: how a gripper gets there is its own affair."""
    goal = GripperCommand.Goal()
    (goal.command.position,) = part.points[-1].positions
    return goal


def _grip_in_parallel(part: JointTrajectory) -> Any:  # noqa: ANN401
    goal = ParallelGripperCommand.Goal()
    goal.command.name = list(part.joint_names)
    goal.command.position = list(part.points[-1].positions)
    return goal


FOLLOW = ControllerKind(
    'FollowJointTrajectory', FollowJointTrajectory, 'follow_joint_trajectory', _follow
)
KINDS = {
    each.name: each
    for each in (
        FOLLOW,
        ControllerKind('GripperCommand', GripperCommand, 'gripper_cmd', _grip, single=True),
        ControllerKind(
            'ParallelGripperCommand',
            ParallelGripperCommand,
            'parallel_gripper_cmd',
            _grip_in_parallel,
        ),
    )
}
"""Kinds of controllers by MoveIt's names."""

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The two actions of a gripper: what their goals ask, and their feedback and results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

from control_msgs.action import GripperCommand, ParallelGripperCommand
from sensor_msgs.msg import JointState

from arm_model import CommandError, RobotState

from ...core.requests import TargetRequest


@dataclass(frozen=True, slots=True)
class GripperState:
    """Where a gripper is."""

    joints: Sequence[str]  # names of its joints
    measured: RobotState  # what was measured of them
    stalled: bool = False  # it does not move although it is not at the goal
    reached: bool = False  # it is at the goal


class SingleGripper:
    """``control_msgs/GripperCommand``: the position of the one joint."""

    action: Any = GripperCommand
    name = '~/gripper_cmd'

    def request(self, goal: Any, joints: Sequence[str]) -> TargetRequest:  # noqa: ANN401
        """Return what a goal asks."""
        return TargetRequest(_finite({joints[0]: goal.command.position}))

    def asks_effort(self, goal: Any) -> bool:  # noqa: ANN401
        """Whether a goal asks for a limit of effort."""
        return bool(goal.command.max_effort)

    def feedback(self, state: GripperState) -> Any:  # noqa: ANN401
        """Return a state as feedback."""
        return GripperCommand.Feedback(**self._fields(state))

    def result(self, state: GripperState) -> Any:  # noqa: ANN401
        """Return a state as result."""
        return GripperCommand.Result(**self._fields(state))

    def _fields(self, state: GripperState) -> dict[str, Any]:
        position = float(state.measured.position[0])
        return {'position': position, 'stalled': state.stalled, 'reached_goal': state.reached}


class ParallelGripper:
    """``control_msgs/ParallelGripperCommand``: positions of joints, and how fast at most."""

    action: Any = ParallelGripperCommand
    name = '~/parallel_gripper_cmd'

    def request(self, goal: Any, joints: Sequence[str]) -> TargetRequest:  # noqa: ANN401
        """Return what a goal asks; one joint need not be named."""
        command = goal.command
        names = list(command.name) or list(joints[:1])
        if len(names) != len(command.position):
            raise CommandError(f'{len(names)} names, but {len(command.position)} positions')
        if lost := [name for name in names if name not in joints]:
            raise CommandError(f'no joint {lost[0]!r} in the gripper; joints: {", ".join(joints)}')
        if twice := [name for name in names if names.count(name) > 1]:
            raise CommandError(f'joint {twice[0]!r} is named twice')
        if wrong := [speed for speed in command.velocity if not speed >= 0.0]:
            raise CommandError(f'velocity {wrong[0]}: it must be above 0, or 0 for the limit')
        speeds = [speed for speed in command.velocity if speed > 0.0]
        targets = _finite(dict(zip(names, command.position, strict=True)))
        return TargetRequest(targets, min(speeds, default=math.inf))

    def asks_effort(self, goal: Any) -> bool:  # noqa: ANN401
        """Whether a goal asks for a limit of effort."""
        return any(goal.command.effort)

    def feedback(self, state: GripperState) -> Any:  # noqa: ANN401
        """Return a state as feedback."""
        return ParallelGripperCommand.Feedback(state=self._joints(state))

    def result(self, state: GripperState) -> Any:  # noqa: ANN401
        """Return a state as result."""
        return ParallelGripperCommand.Result(
            state=self._joints(state), stalled=state.stalled, reached_goal=state.reached
        )

    def _joints(self, state: GripperState) -> JointState:
        return JointState(
            name=list(state.joints),
            position=state.measured.position.tolist(),
            velocity=state.measured.velocity.tolist(),
        )


GripperInterface = SingleGripper | ParallelGripper


def _finite(positions: Mapping[str, float]) -> Mapping[str, float]:
    for name, position in positions.items():
        if not math.isfinite(position):
            raise CommandError(f'{name}: {position} is no position')
    return positions

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The two actions of a gripper: what their goals ask, and their feedback and results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
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


@dataclass(frozen=True, slots=True)
class GripperInterface:
    """An action of a gripper; its goals and messages have no type."""

    action: Any
    name: str
    request: Callable[[Any, Sequence[str]], TargetRequest]  # what a goal asks of the joints
    asks_effort: Callable[[Any], bool]  # whether a goal asks for a limit of effort

    def feedback(self, state: GripperState) -> Any:  # noqa: ANN401
        """Return a state as feedback."""
        return _message(self.action.Feedback, state)

    def result(self, state: GripperState) -> Any:  # noqa: ANN401
        """Return a state as result."""
        return _message(self.action.Result, state)


def _single_request(goal: Any, joints: Sequence[str]) -> TargetRequest:  # noqa: ANN401
    return TargetRequest(_finite({joints[0]: goal.command.position}))


def _parallel_request(goal: Any, joints: Sequence[str]) -> TargetRequest:  # noqa: ANN401
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


def _finite(positions: Mapping[str, float]) -> Mapping[str, float]:
    for name, position in positions.items():
        if not math.isfinite(position):
            raise CommandError(f'{name}: {position} is no position')
    return positions


def _message(kind: Any, state: GripperState) -> Any:  # noqa: ANN401
    """Return a state as a message, which may lack some of the fields."""
    measured = state.measured
    fields = {
        'position': float(measured.position[0]),
        'state': JointState(
            name=list(state.joints),
            position=measured.position.tolist(),
            velocity=measured.velocity.tolist(),
        ),
        'stalled': state.stalled,
        'reached_goal': state.reached,
    }
    known = kind.get_fields_and_field_types()
    return kind(**{name: value for name, value in fields.items() if name in known})


SINGLE = GripperInterface(
    GripperCommand, '~/gripper_cmd', _single_request, lambda goal: bool(goal.command.max_effort)
)
"""The position of the one joint."""

PARALLEL = GripperInterface(
    ParallelGripperCommand,
    '~/parallel_gripper_cmd',
    _parallel_request,
    lambda goal: any(goal.command.effort),
)
"""Positions of joints, and how fast at most."""

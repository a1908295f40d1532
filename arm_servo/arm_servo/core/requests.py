# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Data exchanged between any thread and the cycle: requests in, snapshots out.

A request is a plain value; a :class:`arm_trajectory.TrajectoryGoal` requests a
trajectory.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
import math

import numpy as np

from arm_model import (
    Array,
    checked,
    combined,
    CommandError,
    JointLimits,
    Mask,
    Pose,
    RobotModel,
    RobotState,
)
from arm_trajectory import TrajectoryGoal

from ..controllers.controller import Controller, SetPoint, Source
from ..controllers.jog import Command, JointCommand, PoseCommand, TwistCommand
from ..controllers.trajectory import Execution

ROTATION_TOLERANCE = 1e-3  # allowed deviation from orthonormality, for rounding of quaternions


class CommandType(IntEnum):
    """Kinds of commands, numbered as in moveit_msgs/srv/ServoCommandType."""

    JOINT_JOG = 0
    TWIST = 1
    POSE = 2


@dataclass(frozen=True, slots=True, eq=False)
class JogRequest:
    """Move the tool or joints at a speed, or track a pose, until the request expires."""

    command: Command  # the commanded motion
    expires: float  # steady time at which the request expires in [s]
    # frame of the command, as a link or a pose in the base: reference point and axes of a twist,
    # frame of a pose; None: reference point at the tip, axes of the base
    frame: str | Pose | None = None
    client: Hashable = None  # the client; its zero command stops only its own jog

    @property
    def is_zero(self) -> bool:
        """Whether the request commands standstill."""
        if isinstance(self.command, TwistCommand):
            return not self.command.twist.any()
        return isinstance(self.command, JointCommand) and not self.command.velocity.any()


@dataclass(frozen=True, slots=True)
class DisplacementRequest:
    """Move joints by relative amounts; displacements add up during the motion."""

    displacements: Mapping[str, float]  # relative motions in [rad] by joint
    max_speed: float = math.inf  # greatest speed of a joint in [rad/s]

    @property
    def is_zero(self) -> bool:
        """Whether the request commands standstill."""
        return not any(self.displacements.values())

    def beyond(self, before: MotionRequest) -> DisplacementRequest:
        """Return this displacement added to an earlier one; it replaces any other motion."""
        if not isinstance(before, DisplacementRequest):
            return self
        ways = {name: before.displacements.get(name, 0.0) for name in self.displacements}
        sums = {name: way + ways[name] for name, way in self.displacements.items()}
        return replace(self, displacements={**before.displacements, **sums})


@dataclass(frozen=True, slots=True)
class TargetRequest:
    """Move joints to positions; the others come to rest."""

    positions: Mapping[str, float]  # targets in [rad] by joint
    max_speed: float = math.inf  # greatest speed of a joint in [rad/s]


@dataclass(frozen=True, slots=True, eq=False)
class StopRequest:
    """Come to rest: a trajectory on its path, anything else in the shortest time."""

    reason: str = 'stopped'  # why, for the outcome of the motion that this ends
    # sources to stop; others continue. None stops every source
    sources: tuple[Source, ...] | None = None
    motion: Controller | None = None  # the motion to stop; others continue. None stops any


@dataclass(frozen=True, slots=True)
class PauseRequest:
    """Pause: bring the arm to rest, a trajectory on its path, and refuse jogs; or resume."""

    is_paused: bool = True  # True pauses, False resumes


@dataclass(frozen=True, slots=True)
class SpeedRequest:
    """Set the speed override of trajectories and targets."""

    speed: float  # 0 to 1; 0 is a pause


MotionRequest = DisplacementRequest | TargetRequest | TrajectoryGoal
"""Requests that are planned and checked for collisions before they start."""

ImmediateRequest = JogRequest | StopRequest | PauseRequest | SpeedRequest
"""Requests that need no planning and apply from the next cycle on."""


def check_limits(limits: JointLimits, target: Array) -> None:
    """Check that target positions in [rad] are within the joint limits.

    Raises:
        CommandError: A position exceeds its limits.
    """
    if words := limits.beyond(target, 0.0):
        raise CommandError(words)


def by_joint(model: RobotModel, values: Mapping[str, float], what: str) -> tuple[Array, Mask]:
    """Sort values by joint order.

    Returns:
        The values, 0 for joints without one, and the mask of the joints with a value.

    Raises:
        CommandError: No joint is named, a joint is unknown, or a value is not finite.
    """
    if not values:
        raise CommandError(f'{what}: no joint is named')
    places = [model.index(name) for name in values]
    numbers = checked(list(values.values()), len(values), what)
    ordered, mask = np.zeros(len(model)), np.zeros(len(model), dtype=np.bool_)
    ordered[places], mask[places] = numbers, True
    return ordered, mask


def moves_nothing(model: RobotModel, request: MotionRequest) -> bool:
    """Return whether a motion is a displacement by zero, which has no effect.

    Raises:
        CommandError: The zero displacement names an unknown joint or none.
    """
    if not isinstance(request, DisplacementRequest) or not request.is_zero:
        return False
    by_joint(model, request.displacements, 'displacements')
    return True


def check_request(model: RobotModel, request: ImmediateRequest) -> None:
    """Check a request that needs no planning.

    Raises:
        CommandError: A number is not finite or out of range, a length is wrong, the link is
            unknown, or the axes are not a rotation.
    """
    if isinstance(request, SpeedRequest) and not 0.0 <= request.speed <= 1.0:
        raise CommandError(f'speed override {request.speed}: it must be between 0 and 1')
    if not isinstance(request, JogRequest):
        return
    command = request.command
    if isinstance(command, TwistCommand):
        checked(command.twist, 6, 'twist')
        model.check_link(command.link)
        if command.axes is not None:
            _check_rotation(command.axes, 'axes')
    elif isinstance(command, PoseCommand):
        checked(command.pose.position, 3, 'position')
        _check_rotation(command.pose.rotation, 'rotation')
    else:
        checked(command.velocity, len(model), 'velocities')
    if not math.isfinite(request.expires):
        raise CommandError(f'a jog expires at {request.expires} s: it must be finite')


def in_base(model: RobotModel, positions: Array, request: JogRequest) -> Command:
    """Convert the command of a request to the base frame, with the tip as reference point."""
    command, frame = request.command, request.frame
    if frame is None or isinstance(command, JointCommand):
        return command
    place = model.pose(positions, frame) if isinstance(frame, str) else frame
    if isinstance(command, PoseCommand):
        return replace(command, pose=combined(place, command.pose))
    linear, angular = place.rotation @ command.twist[:3], place.rotation @ command.twist[3:]
    lever = model.pose(positions).position - place.position
    return TwistCommand(np.concatenate((linear + np.cross(angular, lever), angular)))


def _check_rotation(values: Array, what: str) -> None:
    rotation = checked(np.ravel(values), 9, what).reshape(3, 3)
    off = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if off > ROTATION_TOLERANCE or np.linalg.det(rotation) < 0.0:
        raise CommandError(f'{what}: not a rotation; is the quaternion of unit length?')


MAX_CYCLE_AGE = 0.25
"""Age in [s] of the last cycle from which it counts as stalled, and commands are refused."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """Snapshot of the motion core after one cycle."""

    time: float  # steady time of the cycle in [s]
    set_point: SetPoint | None  # what was commanded; None while the arm does not follow
    measured: RobotState | None  # what was measured; None before the first feedback
    blocked: str  # why the arm does not follow, with the remedy; empty while it does
    paused: bool = False  # whether it is paused
    speed: float = 1.0  # speed override, 0 to 1
    # age in [s] of each joint's measured values in this cycle; None: measured in this
    # cycle
    ages: Array | None = None
    # the trajectory that was followed last; None before the first
    execution: Execution | None = None

    @property
    def source(self) -> Source:
        """The source that moves the arm."""
        return Source.NONE if self.set_point is None else self.set_point.source

    @property
    def speed_scaling(self) -> float:
        """Effective speed override, 0 to 1; 0 while paused."""
        return 0.0 if self.paused else self.speed

    @property
    def reference(self) -> RobotState | None:
        """The commanded state, or the measured one while not following; None while unknown."""
        if self.set_point is not None:
            return self.set_point.state
        if self.measured is None or not np.isfinite(self.measured.position).all():
            return None
        return RobotState.at_rest(self.measured.position)

    def stale(self, age: float) -> str:
        """Return a message if the cycle is stalled; empty if it runs."""
        if age <= MAX_CYCLE_AGE:
            return ''
        begun = f'{age:.1f} s ago' if self.time else 'never'
        return f'the cycle does not run (the last was {begun}); is the bus up?'

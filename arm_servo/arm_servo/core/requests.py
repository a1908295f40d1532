# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Requests to the motion core, as values; nothing in them moves anything.

A trajectory is requested by a :class:`arm_trajectory.TrajectoryGoal`.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
import math

from arm_model import Pose
from arm_trajectory import TrajectoryGoal

from ..jog.servo_source import Command, JointCommand, TwistCommand
from .arbiter import Motion
from .set_point import Source


@dataclass(frozen=True, slots=True, eq=False)
class JogRequest:
    """Move the tool or joints at a speed, or track a pose, until the request expires."""

    command: Command  # what the arm does
    expires: float  # steady time at which the request expires in [s]
    # link, or pose in the base, about whose origin a twist turns and along whose axes it is given,
    # and in which a pose is given; None for the tip, and for the base
    frame: str | Pose | None = None
    client: Hashable = None  # who asks: standing still is a command only for whoever is jogging

    @property
    def is_zero(self) -> bool:
        """Whether it asks for standing still."""
        if isinstance(self.command, TwistCommand):
            return not self.command.twist.any()
        return isinstance(self.command, JointCommand) and not self.command.velocity.any()


@dataclass(frozen=True, slots=True)
class DisplacementRequest:
    """Move joints on by amounts; displacements add up while they are carried out."""

    displacements: Mapping[str, float]  # how far in [rad] by joint
    max_speed: float = math.inf  # greatest speed of a joint in [rad/s]

    @property
    def is_zero(self) -> bool:
        """Whether it asks for standing still."""
        return not any(self.displacements.values())


@dataclass(frozen=True, slots=True)
class TargetRequest:
    """Move joints to positions; the others come to rest."""

    positions: Mapping[str, float]  # targets in [rad] by joint
    max_speed: float = math.inf  # greatest speed of a joint in [rad/s]


@dataclass(frozen=True, slots=True, eq=False)
class StopRequest:
    """Come to rest: a trajectory on its path, anything else in the shortest time."""

    reason: str = 'stopped'  # why, for the outcome of the motion that this ends
    # what is stopped; other sources go on. None for whatever moves the arm
    sources: tuple[Source, ...] | None = None
    motion: Motion | None = None  # the motion that is stopped; another one goes on. None for any


@dataclass(frozen=True, slots=True)
class PauseRequest:
    """Come to rest, a trajectory on its path, and refuse jogging; or go on after that."""

    is_paused: bool = True  # whether to come to rest; else to go on


@dataclass(frozen=True, slots=True)
class SpeedRequest:
    """Set the speed override of trajectories and targets."""

    speed: float  # 0 to 1; 0 is a pause


MotionRequest = DisplacementRequest | TargetRequest | TrajectoryGoal
"""Requests that are planned, and checked for collisions, before they may begin."""

ImmediateRequest = JogRequest | StopRequest | PauseRequest | SpeedRequest
"""Requests for which nothing is planned: they count from the next cycle on."""

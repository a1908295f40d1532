# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories as they come from outside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GoalPoint:
    """A point of a trajectory; empty where a field is not given.

    Attributes:
        time: Time from the start in [s].
        positions: Positions in [rad].
        velocities: Velocities in [rad/s].
        accelerations: Accelerations in [rad/s2].
    """

    time: float
    positions: Sequence[float]
    velocities: Sequence[float] = ()
    accelerations: Sequence[float] = ()


@dataclass(frozen=True, slots=True)
class JointTolerance:
    """How far a joint may be off; 0 keeps the default, -1 takes it away.

    Attributes:
        position: In [rad].
        velocity: In [rad/s].
    """

    position: float = 0.0
    velocity: float = 0.0


@dataclass(frozen=True, slots=True)
class TrajectoryGoal:
    """A trajectory to follow.

    Attributes:
        joints: Names of the joints, in the order of the points' numbers.
        points: Its points.
        age: How long ago it began in [s]; 0 begins now, less than 0 begins later.
        path_tolerance: Tolerances on the way, by joint.
        goal_tolerance: Tolerances at the end, by joint.
        goal_time: Time to reach the goal within tolerance after the end in [s]; 0 is the default.
    """

    joints: Sequence[str]
    points: Sequence[GoalPoint]
    age: float = 0.0
    path_tolerance: Mapping[str, JointTolerance] | None = None
    goal_tolerance: Mapping[str, JointTolerance] | None = None
    goal_time: float = 0.0


@dataclass(frozen=True, slots=True)
class GoalRules:
    """What is accepted.

    Attributes:
        partial: Whether joints may be missing; they stay where they are.
        end_velocity: Whether the last point may have a velocity; the arm comes to rest behind it.
        start: How far a first point without time may be from the arm in [rad].
    """

    partial: bool = False
    end_velocity: bool = False
    start: float = 0.05

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories as they come from outside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class GoalPoint:
    """A point of a trajectory; empty where a field is not given."""

    time: float  # time from the start in [s]
    positions: Sequence[float]  # positions in [rad]
    velocities: Sequence[float] = ()  # velocities in [rad/s]
    accelerations: Sequence[float] = ()  # accelerations in [rad/s2]


@dataclass(frozen=True, slots=True)
class JointTolerance:
    """How far a joint may be off; 0 keeps the default, -1 takes it away."""

    position: float = 0.0  # in [rad]
    velocity: float = 0.0  # in [rad/s]


@dataclass(frozen=True, slots=True)
class TrajectoryGoal:
    """A trajectory to follow."""

    joints: Sequence[str]  # names of the joints, in the order of the points' numbers
    points: Sequence[GoalPoint]  # its points
    age: float = 0.0  # how long ago it began in [s]; 0 begins now, less than 0 begins later
    path_tolerance: Mapping[str, JointTolerance] | None = None  # tolerances on the way, by joint
    goal_tolerance: Mapping[str, JointTolerance] | None = None  # tolerances at the end, by joint
    # time to reach the goal within tolerance after the end in [s]; 0 is the default
    goal_time: float = 0.0


@dataclass(frozen=True, slots=True)
class GoalRules:
    """What is accepted."""

    partial: bool = False  # whether joints may be missing; they stay where they are
    # whether the last point may have a velocity; the arm comes to rest behind it
    end_velocity: bool = False
    start: float = 0.05  # how far a first point without time may be from the arm in [rad]

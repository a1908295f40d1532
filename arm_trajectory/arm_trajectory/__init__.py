# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories of an arm, before and during execution. Pure: no ROS, no clock, no I/O.

A :class:`TrajectoryGoal` becomes a :class:`Path` (:func:`build_path`): segments between its
points, with rounded corners, time-scaled to the joint limits. :class:`PathCheck` finds collisions
on it. A :class:`TrajectoryTimer` scales the speed of its execution, a
:class:`CatchUpInterpolator` leads an arm onto it, and an :class:`OnlineTrajectoryGenerator` plans
from state to state.

Conventions: joint vectors are in the order of the arm's joints in [rad], or [m] for prismatic
joints; velocities and accelerations in these units per [s] and [s2]. Times are in [s]; ``period``
is the cycle time. ``state`` is the last commanded state, ``measured`` that reported by the drives.
"""

from __future__ import annotations

from .execution import CatchUpInterpolator, TimerState, TrajectoryTimer
from .goal import (
    DefaultTolerances,
    GoalCode,
    GoalError,
    GoalPoint,
    GoalRules,
    JointTolerance,
    merge_tolerances,
    StateMovedError,
    Tolerances,
    TrajectoryGoal,
)
from .goal_path import build_path
from .otg import brakeable, hard_brake, OnlineTrajectoryGenerator, Plan
from .path import cubics, Excess, farthest_beyond, lines, Path, PathCheck, PathContact, quintics
from .time_scaling import Demand, Timing

__all__ = [
    'CatchUpInterpolator',
    'DefaultTolerances',
    'Demand',
    'Excess',
    'GoalCode',
    'GoalError',
    'GoalPoint',
    'GoalRules',
    'JointTolerance',
    'OnlineTrajectoryGenerator',
    'Path',
    'PathCheck',
    'PathContact',
    'Plan',
    'StateMovedError',
    'TimerState',
    'Timing',
    'Tolerances',
    'TrajectoryGoal',
    'TrajectoryTimer',
    'brakeable',
    'build_path',
    'cubics',
    'farthest_beyond',
    'hard_brake',
    'lines',
    'merge_tolerances',
    'quintics',
]

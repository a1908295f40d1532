# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Requests to a planner and the plans it returns; all immutable.

Joint vectors are in the order of the model's joints, in [rad] or [m]; poses are those of a link in
the root link.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, IntEnum

import numpy as np

from arm_model import Array, frozen, PlacedShape, Pose
from arm_trajectory import Path

from .exceptions import PlanningCode, PlanningError

DEFAULT_TIMEOUT = 5.0  # time for planning in [s], as MoveGroupInterface has it


@dataclass(frozen=True, slots=True, eq=False)
class JointGoal:
    """A goal in joint space."""

    positions: Array  # joint positions in [rad] (n)
    # tolerance of each joint in [rad] (n); empty for none
    tolerance: Array = field(default_factory=lambda: frozen(np.zeros(0)))


class Parameterization(IntEnum):
    """Parameterization of a rotation error; values as in moveit_msgs/OrientationConstraint."""

    XYZ_EULER_ANGLES = 0
    ROTATION_VECTOR = 1


@dataclass(frozen=True, slots=True, eq=False)
class OrientationConstraint:
    """Required orientation of a link."""

    link: str  # the link; empty for the tip
    rotation: Array  # rotation matrix (3, 3) from the link that is wanted to the root link
    # greatest angle about each axis in [rad] (3); pi or more allows any angle
    tolerance: Array
    parameterization: Parameterization = Parameterization.ROTATION_VECTOR  # meaning of tolerance
    # rotation matrix (3, 3) to the link of the body or subframe that is turned so
    in_link: Array = field(default_factory=lambda: frozen(np.eye(3)))


@dataclass(frozen=True, slots=True, eq=False)
class PositionConstraint:
    """Regions in one of which a point of a link must lie."""

    link: str  # the link; empty for the tip
    offset: Array  # the point in the link in [m] (3)
    # boxes, spheres, cylinders and cones in the root link, one of which holds it
    regions: Sequence[PlacedShape]


@dataclass(frozen=True, slots=True, eq=False)
class PathConstraints:
    """Constraints that hold along a whole path."""

    # least and greatest position in [rad], by joint
    joints: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    orientations: Sequence[OrientationConstraint] = ()  # how links are turned
    positions: Sequence[PositionConstraint] = ()  # where points of links are


@dataclass(frozen=True, slots=True, eq=False)
class PoseGoal:
    """A goal pose of a link."""

    pose: Pose  # where the link is to be, in the root link
    link: str = ''  # the link; empty for the tip
    # accepted if the exact pose cannot be reached; None accepts the exact pose only
    tolerances: PathConstraints | None = None


Goal = JointGoal | PoseGoal  # what a motion is to reach


class CircPointKind(str, Enum):
    """Meaning of the auxiliary point of CIRC, named as in the Pilz planner."""

    INTERIM = 'interim'
    CENTER = 'center'


@dataclass(frozen=True, slots=True, eq=False)
class CircPoint:
    """The auxiliary point that defines the circle between a start and a goal."""

    kind: CircPointKind  # a point on the arc, or its center
    position: Array  # the point in the root link in [m] (3)


@dataclass(frozen=True, slots=True, eq=False)
class MotionRequest:
    """Request for a motion from rest to rest."""

    start: Array  # joint positions at which it begins in [rad] (n)
    goals: Sequence[Goal]  # alternatives, of which one is reached
    planner_id: str = ''  # the planner by MoveIt's name; empty for the default
    velocity_scaling: float = 1.0  # factor of the velocity limits, above 0 and up to 1
    acceleration_scaling: float = 1.0  # factor of the acceleration limits, above 0 and up to 1
    timeout: float = DEFAULT_TIMEOUT  # time for planning in [s]
    attempts: int = 1  # how many paths are planned; the shortest is returned
    constraints: PathConstraints | None = None  # hold along the whole path
    via: CircPoint | None = None  # auxiliary point, for CIRC
    max_cartesian_speed: float = 0.0  # of the link below in [m/s]; 0 for no limit
    cartesian_speed_link: str = ''  # the link whose speed is limited; empty for the tip


@dataclass(frozen=True, slots=True, eq=False)
class MotionPlan:
    """A planned motion."""

    path: Path  # the path with its times, jerk-limited, from rest to rest
    planner_id: str  # the planner that found it
    notes: Sequence[str] = ()  # for the user, such as why the motion is slower than requested
    planning_time: float = 0.0  # how long it took in [s]; 0 where that was not measured


def check_scaling(request: MotionRequest, least: float = 0.0) -> None:
    """Refuse velocity and acceleration scaling factors below ``least`` or above 1."""
    for name in ('velocity_scaling', 'acceleration_scaling'):
        value = getattr(request, name)
        if not (0.0 < value <= 1.0 and value >= least):
            bounds = f'from {least:g} to 1' if least else 'above 0 and up to 1'
            raise PlanningError(PlanningCode.FAILURE, f'{name} is {value}; it must be {bounds}')

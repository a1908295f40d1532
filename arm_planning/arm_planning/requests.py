# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is asked of a planner, and what it answers; all immutable.

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

DEFAULT_TIMEOUT = 5.0
"""Time for planning in [s], as MoveGroupInterface has it."""


@dataclass(frozen=True, slots=True, eq=False)
class JointGoal:
    """A goal in joint space.

    Attributes:
        positions: Joint positions in [rad] (n).
        tolerance: How far each may be off in [rad] (n); empty for exactly there.
    """

    positions: Array
    tolerance: Array = field(default_factory=lambda: frozen(np.zeros(0)))


class Parameterization(IntEnum):
    """Angles of a turn; numbers of moveit_msgs/OrientationConstraint."""

    XYZ_EULER_ANGLES = 0
    ROTATION_VECTOR = 1


@dataclass(frozen=True, slots=True, eq=False)
class OrientationConstraint:
    """How a link is to be turned.

    Attributes:
        link: The link; empty for the tip.
        rotation: Rotation matrix (3, 3) from the link that is wanted to the root link.
        tolerance: Greatest angles about the wanted axes in [rad] (3); pi and more is any angle.
        parameterization: Which angles these are.
        in_link: Rotation matrix (3, 3) to the link of the body or subframe that is turned so.
    """

    link: str
    rotation: Array
    tolerance: Array
    parameterization: Parameterization = Parameterization.ROTATION_VECTOR
    in_link: Array = field(default_factory=lambda: frozen(np.eye(3)))


@dataclass(frozen=True, slots=True, eq=False)
class PositionConstraint:
    """Where a point of a link is to be.

    Attributes:
        link: The link; empty for the tip.
        offset: The point in the link in [m] (3).
        regions: Boxes, spheres, cylinders and cones in the root link, one of which holds it.
    """

    link: str
    offset: Array
    regions: Sequence[PlacedShape]


@dataclass(frozen=True, slots=True, eq=False)
class PathConstraints:
    """What holds everywhere on a path.

    Attributes:
        joints: Least and greatest position in [rad], by joint.
        orientations: How links are turned.
        positions: Where points of links are.
    """

    joints: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    orientations: Sequence[OrientationConstraint] = ()
    positions: Sequence[PositionConstraint] = ()


@dataclass(frozen=True, slots=True, eq=False)
class PoseGoal:
    """A goal for a link.

    Attributes:
        pose: Where the link is to be, in the root link.
        link: The link; empty for the tip.
        tolerances: What is enough where that cannot be reached; None for the pose alone.
    """

    pose: Pose
    link: str = ''
    tolerances: PathConstraints | None = None


Goal = JointGoal | PoseGoal
"""What a motion is to reach."""


class CircPointKind(str, Enum):
    """What the point of a circle is, in the words of Pilz' planner."""

    INTERIM = 'interim'
    CENTER = 'center'


@dataclass(frozen=True, slots=True, eq=False)
class CircPoint:
    """The point that makes a circle of a start and a goal.

    Attributes:
        kind: A point on the arc, or its center.
        position: The point in the root link in [m] (3).
    """

    kind: CircPointKind
    position: Array


@dataclass(frozen=True, slots=True, eq=False)
class MotionRequest:
    """A motion that is asked for, from rest to rest.

    Attributes:
        start: Joint positions at which it begins in [rad] (n).
        goals: Alternatives, of which one is reached.
        planner_id: The planner by MoveIt's name; empty for the default.
        velocity_scaling: Factor of the velocity limits, above 0 and up to 1.
        acceleration_scaling: Factor of the acceleration limits, above 0 and up to 1.
        timeout: Time for planning in [s].
        attempts: How many paths are planned, of which the shortest counts.
        constraints: What holds everywhere on the path.
        via: The point of a circle, for CIRC.
        max_cartesian_speed: Of the link below in [m/s]; 0 for no limit.
        cartesian_speed_link: The link whose speed is limited; empty for the tip.
    """

    start: Array
    goals: Sequence[Goal]
    planner_id: str = ''
    velocity_scaling: float = 1.0
    acceleration_scaling: float = 1.0
    timeout: float = DEFAULT_TIMEOUT
    attempts: int = 1
    constraints: PathConstraints | None = None
    via: CircPoint | None = None
    max_cartesian_speed: float = 0.0
    cartesian_speed_link: str = ''


@dataclass(frozen=True, slots=True, eq=False)
class MotionPlan:
    """A motion that was found.

    Attributes:
        path: The path with its times, jerk-limited, from rest to rest.
        planner_id: The planner that found it.
        notes: What a person should know, such as where it is slower than asked.
        planning_time: How long it took in [s]; 0 where nobody measured.
    """

    path: Path
    planner_id: str
    notes: Sequence[str] = ()
    planning_time: float = 0.0

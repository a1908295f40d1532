# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The joints of a URDF that have a motor, with their ranges."""

from __future__ import annotations

from dataclasses import dataclass
import math

from urdf_reader import DescriptionError, JointKind, KinematicTree, read_urdf
from urdf_reader import Joint as UrdfJoint


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Range of a joint."""

    lower: float = -math.inf  # smallest position in [rad] or [m]
    upper: float = math.inf  # largest position in [rad] or [m]
    velocity: float = math.inf  # largest speed in [rad/s] or [m/s]
    effort: float = math.inf  # largest torque in [N m] or force in [N]

    def clamp(self, position: float) -> float:
        """Return the nearest position within the range."""
        return min(max(position, self.lower), self.upper)


@dataclass(frozen=True, slots=True)
class Joint:
    """A joint that takes commands of its own."""

    name: str  # name in the URDF
    limits: JointLimits  # its range


def movable_joints(urdf: str | KinematicTree) -> tuple[Joint, ...]:
    """Return the joints that have a motor, in the order of the URDF; those that mimic do not.

    Raises:
        DescriptionError: It is no URDF, or a joint has no usable limits.
    """
    tree = read_urdf(urdf) if isinstance(urdf, str) else urdf
    return tuple(Joint(joint.name, limits_of(joint)) for joint in tree.joints if joint.independent)


def limits_of(joint: UrdfJoint) -> JointLimits:
    """Return the range of a movable joint.

    Raises:
        DescriptionError: It has no limits, or these have no finite numbers.
    """
    given = joint.limit or {}
    if missing := [key for key in ('velocity', 'effort') if key not in given]:
        raise DescriptionError(
            f'joint {joint.name}: a {joint.kind.value} joint needs <limit .../> with '
            f'{" and ".join(missing)}'
        )
    span = joint.range
    try:
        effort = float(given['effort'])
    except ValueError as error:
        raise DescriptionError(f'joint {joint.name}: <limit> is not usable: {error}') from error
    ends = () if joint.kind is JointKind.CONTINUOUS else (span.lower, span.upper)
    if not all(map(math.isfinite, (*ends, span.velocity, effort))):
        raise DescriptionError(f'joint {joint.name}: <limit> has a number that is not finite')
    return JointLimits(span.lower, span.upper, span.velocity, effort)

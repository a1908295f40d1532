# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The teacher of getting up: where the legs go, as a function of gravity, without a past.

Its poses are data: the cross-entropy method searched them in simulation, for the XGO of
quad_description and its servos. From its back it knows no way; it stands, whatever is below.
"""

from __future__ import annotations

from quad_description import Pose, pose_positions, Quadruped, Targets
from quad_description.rotations import Vector

Legs = tuple[Vector, Vector, Vector, Vector]
"""Hip, thigh and calf of each leg in [rad], in the order of :data:`quad_description.LEGS`."""

ON_SIDE = 0.9  # of gravity along the body's y axis: from here on it lies on a side
LEANING = 0.5  # from here on it leans on a side
OVERTURNED = 0.8  # of gravity along the body's z axis: from here on it lies on its back
TIPPED = 0.57  # of gravity along the body's x axis: from here on it stands on its nose or tail

ON_LEFT: Legs = (
    (0.45, 1.26, -0.22),
    (0.2, 0.28, -0.24),
    (0.36, 0.98, -0.49),
    (0.17, -0.41, -0.44),
)
"""Legs of a robot that lies on its left side."""
LEANING_LEFT: Legs = (
    (0.41, 0.77, -0.93),
    (-0.04, 0.52, -0.23),
    (0.31, -0.47, -0.57),
    (0.0, 0.39, -0.29),
)
"""Legs of one that leans on it."""

ON_NOSE: Legs = (*((0.02, 1.32, -1.03),) * 2, *((0.34, 1.06, -0.84),) * 2)
ON_TAIL: Legs = (*((0.2, -0.17, -0.5),) * 2, *((0.4, -1.03, -0.28),) * 2)


class GetUpTeacher:
    """Answers the joint targets that bring a robot onto its belly, and from there to its feet."""

    def __init__(self, robot: Quadruped) -> None:
        """Prepare the poses of a robot."""
        stand = pose_positions(Pose.STAND)
        self.stand: Targets = tuple(stand[name] for name in robot.names)
        self._left = tuple(self._placed(robot, legs) for legs in (ON_LEFT, LEANING_LEFT))
        self._nose, self._tail = (self._placed(robot, legs) for legs in (ON_NOSE, ON_TAIL))
        self._right = tuple(
            self._placed(robot, (legs[1], legs[0], legs[3], legs[2]))
            for legs in (ON_LEFT, LEANING_LEFT)
        )

    def targets(self, down: Vector) -> Targets:
        """Return the joint targets in [rad].

        Args:
            down: Direction of gravity in the body.
        """
        x, y, z = down
        if abs(x) > max(abs(y), TIPPED):
            return self._nose if x > 0.0 else self._tail
        if abs(y) <= LEANING or z >= OVERTURNED:
            return self.stand
        on_side, leaning = self._left if y > 0.0 else self._right
        return on_side if abs(y) > ON_SIDE else leaning

    def _placed(self, robot: Quadruped, legs: Legs) -> Targets:
        return robot.clamp(robot.with_legs(legs, self.stand))

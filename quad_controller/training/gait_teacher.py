# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The teacher: the geometric gait as a function of phase, velocity and tilt, without a past."""

from __future__ import annotations

import math

from quad_controller import BodyPose, Gait, GaitParameters, Velocity
from quad_controller.gait.body import feet_in_body
from quad_controller.gait.stepping import arc, hermite, SwingLift
from quad_description import Quadruped, Targets
from quad_description.rotations import Vector


class GaitTeacher:
    """Answers the joint targets of a trot that has been going on at a velocity for long."""

    def __init__(self, robot: Quadruped, parameters: GaitParameters) -> None:
        """Use the trot of some parameters."""
        self._robot, self._parameters = robot, parameters
        self.schedule = parameters.schedule(Gait.TROT)
        self._neutral = parameters.stance(robot, [0.0] * len(robot.names))
        self._lift = SwingLift(robot, self._neutral, self.schedule, parameters.swing_height)

    @property
    def stand(self) -> Targets:
        """Joint targets of a robot that stands [rad]."""
        return self.targets(Velocity(), 0.0, (0.0, 0.0))

    def targets(self, velocity: Velocity, phase: float, tilt: tuple[float, float]) -> Targets:
        """Return the joint targets in [rad].

        Args:
            phase: Share of the period that has passed.
            tilt: Measured roll and pitch in [rad].
        """
        feet = [
            self._foot(place, offset, velocity, phase)
            for place, offset in zip(self._neutral, self.schedule.offsets, strict=True)
        ]
        gain = self._parameters.level_gain
        pose = BodyPose(roll=_bounded(-gain * tilt[0]), pitch=_bounded(-gain * tilt[1]))
        moved = feet_in_body(feet, pose, self._robot.hip_centre)
        return self._robot.place(self._robot.solve(moved), [0.0] * len(self._robot.names))

    def _foot(self, place: Vector, offset: float, velocity: Velocity, phase: float) -> Vector:
        schedule = self.schedule
        over_x = velocity.x - velocity.yaw * place[1]
        over_y = velocity.y + velocity.yaw * place[0]
        part = math.fmod(phase + offset, 1.0)
        if part < schedule.duty:
            time = schedule.stance_duration * (0.5 - part / schedule.duty)
            return place[0] + over_x * time, place[1] + over_y * time, place[2]
        part = (part - schedule.duty) / (1.0 - schedule.duty)
        half, duration = 0.5 * schedule.stance_duration, schedule.swing_duration
        x, y = (
            hermite((-half * over, -duration * over), (half * over, -duration * over), part)
            for over in (over_x, over_y)
        )
        scale = min(1.0, math.hypot(over_x, over_y) / 0.03)
        lift = self._lift.height(over_x, over_y) * scale * arc(part)
        return place[0] + x, place[1] + y, place[2] + lift


def _bounded(angle: float) -> float:
    return min(max(angle, -0.2), 0.2)

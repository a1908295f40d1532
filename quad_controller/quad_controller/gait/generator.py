# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The gait generator: body velocity and pose in, joint targets out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from quad_description import Quadruped, Targets
from quad_description.rotations import Vector

from .parameters import Gait, GaitParameters, LOOK, Schedule, ServoCompensation
from .stepping import Stepper, SwingLift
from .velocity import BodyPose, feet_in_body, Leveller, REST, UPRIGHT, Velocity

MAX_ERROR = 0.3  # [rad] a robot that was turned by hand does not turn back further
MAX_CORRECTION = 0.4  # [rad/s]


class HeadingHold:
    """Corrects the turning rate so that the robot holds its commanded heading.

    A gait drifts and turns a few per cent too fast. A proportional controller corrects the
    turning rate by the difference between the commanded heading and the measured one.
    """

    def __init__(self, gain: float) -> None:
        """Start without a heading; the gain is in [1/s], 0 disables the correction."""
        self._gain = gain
        self._course: float | None = None

    def step(self, velocity: Velocity, heading: float | None, dt: float) -> Velocity:
        """Correct a velocity by the measured yaw [rad]; at rest, discard the heading."""
        if heading is None or velocity.at_rest or self._gain == 0.0:
            self._course = None
            return velocity
        course = heading if self._course is None else self._course + velocity.yaw * dt
        error = math.remainder(course - heading, math.tau)
        error = min(max(error, -MAX_ERROR), MAX_ERROR)
        self._course = heading + error
        correction = min(max(self._gain * error, -MAX_CORRECTION), MAX_CORRECTION)
        return Velocity(velocity.x, velocity.y, velocity.yaw + correction)


CLAMP_LINEAR = 0.005  # [m/s] that may be lacking before it is reported; rounding is no clamp
CLAMP_YAW = 0.02  # [rad/s]


@dataclass(frozen=True, slots=True)
class GaitStep:
    """Result of one gait step."""

    targets: Targets  # positions of all joints in [rad]
    contacts: tuple[bool, ...]  # which legs stand, in the order of :data:`quad_description.LEGS`
    reachable: bool  # whether the feet are where they should be; else limits cut them off


class GaitGenerator:
    """Generates targets for all joints, step by step, from velocity and body pose."""

    def __init__(
        self, robot: Quadruped, parameters: GaitParameters, others: Sequence[float] | None = None
    ) -> None:
        """Start standing.

        Raises:
            DescriptionError: The legs do not reach the nominal height.
            ParameterError: The legs do not reach the outward or forward offset, or the compensated
                servos are too soft to carry the robot.
        """
        self._robot = robot
        self._parameters = parameters
        # of all joints [rad]; those that are no legs' are sent as they are
        self.others: Targets = tuple(others or [0.0] * len(robot.names))
        self.limits = parameters.velocity_limits  # how fast the robot may go
        self._centre = robot.hip_centre
        self._neutral = parameters.stance(robot, self.others)
        self.gait = self.wanted_gait = Gait.TROT  # the one that was chosen begins at rest
        self._lifts = {
            gait: SwingLift(robot, self._neutral, self._scheduled(gait), parameters.swing_height)
            for gait in Gait
        }
        self._stepper = Stepper(
            self._scheduled(self.gait),
            self._neutral,
            self._lifts[self.gait].height,
            parameters.stance_depth,
        )
        self._leveller = Leveller(parameters.level_gain)
        self._heading = HeadingHold(parameters.heading_gain)
        self._compensation = (
            ServoCompensation(robot, parameters.servo) if parameters.servo is not None else None
        )
        _ = self.stand_targets  # refuses servos that cannot carry it
        self._unsettled = 0  # steps in which the compensation still sees the end of the gait
        self.velocity = self.goal = REST  # walked at the moment, and approached
        self.clamped = False  # whether that is less than was requested
        self.pose = UPRIGHT  # of the body over its feet at the moment

    @property
    def standing(self) -> bool:
        """Whether the robot is at rest with all feet at their neutral positions."""
        return not self._stepper.walking and self.velocity.at_rest and not self._unsettled

    @property
    def stand_targets(self) -> Targets:
        """Set-points of all joints when the robot stands [rad]."""
        targets = self._robot.place(self._robot.solve(self._neutral), self.others)
        return targets if self._compensation is None else self._compensation.at_rest(targets)

    def choose(self, gait: Gait) -> None:
        """Select a gait; a walking robot stops before the change."""
        self.wanted_gait = gait

    def reset(self) -> None:
        """Reset to standing at once, after something else has moved the joints."""
        self._stepper.reset()
        self.velocity, self.pose, self._unsettled = REST, UPRIGHT, 0
        if self._compensation is not None:
            self._compensation.reset()

    def step(
        self,
        velocity: Velocity,
        pose: BodyPose,
        attitude: Vector | None,
        dt: float,
    ) -> GaitStep:
        """Advance by one step and return the joint targets.

        Args:
            velocity: Requested velocity; clamped and rate-limited.
            pose: Requested pose of the body; clamped and rate-limited.
            attitude: Measured roll, pitch and yaw in [rad], None when unknown.
        """
        self._advance_velocity(velocity, dt)
        limits = self._parameters.body
        self.pose = limits.approach(self.pose, limits.clamp(pose), dt)
        # the body may look elsewhere than its feet go
        heading = attitude[2] - self.pose.yaw if attitude is not None else None
        course = self._heading.step(self.velocity, heading, dt)
        # back to the course no faster than the gait and its limits allow, slower ahead if need be
        walked = self._stepper.walking
        feet = self._stepper.step(self._within_schedule(self.limits.bound(course)), dt)
        moved = self._leveller.step(attitude, self.pose, dt)
        moved = moved._replace(y=moved.y + self._stepper.sway)
        solutions = self._robot.solve(feet_in_body(feet, moved, self._centre))
        targets = self._robot.place(solutions, self.others)
        contacts = self._stepper.contacts
        if self._compensation is not None:
            targets = self._compensation.step(targets, contacts, dt)
            # the body sways until the gait ends, also after the last foot has come down
            self._unsettled = LOOK if walked else max(self._unsettled - 1, 0)
        return GaitStep(targets, contacts, all(solution.reachable for solution in solutions))

    def _advance_velocity(self, velocity: Velocity, dt: float) -> None:
        if self.wanted_gait is not self.gait:
            if self.standing:
                self.gait = self.wanted_gait
                self._stepper.schedule = self._scheduled(self.gait)
                self._stepper.lift = self._lifts[self.gait].height
            velocity = REST
        self.goal = goal = self._within_schedule(self.limits.clamp(velocity))
        lost = math.hypot(velocity.x - goal.x, velocity.y - goal.y)
        self.clamped = lost > CLAMP_LINEAR or abs(velocity.yaw - goal.yaw) > CLAMP_YAW
        self.velocity = self.limits.approach(self.velocity, goal, dt)

    def _within_schedule(self, velocity: Velocity) -> Velocity:
        """Scale the velocity down until no foot exceeds the schedule's speed."""
        fastest = max(
            math.hypot(velocity.x - velocity.yaw * place[1], velocity.y + velocity.yaw * place[0])
            for place in self._neutral
        )
        most = self._stepper.schedule.speed
        return velocity.scaled(most / fastest) if fastest > most else velocity

    def _scheduled(self, gait: Gait) -> Schedule:
        return self._parameters.schedule(gait, self._robot.leg_length)

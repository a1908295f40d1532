# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be tuned of the gait, in CHAMP's words where CHAMP has one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
import math

from quad_description import Feet, Quadruped

from ..exceptions import ParameterError
from ..settings import check_settings, setting
from .body import BodyLimits
from .schedule import Gait, LEG_LENGTH, Schedule, SCHEDULES
from .servo_compensation import ServoModel
from .velocity import VelocityLimits


@dataclass(frozen=True, slots=True)
class GaitParameters:
    """Tuning of the gait; the defaults are those that walk with the XGO's dimensions."""

    # the servos are at their speed there
    max_linear_velocity_x: float = setting(0.3, 0.01, 2.0, 'forward and backward [m/s]')
    max_linear_velocity_y: float = setting(0.15, 0.01, 2.0, 'to a side [m/s]')
    max_angular_velocity_z: float = setting(1.5, 0.05, 6.0, 'turning [rad/s]')
    linear_acceleration: float = setting(1.0, 0.05, 20.0, 'change of the linear velocity [m/s2]')
    angular_acceleration: float = setting(4.0, 0.1, 100.0, 'change of the turning [rad/s2]')
    nominal_height: float = setting(0.085, 0.02, 1.0, "hip axes above the feet's centres [m]")
    # pushes tip a wide stance less often, and it goes less exactly as commanded
    stance_widening: float = setting(0.0, 0.0, 0.5, 'feet outwards from below the hips [m]')
    com_x_translation: float = setting(
        0.0, -0.2, 0.2, "feet ahead of the URDF's centre of mass [m]"
    )
    swing_height: float = setting(0.02, 0.0, 0.2, 'lift of a foot [m]')
    stance_depth: float = setting(0.0, 0.0, 0.05, 'how far a standing foot is pushed down [m]')
    stance_duration: float = setting(
        0.0, 0.0, 5.0, 'how long a foot stands [s]; 0: that of the gait'
    )
    duty: float = setting(
        0.0, 0.0, 0.95, 'share of a cycle that a foot stands; 0: that of the gait'
    )
    sway: float = setting(
        -1.0, -1.0, 0.1, 'body away from the lifted legs [m]; negative: that of the gait'
    )
    foot_speed: float = setting(
        0.0, 0.0, 5.0, 'fastest foot over the body [m/s]; 0: that of the gait'
    )
    level_gain: float = setting(0.5, 0.0, 1.0, 'turns the body against its measured tilt; 0: off')
    heading_gain: float = setting(
        2.0, 0.0, 10.0, 'corrects the turning by the measured heading [1/s]; 0: off'
    )
    # what to compensate for; None for servos that are firm
    servo: ServoModel | None = field(default_factory=ServoModel)
    # how far the body may be moved over the feet
    body: BodyLimits = field(default_factory=BodyLimits)

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            ParameterError: A value is outside of its range; the message has name and range.
        """
        check_settings(self)
        if self.duty and not self.duty >= MIN_DUTY:
            raise ParameterError(f'duty {self.duty} is below {MIN_DUTY}; 0 takes that of the gait')
        if self.servo is not None and not (0.0 < self.servo.kp < math.inf):
            raise ParameterError(
                f'servo_compensation.kp {self.servo.kp} is not a stiffness above 0'
            )

    @property
    def velocity_limits(self) -> VelocityLimits:
        """How fast the robot may go."""
        return VelocityLimits(
            self.max_linear_velocity_x,
            self.max_linear_velocity_y,
            self.max_angular_velocity_z,
            self.linear_acceleration,
            self.angular_acceleration,
        )

    def top_speed(self, gait: Gait) -> float:
        """Return how fast a gait goes straight ahead at most [m/s]."""
        return min(self.max_linear_velocity_x, self.schedule(gait).speed)

    def stance(self, robot: Quadruped, others: Sequence[float]) -> Feet:
        """Return where the feet of a robot at rest are, in base_link in [m].

        Args:
            others: Positions of all joints, for those that are no legs' in [rad].

        Raises:
            DescriptionError: The legs do not reach the nominal height.
            ParameterError: They do not reach as far outwards or ahead.
        """
        shift, widening = self.com_x_translation, self.stance_widening
        one, two, three, four = (
            (x + shift, y + math.copysign(widening, y), z)
            for x, y, z in robot.footprint(self.nominal_height, others)
        )
        feet = one, two, three, four
        if not all(solution.reachable for solution in robot.solve(feet)):
            raise ParameterError(
                f'stance_widening {widening}, com_x_translation {shift}: the legs do not reach so '
                f'far at nominal_height {self.nominal_height}; reduce one of them'
            )
        return feet

    def schedule(self, gait: Gait, leg_length: float = LEG_LENGTH) -> Schedule:
        """Return a gait for legs of a length [m], with what was tuned of it."""
        schedule = SCHEDULES[gait].scaled(leg_length)
        return replace(
            schedule,
            stance_duration=self.stance_duration or schedule.stance_duration,
            duty=self.duty or schedule.duty,
            sway=schedule.sway if self.sway < 0.0 else self.sway,
            speed=self.foot_speed or schedule.speed,
        )


MIN_DUTY = 0.5  # below it there are moments without a foot on the ground

AS_TUNED = GaitParameters()
"""The gait as it is when nothing is set."""

LOW_AND_WIDE = GaitParameters(nominal_height=0.07, stance_widening=0.025)
"""A stance of the XGO that pushes hardly tip, and that is slower."""

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Gait parameters, named as in CHAMP where it has an equivalent, and the gait schedules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
import math

from quad_description import Feet, jacobian, Quadruped, Targets
from robot_primitives import setting

from ..exceptions import check_settings, ParameterError
from .velocity import BodyLimits, VelocityLimits


class Gait(Enum):
    """The gaits; each value is the name that ``set_mode`` accepts."""

    TROT = 'trot'
    CRAWL = 'crawl'
    PACE = 'pace'


LEG_LENGTH = 0.1349  # [m] thigh and calf of the XGO


@dataclass(frozen=True, slots=True)
class Schedule:
    """Timing of a gait; phases are fractions of its period.

    A leg is in stance while its phase (gait phase plus offset) is below the duty factor.
    """

    # lead of each leg's phase, front left, front right, back left, back right
    offsets: tuple[float, float, float, float]
    stance_duration: float  # how long a foot stays on the ground in [s]
    duty: float  # share of the period that a foot stands
    sway: float  # how far the body moves to the side away from the legs in the air in [m]
    # largest speed of a foot over the body that the gait keeps its balance at in [m/s]
    speed: float

    def scaled(self, leg_length: float) -> Schedule:
        """Return the schedule scaled to another leg length [m].

        At equal Froude number (v^2 / g l), times and speeds grow with the root of the leg length.
        """
        size = leg_length / LEG_LENGTH
        if abs(size - 1.0) < 0.01:
            return self
        root = math.sqrt(size)
        return replace(
            self,
            stance_duration=self.stance_duration * root,
            sway=self.sway * size,
            speed=self.speed * root,
        )

    @property
    def period(self) -> float:
        """Duration of a cycle in [s]."""
        return self.stance_duration / self.duty

    @property
    def swing_duration(self) -> float:
        """Duration of a swing in [s]."""
        return self.period - self.stance_duration

    @property
    def sway_phase(self) -> float:
        """Phase at the middle of the left legs' swings, when the body sways furthest right.

        It is the phase of the first harmonic of "left legs in the air minus right legs".
        """
        sides = (1.0, -1.0, 1.0, -1.0)
        centre = (1.0 + self.duty) / 2  # of the swing, in the leg's own phase
        angles = [math.tau * (centre - offset) for offset in self.offsets]
        sine = sum(side * math.sin(angle) for side, angle in zip(sides, angles, strict=True))
        cosine = sum(side * math.cos(angle) for side, angle in zip(sides, angles, strict=True))
        return math.atan2(sine, cosine) / math.tau


SCHEDULES = {
    Gait.TROT: Schedule((0.0, 0.5, 0.5, 0.0), 0.1456, 0.52, 0.0, 0.45),
    Gait.CRAWL: Schedule((0.0, 0.5, 0.75, 0.25), 0.8, 0.8, 0.012, 0.06),
    Gait.PACE: Schedule((0.0, 0.5, 0.0, 0.5), 0.12, 0.6, 0.0, 0.13),
}
"""The gaits as they were found to walk in physics simulation with the XGO's dimensions."""

GRAVITY = 9.81  # [m/s^2]
LOOK = 2  # steps of the motion, after the newest one, that it looks at
MAX_SAG = 1.0  # [rad] beyond which a servo carries nothing
STEP_LOAD = 1.25  # of its share of the weight: what each of two legs carries; found in physics


@dataclass(frozen=True, slots=True)
class ServoModel:
    """A servo modelled as spring and damper.

    The vendor published the stiffness. Damping and inertia are tuned so that the gait keeps its
    speed in simulation at every stiffness from 1.1 to 10 N m/rad.
    """

    kp: float = setting(2.45, 0.01, 1000.0, 'stiffness of a servo [N m/rad]')
    damping: float = setting(0.058, 0.0, 10.0, 'what holds a servo back by its speed [N m s/rad]')
    inertia: float = setting(0.0, 0.0, 1.0, 'what a joint turns [kg m2]')
    mass: float = setting(0.0, 0.0, 100.0, 'what the legs carry [kg]; 0: as in the URDF')


class ServoCompensation:
    """Adjusts joint set-points so that soft servos reach the intended positions.

    A position servo is a spring: it lags behind a moving set-point and sags under the robot's
    weight. The set-point is moved ahead by what the spring needs, from the motion of the next step
    and, for the legs that stand, from their share of the weight::

        command = q + (damping / kp) q' + (inertia / kp) q'' - J^T f / kp,  f = m g / standing legs

    It adds one step of delay, because it looks one step ahead.
    """

    def __init__(self, robot: Quadruped, servo: ServoModel) -> None:
        """Start without motion history."""
        self._robot = robot
        self._servo = servo
        self._weight = GRAVITY * (servo.mass or robot.mass)
        self._window: list[tuple[Targets, tuple[bool, ...]]] = []

    def reset(self) -> None:
        """Clear the motion history."""
        self._window.clear()

    def at_rest(self, targets: Targets) -> Targets:
        """Return the set-points that hold some targets [rad] while all legs stand.

        Raises:
            ParameterError: The servos are too soft to carry the robot.
        """
        moved = list(targets)
        self._carry(moved, targets, (True,) * len(self._robot.legs))
        sag = max(abs(a - b) for a, b in zip(moved, targets, strict=True))
        if sag > MAX_SAG:
            raise ParameterError(
                f'servos of {self._servo.kp:g} N m/rad sag by {sag:.1f} rad below '
                f'{self._weight / GRAVITY:.1f} kg; set servo_compensation.kp to the stiffness of '
                'those of this robot [N m/rad], or servo_compensation.enabled to false'
            )
        return self._robot.clamp(moved)

    def step(self, targets: Targets, contacts: tuple[bool, ...], dt: float) -> Targets:
        """Return the set-points for the targets of the previous step [rad]."""
        window = self._window
        window.append((targets, contacts))
        while len(window) <= LOOK:
            window.append((targets, contacts))
        if len(window) > LOOK + 1:
            del window[0]
        before, (now, stand), after = window[0][0], window[1], window[2][0]
        step = max(dt, 1e-3)
        lead, inertia = self._servo.damping / self._servo.kp, self._servo.inertia / self._servo.kp
        moved = [
            q + lead * (b - a) / (2 * step) + inertia * (b - 2 * q + a) / (step * step)
            for a, q, b in zip(before, now, after, strict=True)
        ]
        self._carry(moved, now, stand)
        return self._robot.clamp(moved)

    def _carry(self, moved: list[float], now: Targets, stand: Sequence[bool]) -> None:
        share = self._weight / max(sum(stand), 1) / self._servo.kp
        if sum(stand) <= len(stand) // 2:
            share *= STEP_LOAD
        legs = zip(self._robot.legs, self._robot.leg_indices, stand, strict=True)
        for leg, indices, stands in legs:
            if stands:
                hip, thigh, calf = indices
                columns = jacobian(leg, (now[hip], now[thigh], now[calf]))
                for index, column in zip(indices, columns, strict=True):
                    moved[index] -= column[2] * share


MIN_DUTY = 0.5  # below it there are moments without a foot on the ground


@dataclass(frozen=True, slots=True)
class GaitParameters:
    """Gait parameters; the defaults suit the dimensions of the XGO."""

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
        """Reject values outside of their ranges.

        Raises:
            ParameterError: A value is out of range; the message gives name and range.
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
        """Velocity limits of the robot."""
        return VelocityLimits(
            self.max_linear_velocity_x,
            self.max_linear_velocity_y,
            self.max_angular_velocity_z,
            self.linear_acceleration,
            self.angular_acceleration,
        )

    def top_speed(self, gait: Gait) -> float:
        """Return the highest forward speed of a gait [m/s]."""
        return min(self.max_linear_velocity_x, self.schedule(gait).speed)

    def stance(self, robot: Quadruped, others: Sequence[float]) -> Feet:
        """Return the foot positions of the robot at rest, in base_link in [m].

        Args:
            others: Positions of all joints in [rad], used for the non-leg joints.

        Raises:
            DescriptionError: The legs do not reach the nominal height.
            ParameterError: The legs do not reach the outward or forward offset.
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
        """Return the schedule of a gait for a leg length [m], with the tuned values applied."""
        schedule = SCHEDULES[gait].scaled(leg_length)
        return replace(
            schedule,
            stance_duration=self.stance_duration or schedule.stance_duration,
            duty=self.duty or schedule.duty,
            sway=schedule.sway if self.sway < 0.0 else self.sway,
            speed=self.foot_speed or schedule.speed,
        )


AS_TUNED = GaitParameters()
"""The gait as it is when nothing is set."""

LOW_AND_WIDE = GaitParameters(nominal_height=0.07, stance_widening=0.025)
"""A stance of the XGO that pushes hardly tip, and that is slower."""

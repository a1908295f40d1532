# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts a robot's reports in wire units to its state in SI units.

The IMU mounting maps IMU values to base_link. Quantities that the robot does not report are
estimated: rates, odometry, foot contacts, height.

The heading comes from the attitude, the position from the stance legs. There are no contact
switches. A foot's stance weight grows as it nears the ground and as the body's motion over it
agrees with the overall motion: a swing foot moves the other way. The ground is the plane through
the lowest recent foot positions, and may slope. The feet are balls that roll on the ground while
the leg turns over them, so their centres advance by more than a tenth of the distance (radius over
height of the hip).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
import math
from operator import itemgetter

from quad_description import (
    DescriptionError,
    FootPose,
    ImuSample,
    JointSample,
    MAX_TILT,
    OdometryState,
    Pose,
    pose_positions,
    quadruped,
    raised_feet,
    RobotState,
)
from quad_description.rotations import (
    about_z,
    conjugate,
    from_rpy,
    IDENTITY,
    multiply,
    Quaternion,
    rotate,
    tilt_of,
    Vector,
    yaw_of,
)
from robot_primitives import setting, switch

from .exceptions import CommandError
from .filters import AttitudeRate, FULL, GravityCheck, JointRate, low_pass_share, MedianFilter
from .joints import JointMap
from .report import BoardWatch, Plausibility, Report, SampleClock, ServoWatch

UNCHECKED_DEVIATION = math.pi / 2  # [rad] of an attitude whose signs were not checked
POSITIVE: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class ImuMounting:
    """Mounting of the IMU on the body: maps IMU values to base_link, signs included.

    With a wrong sign, a controller that levels the body tilts it further and further. In the
    vendor's own simulation the IMU is turned by 180 degrees about the vertical.
    """

    rotation: Quaternion = IDENTITY  # of the IMU's axes in base_link, (x, y, z, w)
    # of roll, pitch and yaw as they are reported, against REP 103
    attitude_signs: Vector = POSITIVE
    # of the specific force along x, y and z; +9.8 upwards at rest
    acceleration_signs: Vector = POSITIVE
    rate_signs: Vector = POSITIVE  # of the angular velocity about x, y and z
    checked: bool = False  # it was compared with gravity on this robot
    # the signs of the gyro were compared with turning it by hand
    rates_checked: bool = False

    def attitude(self, reported: Vector) -> Quaternion:
        """Return the attitude of base_link for reported roll, pitch and yaw [deg]."""
        roll, pitch, yaw = map(math.radians, _signed(self.attitude_signs, reported))
        return multiply(from_rpy(roll, pitch, yaw), conjugate(self.rotation))

    def acceleration(self, reported: Vector) -> Vector:
        """Rotate a specific force into base_link [m/s²]."""
        return rotate(self.rotation, _signed(self.acceleration_signs, reported))

    def rate(self, reported: Vector) -> Vector:
        """Convert a reported angular velocity [deg/s] to base_link [rad/s]."""
        x, y, z = map(math.radians, _signed(self.rate_signs, reported))
        return rotate(self.rotation, (x, y, z))


def _signed(signs: Vector, values: Vector) -> Vector:
    x, y, z = (sign * value for sign, value in zip(signs, values, strict=True))
    return x, y, z


MAX_GAP = 0.2  # [s] more than that cannot be bridged: the body may have been carried
GROUND_TIME = 1.0  # [s] in which every foot stands, whatever the gait
CREEP = 0.04  # [m/s] of a body whose feet hardly leave the ground; noise is slower
SLIP = 0.07  # [m/s] a foot over which the body goes so much otherwise counts a quarter
MIN_DEVIATION = 0.01  # [m] of the position, however short the way was
DRIFT = 0.07  # share of the way that is the standard deviation of the position
GAP_SPEED = 0.3  # [m/s] at which a robot that is not seen may have gone on
FALL_DEVIATION = 0.1  # [m] by which a body that falls or rolls may have gone
YAW_DRIFT = 1.5e-4  # [rad/s] half a degree a minute; ours: no page says how the IMU drifts
REST = (0.0, 0.0)
_Z = itemgetter(2)


SCALES = (0.1, 10.0)
"""What a scale of odometry may be; beyond, a way was given in another unit."""


@dataclass(frozen=True, slots=True)
class OdometrySettings:
    """Parameters of the leg odometry."""

    tolerance: float = setting(0.002, 0.0005, 0.05, 'height of a foot down [m]')
    cutoff: float = 5.0  # of the low-pass of the velocity that is published [Hz]
    scale_x: float = setting(1.0, *SCALES, 'factor of the way forward')
    scale_y: float = setting(1.0, *SCALES, 'factor of the way sideways')


class LegOdometry:
    """Integrates the motion of the body over its stance legs."""

    def __init__(
        self, settings: OdometrySettings, foot_radius: float, lying_height: float = 0.0
    ) -> None:
        """Start at the origin.

        Args:
            lying_height: Height of base_link above the feet [m] up to which the belly carries it.
        """
        self._settings, self._lying_height = settings, lying_height
        self._radius = foot_radius
        # where the feet were lately [s], [m], in the body turned level
        self._lately: deque[tuple[float, list[Vector]]] = deque()
        # when, where and how surely the feet stood
        self._last: tuple[float, Sequence[FootPose], Sequence[float]] | None = None
        self._yaw0: float | None = None
        self._heading = 0.0  # [rad] of the last update
        self._keeps_heading = False
        self._place = self._held = self._smooth = REST  # the velocities in the body turned level
        self._distance = self._gaps = 0.0  # way [m], variance by gaps [m²]
        self._began_at: float | None = None
        self._fallen = False
        self._stepped_at = -math.inf  # when a foot was last in the air [s]

    def keep_heading(self) -> None:
        """Keep the present heading across the next attitude, whose yaw has a new zero."""
        self._keeps_heading = True

    def update(self, time: float, feet: Sequence[FootPose], attitude: Quaternion) -> OdometryState:
        """Add a measurement and update the pose.

        Args:
            time: Time of the measurement [s].
        """
        yaw = yaw_of(attitude)
        if self._yaw0 is None or self._keeps_heading:
            self._yaw0 = yaw - self._heading
            self._keeps_heading = False
        self._heading = yaw - self._yaw0
        rotation = multiply(about_z(-self._yaw0), attitude)
        turned = [
            FootPose(rotate(rotation, foot.position), multiply(rotation, foot.rotation))
            for foot in feet
        ]
        heights = self._above_ground(time, [foot.position for foot in turned])
        tolerance = self._settings.tolerance
        standing = tuple(height <= tolerance for height in heights)
        weights = [math.exp(-0.5 * (height / tolerance) ** 2) for height in heights]
        if self._began_at is None:
            self._began_at = time
        if not all(standing):
            self._stepped_at = time
        height = self._height(turned, standing)
        fallen = tilt_of(rotation) > MAX_TILT
        if fallen and not self._fallen:
            self._gaps += FALL_DEVIATION**2
        self._fallen = fallen
        elapsed = 0.0 if self._last is None else time - self._last[0]
        if elapsed > MAX_GAP:  # lying or not, it may have been carried, or have gone on
            self._gaps += (GAP_SPEED * elapsed) ** 2
        if fallen or height <= self._lying_height or not 0.0 < elapsed <= MAX_GAP:
            self._held = self._smooth = REST  # the feet may move, and carry nothing
        else:
            self._integrate(time, elapsed, turned, weights)
        self._last = time, turned, weights
        return OdometryState(
            *self._place,
            height,
            rotation,
            *self._smooth,
            self._distance,
            standing,
            MIN_DEVIATION**2 + (DRIFT * self._distance) ** 2 + self._gaps,
            (YAW_DRIFT * (time - self._began_at)) ** 2,
        )

    def _above_ground(self, time: float, places: list[Vector]) -> list[float]:
        """Return the heights of the feet above the lowest one, on ground that may slope [m]."""
        lately = self._lately
        lately.append((time, places))
        while time - lately[0][0] > GROUND_TIME:
            lately.popleft()
        normal = ground_normal([each for _, each in lately], self._settings.tolerance)
        x, y, z = normal or (0.0, 0.0, 1.0)
        heights = [x * px + y * py + z * pz for px, py, pz in places]
        lowest = min(heights)
        return [height - lowest for height in heights]

    def _integrate(
        self, time: float, elapsed: float, feet: Sequence[FootPose], weights: Sequence[float]
    ) -> None:
        if self._last is None:
            return
        _, last_feet, weighed = self._last
        cosine, sine = math.cos(self._heading), math.sin(self._heading)
        settings, (smooth_x, smooth_y) = self._settings, self._smooth
        # a body over feet that stay comes back: it goes nowhere, and noise is no way
        rests = time - self._stepped_at > GROUND_TIME and math.hypot(*self._smooth) <= CREEP
        total = sum_x = sum_y = 0.0
        for last, foot, *pair in zip(last_feet, feet, weighed, weights, strict=True):
            x, y = self._way(last, foot)
            ahead = settings.scale_x * (cosine * x + sine * y) / elapsed
            left = settings.scale_y * (cosine * y - sine * x) / elapsed
            slip = ((ahead - smooth_x) ** 2 + (left - smooth_y) ** 2) / SLIP**2
            weight = 1.0 if rests else min(pair) / (1.0 + slip) ** 2
            total, sum_x, sum_y = total + weight, sum_x + weight * ahead, sum_y + weight * left
        if total > 0.0:
            self._held = sum_x / total, sum_y / total
        ahead, left = self._held[0] * elapsed, self._held[1] * elapsed
        self._place = (
            self._place[0] + cosine * ahead - sine * left,
            self._place[1] + sine * ahead + cosine * left,
        )
        share = low_pass_share(settings.cutoff, elapsed)
        held_x, held_y = self._held
        self._smooth = (
            smooth_x + share * (held_x - smooth_x),
            smooth_y + share * (held_y - smooth_y),
        )
        if not rests:
            self._distance += math.hypot(ahead, left)

    def _way(self, before: FootPose, after: FootPose) -> tuple[float, float]:
        """Return the displacement of the body over a stance foot [m]."""
        x, y, _, w = multiply(after.rotation, conjugate(before.rotation))
        # the foot has rolled by the angular step times the vector from the ground to its centre
        rolled = 2.0 * w * self._radius
        return (
            rolled * y - after.position[0] + before.position[0],
            -rolled * x - after.position[1] + before.position[1],
        )

    def _height(self, feet: Sequence[FootPose], standing: Sequence[bool]) -> float:
        heights = [foot.position[2] for foot, stands in zip(feet, standing, strict=True) if stands]
        heights = heights or [foot.position[2] for foot in feet]
        return self._radius - sum(heights) / len(heights)


def ground_normal(lately: Sequence[Sequence[Vector]], tolerance: float) -> Vector | None:
    """Return the unit normal of the ground, from recent foot positions.

    None if the lowest positions are not coplanar: a foot was always in the air.

    Args:
        lately: Recent foot positions, in the order of the legs [m]; at least one set.
        tolerance: Largest deviation from a plane [m].
    """
    fl, fr, bl, br = (min(places, key=_Z) for places in zip(*lately, strict=True))
    # across both diagonals
    ax, ay, az = fl[0] - br[0], fl[1] - br[1], fl[2] - br[2]
    bx, by, bz = fr[0] - bl[0], fr[1] - bl[1], fr[2] - bl[2]
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = math.copysign(math.sqrt(x * x + y * y + z * z), z)
    if length == 0.0:
        return None
    x, y, z = x / length, y / length, z / length
    between = x * (fl[0] - fr[0]) + y * (fl[1] - fr[1]) + z * (fl[2] - fr[2])
    return (x, y, z) if abs(between) <= tolerance else None


LYING_MARGIN = 0.002  # [m] above the height of a robot that lies


class RateSource(Enum):
    """Source of the angular velocity."""

    AUTO = 'auto'  # the gyro where it is reported
    DIFFERENTIATED = 'differentiated'  # always from the attitude
    NONE = 'none'  # not published


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """Parameters of the estimator."""

    angular_velocity_source: RateSource = switch(  # noqa: RUF009  # a field
        RateSource.AUTO, 'auto: the gyro where it is reported, else differentiated attitude'
    )
    rate_cutoff: float = setting(12.0, 0.5, 25.0, 'of its low-pass [Hz]')
    joint_velocity_cutoff: float = setting(25.0, 0.5, 25.0, 'of differentiated velocities [Hz]')
    odometry: OdometrySettings = field(default_factory=OdometrySettings)  # how the legs are read
    mounting: ImuMounting = field(default_factory=ImuMounting)  # how the IMU sits on the body


class Estimator:
    """Converts reports to robot states."""

    def __init__(self, urdf: str, joints: JointMap, settings: EstimatorSettings) -> None:
        """Start without a report.

        Raises:
            CommandError: The legs of the URDF cannot be read.
        """
        self.refusal = ''  # why the last report that was refused could not be
        self._joints = joints
        self._sent: dict[str, float] = {}  # targets that were sent last
        self._settings = settings
        try:
            self._robot = quadruped(urdf)
        except DescriptionError as error:
            raise CommandError(f'robot_description: {error}') from error
        self._clock = SampleClock()
        self._boards = BoardWatch()
        motors = [servo.motor for servo in joints.servos]
        self._plausibility, self._servos = Plausibility(motors), ServoWatch(motors)
        self._rate = AttitudeRate(settings.rate_cutoff)
        self._joint_rate = JointRate(settings.joint_velocity_cutoff)
        self._charge, self._voltage = MedianFilter(), MedianFilter()
        self._gravity = GravityCheck()
        pose, radius = pose_positions(Pose.LIE), self._robot.foot_radius
        legs = [pose.get(name) for name in joints.names[: joints.leg_count]]
        # of another robot's belly nothing is known
        folded = None if None in legs else self._robot.feet([q or 0.0 for q in legs])
        lying = 0.0 if folded is None else LYING_MARGIN + radius - min(z for *_, z in folded)
        self._odometry = LegOdometry(settings.odometry, radius, lying)

    def command(self, targets: Sequence[float]) -> None:
        """Record the last targets of the first joints, in order [rad], for unmeasured joints."""
        self._sent = {**self._sent, **dict(zip(self._joints.names, targets, strict=False))}

    def raised_feet(self, targets: Sequence[float]) -> tuple[str, ...]:
        """Return the feet that are in the air at given targets of the first joints [rad]."""
        return raised_feet(self._robot.feet(targets))

    def step(self, report: Report) -> RobotState | None:
        """Return the state for a report; None if the report is implausible."""
        if reason := self._plausibility.check(report):
            self.refusal = reason
            return None
        time = self._clock.time(report)
        joints = self._joint_sample(report, time - report.joints_age)
        problem = self._plausibility.imu_problem
        imu = None if problem else self._imu_sample(report, time)
        # the heading is unknown without an attitude
        odometry = None
        if imu is not None:
            feet = self._robot.foot_poses(joints.positions)
            odometry = self._odometry.update(joints.time, feet, imu.orientation)
        charge = self._charge.take(report.battery, FULL)
        return RobotState(
            joints,
            imu,
            None if charge is None else charge / 100.0,
            position=None if odometry is None else (odometry.x, odometry.y, odometry.height),
            linear_velocity=None if odometry is None else odometry.velocity_in_base,
            foot_contacts=None if odometry is None else odometry.standing,
            time=time,
            odometry=odometry,
            imu_problem=problem,
            voltage=self._voltage.take(report.voltage),
            faults=report.faults,
            servo_problem=self._servos.check(report),
            temperatures=report.temperatures or {},
        )

    @property
    def gravity_error(self) -> float | None:
        """Angle between accelerometer and attitude [rad].

        None while the body accelerates, the IMU is unusable, or without an accelerometer.
        """
        return None if self._plausibility.imu_problem else self._gravity.error

    def _joint_sample(self, report: Report, time: float) -> JointSample:
        positions = self._joints.positions(report.positions)
        velocities, error = self._joints.velocities(report.velocities), 0.0
        if not velocities:
            velocities = self._joint_rate.update(time, positions)
            error = self._joint_rate.error
        names = self._joints.names
        if len(positions) == len(velocities) == len(names):  # all of them, in their order
            values = tuple(positions.values()), tuple(velocities.values())
            return JointSample(*values, time, velocity_error=error)
        known = {**self._sent, **positions}
        return JointSample(
            tuple(known.get(name, 0.0) for name in names),
            tuple(velocities.get(name, 0.0) for name in names),
            time,
            tuple(place for place, name in enumerate(names) if name not in positions),
            error,
        )

    def _imu_sample(self, report: Report, time: float) -> ImuSample:
        if self._boards.restarted(report):
            self._odometry.keep_heading()
        mounting, felt = self._settings.mounting, report.acceleration
        orientation = mounting.attitude(report.attitude)
        acceleration = None if felt is None else mounting.acceleration(felt)
        self._gravity.take(orientation, acceleration)
        source = self._settings.angular_velocity_source
        differentiated = self._rate.update(time, orientation)
        gyro = report.rates if source is RateSource.AUTO else None
        rate = differentiated if gyro is None else mounting.rate(gyro)
        checked = mounting.checked and (mounting.rates_checked or gyro is None)
        return ImuSample(
            orientation,
            None if source is RateSource.NONE else rate,
            acceleration,
            0.0 if checked else UNCHECKED_DEVIATION,
            rate_differentiated=gyro is None,
        )

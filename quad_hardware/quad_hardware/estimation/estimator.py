# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a report of the robot, in the units of the wire, to its state in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from quad_description import (
    DescriptionError,
    ImuSample,
    JointSample,
    OdometryState,
    Pose,
    pose_positions,
    quadruped,
    raised_feet,
    RobotState,
)

from ..exceptions import CommandError
from ..joints import JointMap
from ..report import Report
from .filters import AttitudeRate, FULL, GravityCheck, JointRate, MedianFilter
from .imu_mounting import ImuMounting, UNCHECKED_DEVIATION
from .odometry import LegOdometry, OdometrySettings
from .plausibility import BoardWatch, Plausibility, SampleClock, ServoWatch

LYING_MARGIN = 0.002  # [m] above the height of a robot that lies


class RateSource(Enum):
    """Where the angular velocity is from."""

    AUTO = 'auto'  # the gyro where it is reported
    DIFFERENTIATED = 'differentiated'  # always from the attitude
    NONE = 'none'  # not published


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """How reports are read."""

    rate_source: RateSource = RateSource.AUTO  # where the angular velocity is from
    rate_cutoff: float = 12.0  # of the low-pass of differentiated angular velocities [Hz]
    joint_cutoff: float = 25.0  # of the low-pass of differentiated joint velocities [Hz]
    odometry: OdometrySettings = field(default_factory=OdometrySettings)  # how the legs are read
    mounting: ImuMounting = field(default_factory=ImuMounting)  # how the IMU sits on the body


class Estimator:
    """Turns reports into states of the robot."""

    def __init__(self, urdf: str, joints: JointMap, settings: EstimatorSettings) -> None:
        """Begin without a report.

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
        self._joint_rate = JointRate(settings.joint_cutoff)
        self._charge, self._voltage = MedianFilter(), MedianFilter()
        self._gravity = GravityCheck()
        pose, radius = pose_positions(Pose.LIE), self._robot.foot_radius
        legs = [pose.get(name) for name in joints.names[: joints.leg_count]]
        # of another robot's belly nothing is known
        folded = None if None in legs else self._robot.feet([q or 0.0 for q in legs])
        lying = 0.0 if folded is None else LYING_MARGIN + radius - min(z for *_, z in folded)
        self._odometry = LegOdometry(settings.odometry, radius, lying)

    def command(self, time: float, targets: Sequence[float]) -> None:
        """Note what was sent to the legs: it shows which feet stand and which swing.

        Args:
            time: When, on the monotonic clock [s].
            targets: Positions of the first joints, in their order [rad].
        """
        self._sent = {**self._sent, **dict(zip(self._joints.names, targets, strict=False))}
        self._odometry.command(time, self._robot.feet(targets))

    def raised_feet(self, targets: Sequence[float]) -> tuple[str, ...]:
        """Return the feet that are in the air at targets of the first joints [rad]."""
        return raised_feet(self._robot.feet(targets))

    def step(self, report: Report) -> RobotState | None:
        """Return the state that a report shows; None when the report cannot be."""
        if reason := self._plausibility.check(report):
            self.refusal = reason
            return None
        time = self._clock.time(report)
        joints = self._joint_sample(report, time - report.joints_age)
        problem = self._plausibility.imu_problem
        imu = None if problem else self._imu_sample(report, time)
        # the heading is unknown without an attitude
        odometry = None if imu is None else self._locate(joints, imu)
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

        None while the body accelerates or the IMU is of no use, and without an accelerometer.
        """
        return None if self._plausibility.imu_problem else self._gravity.error

    def _locate(self, joints: JointSample, imu: ImuSample) -> OdometryState:
        feet = self._robot.foot_poses(joints.positions)
        return self._odometry.update(joints.time, feet, imu.orientation)

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
        source, differentiated = self._settings.rate_source, self._rate.update(time, orientation)
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

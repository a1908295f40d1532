# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that is published of a report: joints, IMU, odometry, in SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum

from quad_description import DescriptionError, quadruped, raised_feet
from quad_description.rotations import Quaternion, Vector

from ..exceptions import CommandError
from ..joints import JointMap
from ..report import Report
from .battery import Battery, BatteryFilter
from .board_watch import BoardWatch
from .filters import AttitudeRate, JointRate
from .gravity import GravityCheck
from .imu_mounting import ImuMounting
from .odometry import LegOdometry, OdometrySettings, OdometryState
from .plausibility import Plausibility
from .sample_clock import SampleClock


class RateSource(Enum):
    """Where the angular velocity is from."""

    AUTO = 'auto'  # the gyro where it is reported
    DIFFERENTIATED = 'differentiated'  # always from the attitude
    NONE = 'none'  # not published


@dataclass(frozen=True, slots=True)
class EstimatorSettings:
    """How reports are read.

    Attributes:
        rate_source: Where the angular velocity is from.
        rate_cutoff: Of the low-pass of differentiated angular velocities [Hz].
        joint_cutoff: Of the low-pass of differentiated joint velocities [Hz].
        odometry: How the legs are read.
        mounting: How the IMU sits on the body.
    """

    rate_source: RateSource = RateSource.AUTO
    rate_cutoff: float = 12.0
    joint_cutoff: float = 12.0
    odometry: OdometrySettings = field(default_factory=OdometrySettings)
    mounting: ImuMounting = field(default_factory=ImuMounting)


@dataclass(frozen=True, slots=True)
class Estimate:
    """One report in SI units.

    Attributes:
        time: When it was made, on the monotonic clock [s].
        joints_time: When the joints were measured [s]; protocol v1 asks for them before.
        positions: By joint [rad], of the gripper [m]; joints that are not reported are missing.
        velocities: Of the same joints [rad/s], [m/s].
        attitude: From base_link to the world, (x, y, z, w); its yaw is the robot's. None while
            the IMU is of no use; rate and acceleration are None, too.
        angular_velocity: Of the body, in base_link [rad/s]; None when it is not wanted.
        rate_measured: The angular velocity is that of a gyro.
        signs_checked: Somebody has compared the attitude with gravity on this robot, and the gyro
            with the attitude where it is the gyro's.
        acceleration: Specific force in base_link [m/s²]; None where it is not reported.
    """

    time: float
    joints_time: float
    positions: dict[str, float]
    velocities: dict[str, float]
    attitude: Quaternion | None
    angular_velocity: Vector | None
    rate_measured: bool
    signs_checked: bool
    acceleration: Vector | None


@dataclass(frozen=True, slots=True)
class Health:
    """What is looked at now and then.

    Attributes:
        battery: State of the battery.
        gravity_error: Between accelerometer and attitude [rad]; None while the body accelerates,
            and without an accelerometer.
        refused: Reports that could not be.
        refusal: Why the last of them could not be.
        imu_problem: Why the IMU is of no use; empty while it works.
    """

    battery: Battery
    gravity_error: float | None
    refused: int
    refusal: str
    imu_problem: str = ''


class Estimator:
    """Turns reports into estimates.

    Attributes:
        refusal: Why the last report that was refused could not be.
    """

    def __init__(self, urdf: str, joints: JointMap, settings: EstimatorSettings) -> None:
        """Begin without a report.

        Raises:
            CommandError: The legs of the URDF cannot be read.
        """
        self._refused = 0
        self.refusal = ''
        self._joints = joints
        self._settings = settings
        try:
            self._robot = quadruped(urdf)
        except DescriptionError as error:
            raise CommandError(f'robot_description: {error}') from error
        self._clock = SampleClock()
        self._boards = BoardWatch()
        self._plausibility = Plausibility([servo.motor for servo in joints.servos])
        self._rate = AttitudeRate(settings.rate_cutoff)
        self._joint_rate = JointRate(settings.joint_cutoff)
        self._battery = BatteryFilter()
        self._gravity = GravityCheck()
        self._odometry = LegOdometry(settings.odometry, self._robot.foot_radius)

    def command(self, time: float, targets: Sequence[float]) -> None:
        """Note what was sent to the legs, which tells the feet that stand from those that swing.

        Args:
            time: When, on the monotonic clock [s].
            targets: Positions of the first joints, in their order [rad].
        """
        self._odometry.command(time, self._feet(targets))

    def raised_feet(self, targets: Sequence[float]) -> tuple[str, ...]:
        """Return the feet that are in the air at targets of the first joints [rad]."""
        return raised_feet(self._feet(targets))

    def update(self, state: Report) -> Estimate | None:
        """Take a report; return None when it cannot be. :meth:`update_odometry` comes next."""
        reason = self._plausibility.check(state)
        if reason:
            self._refused += 1
            self.refusal = reason
            return None
        time = self._clock.time(state)
        joints_time = time - state.joints_age
        positions = self._joints.positions(state.positions)
        velocities = self._joints.velocities(state.velocities)
        if not velocities:
            velocities = self._joint_rate.update(joints_time, positions)
        self._battery.take(state)
        if self._plausibility.imu_problem:
            return Estimate(
                time, joints_time, positions, velocities, None, None, False, False, None
            )
        if self._boards.restarted(state):
            self._odometry.keep_heading()
        mounting, felt = self._settings.mounting, state.acceleration
        attitude = mounting.attitude(state.attitude)
        acceleration = None if felt is None else mounting.acceleration(felt)
        self._gravity.take(attitude, acceleration)
        rate, measured = self._angular_velocity(time, attitude, state)
        return Estimate(
            time=time,
            joints_time=joints_time,
            positions=positions,
            velocities=velocities,
            attitude=attitude,
            angular_velocity=rate,
            rate_measured=measured,
            signs_checked=mounting.checked and (mounting.rates_checked or not measured),
            acceleration=acceleration,
        )

    def update_odometry(self, estimate: Estimate) -> OdometryState | None:
        """Return where the body is by an estimate, to be called once for each.

        None without an attitude, for nobody knows the heading then.
        """
        if estimate.attitude is None:
            return None
        feet = self._robot.foot_poses(self._ordered(estimate.positions))
        return self._odometry.update(estimate.joints_time, feet, estimate.attitude)

    def health(self) -> Health:
        """Return how the robot is, by its latest reports."""
        imu_problem = self._plausibility.imu_problem
        error = None if imu_problem else self._gravity.error
        return Health(self._battery.state, error, self._refused, self.refusal, imu_problem)

    def _angular_velocity(
        self, time: float, attitude: Quaternion, state: Report
    ) -> tuple[Vector | None, bool]:
        source = self._settings.rate_source
        differentiated = self._rate.update(time, attitude)
        if source is RateSource.NONE:
            return None, False
        if source is RateSource.AUTO and state.rates is not None:
            return self._settings.mounting.rate(state.rates), True
        return differentiated, False

    def _feet(self, targets: Sequence[float]) -> Sequence[Vector]:
        named = dict(zip(self._joints.names, targets, strict=False))  # without those of an arm
        return self._robot.feet(self._ordered(named))

    def _ordered(self, positions: Mapping[str, float]) -> list[float]:
        return [positions.get(name, 0.0) for name in self._robot.names]

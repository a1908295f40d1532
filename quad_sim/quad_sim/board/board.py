# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot's board without its serial line: servos, sensors, battery, and its own gait."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
import math

from quad_description import movable_joints, Pose, pose_positions
from quad_description.rotations import Vector
from quad_hardware.protocol import Fault, Model, MOTOR_ORDER

from ..plant.state import Measurement
from .power import Battery, HOT, LOW_BATTERY, Overload, ServoThermalModel, Turn
from .servos import Mount, Plant, Servos
from .walking import Walker

GAIT_PERIOD = 0.02  # [s] between two sets of targets of the board's own gait
POSE_TIME = 1.0  # [s] into a pose of the board's own
POWER_PERIOD = 0.1  # [s] between two looks at battery and temperatures
BOOT_TIME = 0.5  # [s] after power comes back
MAX_LAG = 0.5  # [s] of time that the simulation catches up after it was held up

FIRMWARE: Mapping[Model, str] = {
    Model.MINI: 'M-4.3.3',
    Model.LITE: 'L-4.3.3',
    Model.WHEELED: 'W-4.3.3',
}


class Mode(IntEnum):
    """Who gives the servos their targets."""

    SERVOS = 0  # the host, one by one
    GAIT = 1  # the board


class Board:
    """What both protocols talk to. Time is that of the caller and only goes forward."""

    def __init__(
        self,
        plant: Plant,
        urdf: str,
        model: Model,
        *,
        firmware: str = '',
        charge: float = 100.0,
        mounts: Mapping[int, Mount] | None = None,
        now: float = 0.0,
    ) -> None:
        """Switch the board on; the robot stays as it is.

        Args:
            charge: Of the battery [%].
            mounts: How servos are mounted that are not as the driver expects, by motor id.

        Raises:
            SetupError: The robot has a joint for which the board has no servo.
        """
        joints = movable_joints(urdf)
        self.servos = Servos(plant, joints, model, mounts or {})  # the servos by motor id
        self.battery = Battery(charge)  # the battery
        self.walker = Walker(urdf)  # the board's own gait
        self.model = model  # whose ranges scale bytes
        self.firmware = firmware or FIRMWARE[model]  # version as the board reports it
        self.lost_time = 0.0  # time that was skipped because the process was held up [s]
        self.imu_failed = False  # whether the attitude is not finite
        self._plant = plant
        self._efforts = [joint.limits.effort for joint in joints]
        self._with_arm = len(joints) > len(pose_positions(Pose.STAND))
        self._thermal_model = ServoThermalModel(len(joints))
        self._overload = Overload(len(joints))
        self._now = now
        self._measured = plant.measure()
        self._power_at = now
        self._powered = True
        self._boot(now)

    def _boot(self, now: float) -> None:
        self._booted_at = now
        self._yaw_origin = 0.0
        self._mode = Mode.SERVOS
        self._gait_at = math.inf
        self._turn: Turn | None = None
        self.walker.reset()

    # -- time and power

    def advance(self, now: float) -> None:
        """Advance the robot to a time [s]."""
        if now - self._now > MAX_LAG:
            self.lost_time += now - self._now - MAX_LAG
            self._now = now - MAX_LAG
        while self._now < now:
            until = min(now, max(self._gait_at, self._now), max(self._power_at, self._now))
            self._plant.step(until - self._now)
            self._now = until
            if until >= self._gait_at:
                self._go_on()
                self._gait_at += GAIT_PERIOD
            if until >= self._power_at:
                self._look_after_power()

    def switch_power(self, on: bool) -> None:
        """Cut the supply, or give it back.

        Without it servos let go and the board forgets everything; with it the servos hold where
        they are, and the board answers again after :data:`BOOT_TIME`.
        """
        if on == self._powered:
            return
        self._powered = on
        self.servos.set_torque(self.servos.fitted, on)
        self._boot(self._now + BOOT_TIME if on else math.inf)

    @property
    def is_booted(self) -> bool:
        """Whether the board runs its programme."""
        return self._powered and self._now >= self._booted_at

    @property
    def uptime(self) -> float:
        """Time since the board began to run [s]."""
        return self._now - self._booted_at if self.is_booted else 0.0

    # -- sensors

    def measure(self) -> Measurement:
        """Return what the sensors measure now."""
        self._measured = self._plant.measure()
        return self._measured

    def attitude(self, measured: Measurement) -> Vector:
        """Return roll, pitch and yaw from the origin [deg]."""
        if self.imu_failed:
            return math.nan, math.nan, math.nan
        roll, pitch, yaw = measured.imu.roll_pitch_yaw
        yaw = math.remainder(yaw - self._yaw_origin, 2.0 * math.pi)
        return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)

    def set_origin(self) -> None:
        """Make the present heading the origin of the yaw."""
        self._yaw_origin = self.measure().imu.roll_pitch_yaw[2]

    def loads(self, measured: Measurement) -> tuple[float, ...]:
        """Return the loads of the servos by slot [%]."""
        return self.servos.by_slot(100.0 * measured.torques / self._efforts)

    @property
    def temperatures(self) -> tuple[float, ...]:
        """Temperatures of the servos by slot [degC]."""
        return self.servos.by_slot(self._thermal_model.temperatures)

    @property
    def faults(self) -> Fault:
        """What the board complains about."""
        faults = Fault(0)
        if self.battery.charge < LOW_BATTERY:
            faults |= Fault.LOW_BATTERY
        if self._thermal_model.temperatures.max() > HOT:
            faults |= Fault.OVERHEATED
        if self._overload.lasts:
            faults |= Fault.OVERLOAD
        if self.servos.failed is not None:
            faults |= Fault.SERVO_SILENT
        if self.imu_failed:
            faults |= Fault.IMU
        return faults

    # -- who moves the servos

    @property
    def mode(self) -> Mode:
        """Who gives the servos their targets."""
        return self._mode

    def take_servos(self) -> None:
        """Hand the servos over to the host; a gait of the board ends where it is."""
        self._mode = Mode.SERVOS
        self._gait_at = math.inf
        self._turn = None
        self.walker.command = (0.0, 0.0, 0.0)
        self.walker.marking_time = False

    def start_gait(self) -> None:
        """Hand the servos over to the board's gait, which begins when the robot stands."""
        if self._mode is Mode.GAIT:
            return
        self._mode = Mode.GAIT
        self._plant.set_targets(self.walker.step(0.0), POSE_TIME)
        self._gait_at = self._now + POSE_TIME

    def walk(self, command: Vector) -> None:
        """Walk ahead [m/s], to the left [m/s] and turn [rad/s] until the next command."""
        self._turn = None
        self.walker.command = command
        self.start_gait()

    def turn_by(self, angle: float) -> None:
        """Turn on the spot by an angle [rad]."""
        self.walk((0.0, 0.0, 0.0))
        self._turn = Turn(angle, self.measure().imu.roll_pitch_yaw[2], self._now)

    @property
    def turning(self) -> bool:
        """Whether a turn by an angle is under way."""
        return self._turn is not None

    def stand(self) -> None:
        """Go to the default pose and stay in it."""
        self.take_servos()
        self.walker.reset()
        self.start_gait()

    def lie_down(self) -> None:
        """Fold the legs and stay so."""
        self.take_servos()
        legs = pose_positions(Pose.LIE, self._with_arm)
        self._plant.set_targets(legs, POSE_TIME)

    def go_to_middle(self) -> None:
        """Bring all servos to zero."""
        self.take_servos()
        self.servos.command(dict.fromkeys(MOTOR_ORDER, 0.0), POSE_TIME)

    def _go_on(self) -> None:
        if self._turn is not None:
            rate = self._turn.rate(self.measure().imu.roll_pitch_yaw[2], self._now)
            self.walker.command = (0.0, 0.0, rate)
            if rate == 0.0:
                self._turn = None
        self._plant.set_targets(self.walker.step(GAIT_PERIOD))

    def _look_after_power(self) -> None:
        self._power_at = self._now + POWER_PERIOD
        torques = self.measure().torques
        self.battery.advance(torques, POWER_PERIOD)
        self._thermal_model.advance(torques / self._efforts, POWER_PERIOD)
        self._overload.advance(torques / self._efforts, POWER_PERIOD)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot's board without its serial line: servos, sensors, battery, built-in gait.

Battery and temperature figures are our assumptions. The vendor's firmware has a trot, commanded by
the registers VX, VY and VYAW; this is a simple one of our own with the legs of the URDF, so that
clients of the register protocol see the robot walk. It is not the gait of quad_controller.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
import math

import numpy as np

from quad_description import LegGeometry, LEGS, movable_joints, Pose, pose_positions, quadruped
from quad_description.rotations import conjugate, from_rpy, rotate, Vector
from quad_hardware.protocol import Fault, Model, MOTOR_ORDER

from .servos import Mount, Plant, Servos
from .state import Array, Measurement

CAPACITY = 2.5 * 3600.0  # [A s] two 18650 cells in series (the vendor's page: 2500 mAh)
EMPTY, FULL = 6.4, 8.4  # [V] without load
RESISTANCE = 0.12  # [Ohm]
IDLE_CURRENT = 0.6  # [A] computer, board and idle servos
CURRENT_PER_TORQUE = 1.6  # [A/(N m)] 0.7 A at stall
AMBIENT = 25.0  # [degC]
HEATING = 55.0  # [K] above ambient of a servo that is held at stall for good
WARM_UP = 90.0  # [s]
LOW_BATTERY = 15.0  # [%]
HOT = 70.0  # [degC]

FULL_LOAD = 0.95  # share of the stall torque; a servo above for a while counts as overloaded
OVERLOAD_TIME = 1.0  # [s] a step of the gait is shorter


@dataclass(slots=True)
class Battery:
    """Model of the battery."""

    charge: float = 100.0  # [%]
    current: float = IDLE_CURRENT  # what is drawn from it [A]

    def advance(self, torques: Array, duration: float) -> None:
        """Draw current for a time [s]."""
        self.current = IDLE_CURRENT + CURRENT_PER_TORQUE * float(np.abs(torques).sum())
        drained = 100.0 * self.current * duration / CAPACITY
        self.charge = max(self.charge - drained, 0.0)

    @property
    def percent(self) -> int:
        """Charge as reported by the board."""
        return round(self.charge)

    @property
    def voltage(self) -> float:
        """Voltage under load [V]."""
        return EMPTY + (FULL - EMPTY) * self.charge / 100.0 - RESISTANCE * self.current


class ServoThermalModel:
    """Servo temperatures, a first-order model driven by the squared loads."""

    def __init__(self, count: int) -> None:
        self.temperatures: Array = np.full(count, AMBIENT)

    def advance(self, loads: Array, duration: float) -> None:
        """Heat up for a time [s] under loads (1: stall)."""
        goal = AMBIENT + HEATING * loads * loads
        self.temperatures += (goal - self.temperatures) * min(duration / WARM_UP, 1.0)


class Overload:
    """How long each servo has been at full torque; foot touchdowns do not count."""

    def __init__(self, count: int) -> None:
        self._since: Array = np.zeros(count)

    def advance(self, loads: Array, duration: float) -> None:
        """Apply loads for a time [s] (1: stall)."""
        self._since = np.where(np.abs(loads) > FULL_LOAD, self._since + duration, 0.0)

    @property
    def lasts(self) -> bool:
        """Whether a servo has been overloaded for too long."""
        return bool(self._since.max() > OVERLOAD_TIME)


STRIDE_TIME = 0.28  # [s] of a stride; longer ones lose speed and roll
DUTY = 0.55  # share of a stride that a foot is on the ground
LIFT = 0.020  # [m]
HEIGHT = 0.085  # [m] from hip to foot
FOOT_AHEAD = -0.024  # [m] foot ahead of the hip: below the centre of mass
DIAGONAL = {'fl': 0.0, 'fr': 0.5, 'bl': 0.5, 'br': 0.0}
ACCELERATION = (1.0, 1.0, 4.0)  # [m/s2], [m/s2], [rad/s2]
STILL = 1e-3


@dataclass(slots=True)
class Stance:
    """Body pose over the feet, and the changes a host made to it."""

    shift: tuple[float, float] = (0.0, 0.0)  # of the body [m]
    height: float = HEIGHT  # from hip to foot [m]
    attitude: Vector = (0.0, 0.0, 0.0)  # roll, pitch, yaw of the body over the ground [rad]
    # feet that a host moved, from where they stand [m], by leg
    feet: dict[str, Vector] = field(default_factory=dict)


class Walker:
    """Stands or trots; :meth:`step` generates each set of targets."""

    def __init__(self, urdf: str) -> None:
        """Stand, as after power-up."""
        self._robot = quadruped(urdf)
        self.reset()

    def reset(self) -> None:
        """Stand, as after power-up."""
        self.stance = Stance()  # how it stands; a host may change it
        # wanted speed ahead [m/s], to the left [m/s] and turning [rad/s]
        self.command: Vector = (0.0, 0.0, 0.0)
        self.marking_time = False  # trots on the spot
        self.lift = LIFT  # of a foot [m]
        self._speed: Vector = (0.0, 0.0, 0.0)
        self._phase = 0.0
        self._stride = 0.0  # share of the lift, for a soft start and end

    @property
    def walking(self) -> bool:
        """Whether feet leave the ground now or soon."""
        wanted = self.marking_time or any(self.command)
        return wanted or self._stride > STILL or any(abs(v) > STILL for v in self._speed)

    def step(self, duration: float) -> Mapping[str, float]:
        """Advance by a time [s]; return the joint positions [rad]."""
        self._speed = tuple(  # type: ignore[assignment]
            now + min(max(wanted - now, -limit * duration), limit * duration)
            for now, wanted, limit in zip(self._speed, self.command, ACCELERATION, strict=True)
        )
        wanted = 1.0 if self.marking_time or any(self.command) else 0.0
        moving = 1.0 if any(abs(v) > 10 * STILL for v in self._speed) else wanted
        self._stride += min(
            max(moving - self._stride, -duration / STRIDE_TIME), duration / STRIDE_TIME
        )
        if self.walking:
            self._phase = (self._phase + duration / STRIDE_TIME) % 1.0
        else:
            self._phase = self._stride = 0.0
        robot = self._robot
        feet = [self._foot(name, leg) for name, leg in zip(LEGS, robot.legs, strict=True)]
        return {
            joint: angle
            for leg, solution in zip(robot.legs, robot.solve(feet), strict=True)
            for joint, angle in zip(leg.joints, solution.angles, strict=True)
        }

    def _foot(self, name: str, leg: LegGeometry) -> Vector:
        """Return the target position of a foot in base_link."""
        stance, (middle, _, hip_height) = self.stance, self._robot.hip_centre
        dx, dy, dz = stance.feet.get(name, (0.0, 0.0, 0.0))
        # the place under the hip, seen from the middle between the legs
        x = leg.hip[0] - middle + FOOT_AHEAD + dx
        y = leg.hip[1] + leg.offset_y + dy
        vx, vy, turn = self._speed
        forward, left, up = _stride(
            (self._phase + DIAGONAL[name]) % 1.0, vx - turn * y, vy + turn * x
        )
        ground = (
            x + forward - stance.shift[0],
            y + left - stance.shift[1],
            -stance.height + dz + up * self.lift * self._stride,
        )
        to_body = conjugate(from_rpy(*stance.attitude))
        x, y, z = rotate(to_body, ground)
        return middle + x, y, hip_height + z


def _stride(phase: float, vx: float, vy: float) -> Vector:
    """Return a foot's offset in its stride: ahead [m], left [m], fraction of the lift."""
    half = 0.5 * DUTY * STRIDE_TIME
    if phase < DUTY:
        time = half * (1.0 - 2.0 * phase / DUTY)
        return time * vx, time * vy, 0.0
    k = (phase - DUTY) / (1.0 - DUTY)
    # Hermite from -half to half whose ends move backward as the ground does
    slope = -(1.0 - DUTY) * STRIDE_TIME
    time = half * (-4 * k**3 + 6 * k**2 - 1) + slope * (2 * k**3 - 3 * k**2 + k)
    return time * vx, time * vy, 0.5 * (1.0 - math.cos(2.0 * math.pi * k))


TURN_RATE = math.radians(60.0)  # [rad/s]
# [rad] from here on it counts as done: the last stride adds the rest
TURN_DONE = math.radians(2.0)
MAX_DURATION_RATIO = 3.0  # times the time that it should take; a robot that cannot turn gives up


class Turn:
    """A turn in progress; finished when :meth:`rate` is zero."""

    def __init__(self, angle: float, yaw: float, now: float) -> None:
        """Start a turn by an angle [rad], positive counter-clockwise, at a heading."""
        self._left = angle
        self._yaw = yaw
        self._deadline = now + 1.0 + MAX_DURATION_RATIO * abs(angle) / TURN_RATE

    def rate(self, yaw: float, now: float) -> float:
        """Return the turning rate [rad/s] for the present heading [rad], which may wrap."""
        self._left -= math.remainder(yaw - self._yaw, 2.0 * math.pi)
        self._yaw = yaw
        if abs(self._left) < TURN_DONE or now > self._deadline:
            return 0.0
        return math.copysign(min(TURN_RATE, 2.0 * abs(self._left) + 0.2), self._left)


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
    """Source of the servo targets."""

    SERVOS = 0  # the host, one by one
    GAIT = 1  # the board


class Board:
    """Board behind both protocols. The caller supplies the time, which only increases."""

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
        """Power up the board; the robot keeps its posture.

        Args:
            charge: Charge of the battery [%].
            mounts: Servo mountings that differ from the driver's assumptions, by motor id.

        Raises:
            SetupError: The robot has a joint for which the board has no servo.
        """
        joints = movable_joints(urdf)
        self.servos = Servos(plant, joints, model, mounts or {})  # the servos by motor id
        self.battery = Battery(charge)  # the battery
        self.walker = Walker(urdf)  # the board's own gait
        self.model = model  # whose ranges scale bytes
        self.firmware = firmware or FIRMWARE[model]  # version as the board reports it
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
        self.mode = Mode.SERVOS  # who gives the servos their targets
        self._gait_at = math.inf
        self._turn: Turn | None = None
        self.walker.reset()

    # -- time and power

    def advance(self, now: float) -> None:
        """Advance the robot to a time [s]."""
        if now - self._now > MAX_LAG:
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
        """Switch the power supply off or on.

        When off, servos release and the board loses its state; when on, servos hold their
        positions, and the board answers again after :data:`BOOT_TIME`.
        """
        if on == self._powered:
            return
        self._powered = on
        self.servos.set_torque(self.servos.fitted, on)
        self._boot(self._now + BOOT_TIME if on else math.inf)

    @property
    def is_booted(self) -> bool:
        """Whether the board has booted."""
        return self._powered and self._now >= self._booted_at

    @property
    def uptime(self) -> float:
        """Time since boot [s]."""
        return self._now - self._booted_at if self.is_booted else 0.0

    # -- sensors

    def measure(self) -> Measurement:
        """Return the present sensor values."""
        self._measured = self._plant.measure()
        return self._measured

    def attitude(self, measured: Measurement) -> Vector:
        """Return roll, pitch and yaw relative to the origin [deg]."""
        if self.imu_failed:
            return math.nan, math.nan, math.nan
        roll, pitch, yaw = measured.imu.roll_pitch_yaw
        yaw = math.remainder(yaw - self._yaw_origin, 2.0 * math.pi)
        return math.degrees(roll), math.degrees(pitch), math.degrees(yaw)

    def set_origin(self) -> None:
        """Set the yaw origin to the present heading."""
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
        """Present faults of the board."""
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

    def take_servos(self) -> None:
        """Give the host control of the servos; a gait of the board stops where it is."""
        self.mode = Mode.SERVOS
        self._gait_at = math.inf
        self._turn = None
        self.walker.command = (0.0, 0.0, 0.0)
        self.walker.marking_time = False

    def start_gait(self) -> None:
        """Give the board's gait control of the servos; it starts once the robot stands."""
        if self.mode is Mode.GAIT:
            return
        self.mode = Mode.GAIT
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
        """Whether a turn by an angle is in progress."""
        return self._turn is not None

    def stand(self) -> None:
        """Go to the default pose and stay in it."""
        self.take_servos()
        self.walker.reset()
        self.start_gait()

    def lie_down(self) -> None:
        """Fold the legs and keep them folded."""
        self.take_servos()
        legs = pose_positions(Pose.LIE, self._with_arm)
        self._plant.set_targets(legs, POSE_TIME)

    def go_to_middle(self) -> None:
        """Move all servos to zero."""
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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot's servos as seen by the board: ids and degrees instead of joints and radians.

A servo's angle is the joint's position in degrees, sign +1 and offset 0, unless mounted
otherwise. The travel of the gripper's jaw maps to the whole range of its servo.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from quad_description import Joint
from quad_hardware.protocol import ANGLE_SPANS, Model, MOTOR_OF_JOINT, MOTOR_ORDER, slot_of

from .exceptions import SetupError
from .plant import KinematicRobot
from .state import Array, Measurement

if TYPE_CHECKING:
    from .physics import Robot

Plant: TypeAlias = 'KinematicRobot | Robot'
"""What has servos: a robot in physics, which needs MuJoCo, or one that is held in the air."""

GRIPPER = 51
NO_LOAD_SPEED = 527.0  # [deg/s] 9.2 rad/s: what servo speed 255 means here; no page says it
MAX_SPEED = 255


@dataclass(frozen=True, slots=True)
class Mount:
    """Sign and offset of a servo on its joint."""

    sign: int = 1  # 1, or -1 for one that turns the other way
    offset: float = 0.0  # what the servo reads where the joint is at zero [deg]

    def __post_init__(self) -> None:
        """Reject an invalid mounting.

        Raises:
            SetupError: The message has the reason.
        """
        if self.sign not in {1, -1} or not abs(self.offset) <= 180.0:
            raise SetupError(
                f'servo mounted with sign {self.sign} and offset {self.offset}: '
                'give 1 or -1, and -180 to 180 degrees'
            )


AS_EXPECTED = Mount()


class Servos:
    """All servos of a robot, by motor id."""

    def __init__(
        self,
        plant: Plant,
        joints: Iterable[Joint],
        model: Model,
        mounts: Mapping[int, Mount],
    ) -> None:
        """Connect to a robot; mounts override the driver's assumptions, by motor id.

        Raises:
            SetupError: A joint has no motor on this board, or a mounted servo no joint.
        """
        self._plant = plant
        self._joint: dict[int, str] = {}
        # positions are offset + gain * angle [rad], of the gripper [m]
        self._gain: dict[int, float] = {}
        self._offset: dict[int, float] = {}
        for joint in joints:
            motor = MOTOR_OF_JOINT.get(joint.name)
            if motor is None:
                raise SetupError(f'the board has no servo for joint {joint.name}')
            self._joint[motor] = joint.name
            mount = mounts.get(motor, AS_EXPECTED)
            gain, offset = math.pi / 180.0, 0.0
            if motor == GRIPPER:
                span = ANGLE_SPANS[model][motor]
                gain = (joint.limits.upper - joint.limits.lower) / (span.high - span.low)
                offset = joint.limits.lower - gain * span.low
            self._gain[motor] = gain * mount.sign
            self._offset[motor] = offset - gain * mount.sign * mount.offset
        if unknown := sorted(mounts.keys() - self._joint.keys()):
            raise SetupError(f'no servo has id {unknown[0]}; there are {sorted(self._joint)}')
        self._index = {motor: plant.joint_names.index(name) for motor, name in self._joint.items()}
        # by joint, in the order of the robot's arrays
        order = sorted(self._index, key=lambda motor: self._index[motor])
        self._slots = [slot_of(motor) for motor in order]
        self._gains = np.array([self._gain[motor] for motor in order])
        self._offsets = np.array([self._offset[motor] for motor in order])
        # ids of the servos that the robot has, in the order of the wire
        self.fitted = tuple(motor for motor in MOTOR_ORDER if motor in self._joint)
        self.failed: int | None = None  # id of the servo that does not work, None if all do
        self._speed = dict.fromkeys(self.fitted, MAX_SPEED)

    def command(self, angles: Mapping[int, float], duration: float | None = None) -> None:
        """Move servos to angles [deg] in a time [s], by default their own; skip missing servos."""
        positions = {
            self._joint[motor]: self._offset[motor] + self._gain[motor] * angle
            for motor, angle in angles.items()
            if motor in self._joint
        }
        self._plant.set_targets(positions, duration)

    def command_one(self, motor: int, angle: float) -> None:
        """Move one servo to an angle [deg] at its configured speed."""
        if motor not in self._joint:
            return
        speed = self._speed[motor]
        if speed >= MAX_SPEED:
            self.command({motor: angle})
            return
        place = float(self._plant.joint_targets[self._index[motor]])
        now = (place - self._offset[motor]) / self._gain[motor]
        self.command({motor: angle}, abs(angle - now) / (NO_LOAD_SPEED * speed / MAX_SPEED))

    def set_speed(self, motors: Iterable[int], speed: int) -> None:
        """Set the speed of single commands, 1 to 255."""
        self._speed |= dict.fromkeys(motors, max(speed, 1))

    @property
    def at_full_speed(self) -> bool:
        """Whether all servos run at full speed."""
        return min(self._speed.values()) >= MAX_SPEED

    def set_torque(self, motors: Iterable[int], on: bool, *, hold: bool = True) -> None:
        """Switch servos on or off; skip missing and failed ones.

        Args:
            hold: Servos that switch on hold their position, as after power-up; else they go to
                their last target, as when a host restores the torque.
        """
        names = [
            self._joint[motor]
            for motor in motors
            if motor in self._joint and not (on and motor == self.failed)
        ]
        self._plant.set_torque(on, names, hold=hold)

    def fail(self, motor: int | None) -> None:
        """Make a servo fail and release; the one that failed before works again and holds."""
        if motor == self.failed:
            return
        repaired, self.failed = self.failed, motor
        if repaired is not None:
            self.set_torque([repaired], True)
        if motor is not None:
            self.set_torque([motor], False)

    def torque_on(self, motor: int) -> bool:
        """Return whether a servo has torque."""
        return self._plant.torque_on(self._joint[motor])

    def angles(self, measured: Measurement) -> tuple[float, ...]:
        """Return angles by slot [deg]; 0 for missing servos."""
        return self.by_slot((measured.positions - self._offsets) / self._gains)

    def speeds(self, measured: Measurement) -> tuple[float, ...]:
        """Return velocities by slot [deg/s]; 0 for missing servos."""
        return self.by_slot(measured.velocities / self._gains)

    def by_slot(self, values: Array) -> tuple[float, ...]:
        """Reorder joint values by slot."""
        slots = np.zeros(len(MOTOR_ORDER))
        slots[self._slots] = values
        return tuple(slots.tolist())

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint positions of the URDF [rad] against servo angles on the wire [deg].

``position = offset + sign * gain * angle``. For a turning joint the gain is pi/180. For the
gripper, which slides, the travel of the joint is spread over the servo's whole range.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
import math

from quad_description import Joint

from ..exceptions import CommandError
from ..protocol import ANGLE_SPANS, LEG_MOTORS, Model, MOTOR_OF_JOINT, MOTOR_ORDER, Span

GRIPPER_MOTOR = 51
SERVO_REACH = 200.0  # [deg] no servo turns farther, and the wire carries it
DEGREE = math.pi / 180.0  # [rad]


@dataclass(frozen=True, slots=True)
class JointServo:
    """A joint and the servo that moves it."""

    joint: str  # name in the URDF
    motor: int  # id on the wire
    sign: int = 1  # 1 or -1
    # position of the joint where the servo is at zero [rad], of the gripper [m]
    offset: float = 0.0
    lower: float = -math.inf  # least position that is sent [rad], [m]
    upper: float = math.inf  # greatest position that is sent [rad], [m]
    gain: float = DEGREE  # position a degree of the servo is worth [rad/deg], [m/deg]

    def __post_init__(self) -> None:
        """Refuse what would move a servo the wrong way or not at all."""
        if self.sign not in {1, -1}:
            raise CommandError(f'{self.joint}: sign {self.sign} is neither 1 nor -1')
        if not math.isfinite(self.offset):
            raise CommandError(f'{self.joint}: offset {self.offset} is not a position')
        if not self.lower <= self.upper:
            raise CommandError(f'{self.joint}: lower {self.lower} is above upper {self.upper}')

    def position(self, angle: float) -> float:
        """Return the position of the joint [rad], [m] for a servo angle [deg]."""
        return self.offset + self.sign * self.gain * angle

    def velocity(self, speed: float) -> float:
        """Return the velocity of the joint [rad/s], [m/s] for one of the servo [deg/s]."""
        return self.sign * self.gain * speed

    def angle(self, position: float) -> float:
        """Return the servo angle [deg] for a position of the joint [rad], [m]."""
        return self.sign * (position - self.offset) / self.gain


def servo_of(joint: Joint, motor: int | None = None) -> JointServo:
    """Return the servo of a joint, with sign 1, no offset and the limits of the URDF.

    Args:
        motor: Its id, where it is not the one that the vendor's names imply.

    Raises:
        CommandError: The joint has no known motor.
    """
    number = MOTOR_OF_JOINT.get(joint.name) if motor is None else motor
    if number is None:
        known = ', '.join(MOTOR_OF_JOINT)
        raise CommandError(
            f'no motor is known for joint {joint.name!r} of the URDF; rename it (known: {known}) '
            f'or set joints.{joint.name}.motor'
        )
    if number != GRIPPER_MOTOR:
        return JointServo(joint.name, number, lower=joint.limits.lower, upper=joint.limits.upper)
    span = ANGLE_SPANS[Model.LITE][GRIPPER_MOTOR]
    gain = (joint.limits.upper - joint.limits.lower) / (span.high - span.low)
    offset = joint.limits.lower - gain * span.low
    return JointServo(joint.name, number, 1, offset, joint.limits.lower, joint.limits.upper, gain)


def _within_reach(servo: JointServo) -> JointServo:
    ends = sorted((servo.position(-SERVO_REACH), servo.position(SERVO_REACH)))
    lower, upper = max(servo.lower, ends[0]), min(servo.upper, ends[1])
    if lower > upper:
        raise CommandError(
            f'{servo.joint}: with offset {servo.offset:g} its servo would have to turn beyond '
            f'{SERVO_REACH:g} degrees for {servo.lower:g} to {servo.upper:g}; correct '
            f'joints.{servo.joint}.offset, .lower or .upper'
        )
    return replace(servo, lower=lower, upper=upper)


def _within_span(servo: JointServo, span: Span) -> JointServo:
    low, high = sorted((servo.position(span.low), servo.position(span.high)))
    lower = min(max(servo.lower, low), high)
    return replace(servo, lower=lower, upper=max(min(servo.upper, high), lower))


class JointMap:
    """All joints of a robot, in the order of the URDF."""

    def __init__(self, servos: Iterable[JointServo]) -> None:
        """Keep the servos; a limit beyond the reach of its servo is taken to that.

        Raises:
            CommandError: A leg's motor is missing or unknown, two joints have the same motor, a
                joint of the arm stands before one of a leg, or no servo reaches the limits.
        """
        self.servos = tuple(map(_within_reach, servos))
        self.names = tuple(servo.joint for servo in self.servos)
        motors = [servo.motor for servo in self.servos]
        missing = [motor for motor in LEG_MOTORS if motor not in motors]
        if missing:
            joints = [name for name, motor in MOTOR_OF_JOINT.items() if motor in missing]
            raise CommandError(
                f'the URDF has no joint for motors {", ".join(map(str, missing))}; '
                f'by the vendor’s names {", ".join(joints)}; correct robot_description, or the'
                ' parameters joints.JOINT.motor'
            )
        twice = sorted({motor for motor in motors if motors.count(motor) > 1})
        if twice:
            raise CommandError(
                f'motor {", ".join(map(str, twice))} moves two joints of the URDF; correct the'
                ' parameters joints.JOINT.motor'
            )
        unknown = [s for s in self.servos if s.motor not in MOTOR_ORDER]
        if unknown:
            raise CommandError(
                f'{unknown[0].joint}: unknown motor {unknown[0].motor}; '
                f'give joints.{unknown[0].joint}.motor, one of {", ".join(map(str, MOTOR_ORDER))}'
            )
        early = [s.joint for s in self.servos[: self.leg_count] if s.motor not in LEG_MOTORS]
        if early:  # twelve positions are those of the legs
            raise CommandError(
                f'the URDF has {", ".join(early)} before joints of the legs; put the legs first'
            )

    @property
    def leg_count(self) -> int:
        """How many joints the legs have."""
        return len(LEG_MOTORS)

    def within(self, spans: Mapping[int, Span]) -> JointMap:
        """Return the joints with their limits within what their servos can be sent [deg]."""
        return JointMap(_within_span(s, spans[s.motor]) for s in self.servos)

    def positions(self, angles: Mapping[int, float]) -> dict[str, float]:
        """Return positions [rad], [m] by joint, of those whose servo is reported."""
        return {s.joint: s.position(angles[s.motor]) for s in self.servos if s.motor in angles}

    def velocities(self, speeds: Mapping[int, float]) -> dict[str, float]:
        """Return velocities [rad/s], [m/s] by joint, as :meth:`positions`."""
        return {s.joint: s.velocity(speeds[s.motor]) for s in self.servos if s.motor in speeds}

    def angles(self, positions: Sequence[float]) -> dict[int, float]:
        """Return servo angles [deg] by motor for the first joints of the robot."""
        pairs = zip(self.servos, positions, strict=False)
        return {servo.motor: servo.angle(position) for servo, position in pairs}

    def angles_at(self, place: Mapping[str, float]) -> dict[int, float]:
        """Return servo angles [deg] by motor for positions by joint, of those that are there."""
        return {s.motor: s.angle(place[s.joint]) for s in self.servos if s.joint in place}

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Maps URDF joints [rad] to servo angles on the wire [deg]; checks and limits commands.

``position = offset + sign * gain * angle``. For a revolute joint the gain is pi/180. For the
prismatic gripper, the travel of the joint maps to the servo's whole range. A valid command has the
right length and finite numbers within limits, and makes no servo jump.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
import math

from quad_description import Joint, STREAM_TIMEOUT
from robot_primitives import setting, switch

from .exceptions import CommandError
from .protocol import ANGLE_SPANS, LEG_MOTORS, Model, MOTOR_OF_JOINT, MOTOR_ORDER, Span

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
        """Reject an invalid sign, offset or range."""
        if self.sign not in {1, -1}:
            raise CommandError(f'{self.joint}: sign {self.sign} is neither 1 nor -1')
        if not math.isfinite(self.offset):
            raise CommandError(f'{self.joint}: offset {self.offset} is not a position')
        if not self.lower <= self.upper:
            raise CommandError(f'{self.joint}: lower {self.lower} is above upper {self.upper}')

    def position(self, angle: float) -> float:
        """Return the joint position [rad], [m] for a servo angle [deg]."""
        return self.offset + self.sign * self.gain * angle

    def velocity(self, speed: float) -> float:
        """Return the joint velocity [rad/s], [m/s] for a servo velocity [deg/s]."""
        return self.sign * self.gain * speed

    def angle(self, position: float) -> float:
        """Return the servo angle [deg] for a joint position [rad], [m]."""
        return self.sign * (position - self.offset) / self.gain


def servo_of(joint: Joint, motor: int | None = None) -> JointServo:
    """Return the servo of a joint, with sign 1, no offset and the limits of the URDF.

    Args:
        motor: Motor id, if it differs from the one that the vendor's names imply.

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
    """All joints of a robot with their servos, in the order of the URDF."""

    def __init__(self, servos: Iterable[JointServo]) -> None:
        """Store the servos; reduce limits beyond the range of a servo to that range.

        Raises:
            CommandError: A leg's motor is missing or unknown, two joints have the same motor, a
                joint of the arm stands before one of a leg, or a servo cannot reach the limits.
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
        """Number of leg joints."""
        return len(LEG_MOTORS)

    def within(self, spans: Mapping[int, Span]) -> JointMap:
        """Return a copy with joint limits reduced to what the servos accept [deg]."""
        return JointMap(_within_span(s, spans[s.motor]) for s in self.servos)

    def positions(self, angles: Mapping[int, float]) -> dict[str, float]:
        """Return positions [rad], [m] by joint, for the reported servos."""
        return {s.joint: s.position(angles[s.motor]) for s in self.servos if s.motor in angles}

    def velocities(self, speeds: Mapping[int, float]) -> dict[str, float]:
        """Return velocities [rad/s], [m/s] by joint, for the reported servos."""
        return {s.joint: s.velocity(speeds[s.motor]) for s in self.servos if s.motor in speeds}

    def angles(self, positions: Sequence[float]) -> dict[int, float]:
        """Return servo angles [deg] by motor for the first joints of the robot."""
        pairs = zip(self.servos, positions, strict=False)
        return {servo.motor: servo.angle(position) for servo, position in pairs}

    def angles_at(self, place: Mapping[str, float]) -> dict[int, float]:
        """Return servo angles [deg] by motor for positions by joint; skip missing ones."""
        return {s.motor: s.angle(place[s.joint]) for s in self.servos if s.joint in place}


NOMINAL_PERIOD = 0.02  # [s]
MAX_PERIOD = 0.03  # [s] a pause between two commands does not add up to a jump


class LossReaction(Enum):
    """Reaction of the robot to lost commands; the value is that of the parameter."""

    LIE = 'lie'  # folds its legs
    HOLD = 'hold'  # stays as it is


@dataclass(frozen=True, slots=True)
class LimiterSettings:
    """Speed limits of targets, and the reaction when commands break off."""

    # of the gripper, times its travel in a radian of servo
    max_joint_speed: float = setting(12.0, 0.1, 100.0, 'of targets [rad/s]')
    # never above the other one
    start_joint_speed: float = setting(2.0, 0.1, 100.0, 'of targets when commands begin [rad/s]')
    start_time: float = 0.5  # after which ``max_joint_speed`` is reached [s]
    stream_timeout: float = STREAM_TIMEOUT  # a pause that ends a stream [s]
    command_loss: LossReaction = switch(  # noqa: RUF009  # a field
        LossReaction.LIE, 'what the robot does when commands break off with a leg in the air'
    )


@dataclass(frozen=True, slots=True)
class Command:
    """Limited servo angles for a joint command."""

    targets: tuple[float, ...]  # positions [rad], [m] of the first joints, in their order
    clamped: tuple[str, ...] = ()  # joints that were asked to go beyond their limits
    slowed: tuple[str, ...] = ()  # joints that were asked to move faster than allowed
    # joints that were found beyond their limits and are not back yet
    outside: tuple[str, ...] = ()
    unseen: tuple[str, ...] = ()  # joints that begin to move from an unknown place


class CommandLimiter:
    """Limits commands so that no servo target jumps.

    A stream of commands begins at the measured joint positions; it ends with a pause, or with
    :meth:`reset` after the loss of the robot. A joint found beyond its limits may stay or come
    back: its range extends to its position, and shrinks as it returns. An unmeasured joint is
    assumed to be at its last target; before the first target its position is unknown, and its
    servo has to move slowly.
    """

    def __init__(self, joints: JointMap, settings: LimiterSettings | None = None) -> None:
        self.joints = joints  # may be exchanged for the same ones with other limits
        self._settings = settings or LimiterSettings()
        degree = math.pi / 180.0
        self._share = tuple(servo.gain / degree for servo in joints.servos)
        self._targets: list[float] = []
        self._previous: list[float] = []  # targets before the last step
        self._began_at = 0.0
        self._last_at = -math.inf
        self._end = self._seen_end = object()  # replaced by reset(), whichever thread it is in

    def reset(self) -> None:
        """End the stream; joints may move before the next command starts a new one.

        Thread-safe; takes effect at the next :meth:`step`.
        """
        self._end = object()

    def withdraw(self) -> None:
        """Undo the last :meth:`step`, because its targets were replaced before sending."""
        self._targets = list(self._previous)

    def step(
        self, positions: Sequence[float], measured: Sequence[float | None], now: float
    ) -> Command:
        """Limit a command and return what to send.

        Args:
            positions: Targets of all joints, or of the legs only, in the order of the URDF [rad],
                [m].
            measured: Measured positions; None if not reported, which only non-leg joints may be.

        Raises:
            CommandError: The length is wrong, a number is not finite, or the position of a leg
                is unknown; send nothing.
        """
        self.check(positions)
        if (end := self._end) is not self._seen_end:
            self._seen_end, self._last_at, self._targets = end, -math.inf, []
        if now - self._last_at > self._settings.stream_timeout:
            self._begin(measured, now)
        self._previous = list(self._targets)
        elapsed = min(max(now - self._last_at, 0.0), MAX_PERIOD)
        self._last_at = now
        return self._approach(positions, self._speed(now) * elapsed)

    def check(self, positions: Sequence[float]) -> None:
        """Reject an invalid command, regardless of the joint positions.

        Args:
            positions: See :meth:`step`.

        Raises:
            CommandError: The length is wrong, or a number is not finite.
        """
        names = self.joints.names
        if len(positions) not in {len(names), self.joints.leg_count}:
            raise CommandError(
                f'{len(positions)} positions for {len(names)} joints; give one for each of '
                f'{", ".join(names)}'
                + (f', or the first {self.joints.leg_count}' if len(names) > 12 else '')
            )
        wrong = [name for name, p in zip(names, positions, strict=False) if not math.isfinite(p)]
        if wrong:
            raise CommandError(
                f'no finite position for {", ".join(wrong)}; the command is refused'
            )

    def _begin(self, measured: Sequence[float | None], now: float) -> None:
        legs = zip(self.joints.names[: self.joints.leg_count], measured, strict=False)
        lost = [name for name, place in legs if place is None]
        if lost:
            raise CommandError(
                f'no report of {", ".join(lost)}, so the target could jump; '
                'wait for reports of the robot'
            )
        sent = self._targets or [math.nan] * len(measured)
        self._targets = [
            last if place is None else place for last, place in zip(sent, measured, strict=True)
        ]
        self._began_at = now
        self._last_at = now - NOMINAL_PERIOD

    def _speed(self, now: float) -> float:
        settings = self._settings
        share = min((now - self._began_at) / settings.start_time, 1.0)
        start = min(settings.start_joint_speed, settings.max_joint_speed)
        return start + share * (settings.max_joint_speed - start)

    def _approach(self, positions: Sequence[float], step: float) -> Command:
        clamped, slowed, outside, unseen = [], [], [], []
        for index, wanted in enumerate(positions):
            servo, last = self.joints.servos[index], self._targets[index]
            if math.isnan(last):
                unseen.append(servo.joint)
                last = min(max(wanted, servo.lower), servo.upper)
            goal = min(max(wanted, min(servo.lower, last)), max(servo.upper, last))
            if goal != wanted:
                clamped.append(servo.joint)
            reach = step * self._share[index]
            target = min(max(goal, last - reach), last + reach)
            if target != goal:
                slowed.append(servo.joint)
            if not servo.lower <= target <= servo.upper:
                outside.append(servo.joint)
            self._targets[index] = target
        return Command(
            tuple(self._targets[: len(positions)]),
            tuple(clamped),
            tuple(slowed),
            tuple(outside),
            tuple(unseen),
        )

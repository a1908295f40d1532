# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging: converts fresh commands to joint speeds, and stops when they expire.

A command is a tool twist, joint speeds, or a pose to track.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin

from arm_model import Array, Mask, Pose, RobotModel, RobotState, turned_twists
from arm_trajectory import OnlineTrajectoryGenerator

from .controller import ArmState, Cause, Controller, Limiter, MotionReport, Source
from .velocity_ik import BASE, IkAnswer, IkSettings, TwistTask, VelocityIk

NO_AXES: Mask = np.zeros(6, dtype=np.bool_)  # mask of no axis of a twist

RELEASED_SPEED = np.array([2e-3] * 3 + [5e-3] * 3)
"""Speeds in [m/s] and [rad/s] below which a released axis is held again."""

MIN_COMMAND_FACTOR = 0.1  # least executed share of a command while held axes are off

SLOWED, HASTENED = 0.1, 0.4
"""Least times in [s] in which the executed share of a command falls to 0 and recovers."""

SOLVE_PERIOD = 16e-3
"""Least time in [s], rounded to whole cycles, for which solved joint speeds are used."""

REST_SPEED_FACTOR = 0.02
"""Share of the joint speed limits below which a released jog need not stop along its line."""

MAX_SLOW_DOWN_TIME = 1.0
"""Longest time in [s] for which a released jog slows down along its line."""


@dataclass(frozen=True, slots=True, eq=False)
class TwistCommand:
    """A commanded twist of the tool."""

    twist: Array  # linear [m/s], then angular [rad/s] (6), turning about the tip
    # link whose axes the twist is given in and follows; None is the base
    link: str | None = None
    axes: Array | None = None  # rotation (3, 3) from other axes to the base, in place of a link


@dataclass(frozen=True, slots=True, eq=False)
class JointCommand:
    """Commanded joint speeds."""

    velocity: Array  # speeds in [rad/s], in the order of the joints
    commanded: Mask  # mask of the commanded joints; the others are held


@dataclass(frozen=True, slots=True, eq=False)
class PoseCommand:
    """A target pose of the tip, tracked if it moves."""

    pose: Pose  # pose of the tip in the base
    linear_speed: float = 0.4  # greatest speed of the tip in [m/s]
    angular_speed: float = 0.8  # greatest angular speed of the tip in [rad/s]


Command = TwistCommand | JointCommand | PoseCommand


@dataclass(frozen=True, slots=True)
class ServoSettings:
    """Settings of jogging."""

    hold: float = 8.0  # gain of correcting held axes in [1/s]
    approach: float = 4.0  # gain of the final approach to a pose in [1/s]
    linear_deceleration: float = 0.5  # deceleration towards a pose in [m/s2]
    angular_deceleration: float = 1.5  # angular deceleration towards a pose in [rad/s2]
    path_error: float = 5e-4  # error of held axes at which the command is slowed down in [m]
    # mask of the axes that are never held; by default rotations of arms that have fewer than six
    # joints
    drift: tuple[bool, bool, bool, bool, bool, bool] | None = None
    ik: IkSettings = field(default_factory=IkSettings)  # weights of the inverse kinematics


class ServoSource:
    """Converts a command to joint speeds, cycle by cycle.

    It holds the axes that are not commanded: it stores their pose and corrects errors. A released
    axis is held where it comes to rest.
    """

    def __init__(self, model: RobotModel, settings: ServoSettings | None = None) -> None:
        self._model = model
        self._settings = settings or ServoSettings()
        self._ik = VelocityIk(model, self._settings.ik)
        drift = self._settings.drift or (False,) * 3 + (len(model) < 6,) * 3
        self._drift = np.array(drift)
        self._length = model.reach / 3.0
        self._held: Pose | None = None
        self._axes_of: object = None
        self._free = NO_AXES
        self._share = 1.0

    def reset(self) -> None:
        """Discard the held pose."""
        self._held = None
        self._axes_of = None
        self._free = NO_AXES
        self._share = 1.0

    def step(self, state: RobotState, command: Command, period: float) -> IkAnswer:
        """Compute the joint speeds for a command."""
        if isinstance(command, JointCommand):
            self.reset()
            return self._ik.joints(state, command.velocity, command.commanded, period)
        if isinstance(command, PoseCommand):
            self.reset()
            return self._toward(state, command, period)
        return self._jog(state, command, period)

    def _jog(self, state: RobotState, command: TwistCommand, period: float) -> IkAnswer:
        pose = self._model.pose(state.position)
        axes = self._axes(state, command)
        family = command.link if command.axes is None else 'axes'
        if self._held is None or family != self._axes_of:
            self._held, self._axes_of, self._free = pose, family, NO_AXES
        commanded = np.abs(command.twist) > 0.0
        released = self._free & ~commanded
        if released.any():
            released &= self._still_moving(state, axes)
        moved = self._free = released | commanded
        error = _error(self._held, pose, axes)
        error[moved | self._drift] = 0.0
        self._held = _moved(pose, axes, error)
        share = self._share = self._governor(error, period)
        task = TwistTask(
            command.twist * share, axes, moved, self._drift, self._settings.hold * error
        )
        answer = self._ik.cartesian(state, task, period)
        if share == 1.0:
            return answer
        off = float(np.abs(error).max())
        limiter = Limiter(Cause.HOLD, 'held axes come back first', off, share)
        report = answer.report
        return IkAnswer(
            answer.velocity, MotionReport(report.factor * share, (*report.limiters, limiter))
        )

    def _axes(self, state: RobotState, command: TwistCommand) -> Array:
        if command.axes is not None:
            return command.axes
        if command.link is None:
            return BASE
        return self._model.pose(state.position, command.link).rotation

    def _still_moving(self, state: RobotState, axes: Array) -> Mask:
        twist = self._model.jacobian(state.position) @ state.velocity
        moving: Mask = np.abs(turned_twists(axes, twist)) > RELEASED_SPEED
        return moving

    def _governor(self, error: Array, period: float) -> float:
        """Return the share of the command to execute, less than 1 while held axes are off."""
        scale = self._settings.path_error
        x, y, z, *turns = error.tolist()
        off: float = max(map(abs, (x, y, z, *(self._length * turn for turn in turns))))
        wanted = min(1.0, max(MIN_COMMAND_FACTOR, 1.0 - (off - scale) / (4.0 * scale)))
        return min(max(wanted, self._share - period / SLOWED), self._share + period / HASTENED)

    def _toward(self, state: RobotState, command: PoseCommand, period: float) -> IkAnswer:
        """Compute joint speeds towards a pose that decelerate to rest there."""
        settings = self._settings
        error = _error(command.pose, self._model.pose(state.position), BASE)
        linear = _approach(
            error[:3], settings.approach, command.linear_speed, settings.linear_deceleration
        )
        angular = _approach(
            error[3:], settings.approach, command.angular_speed, settings.angular_deceleration
        )
        twist = np.concatenate((linear, angular))
        return self._ik.cartesian(state, TwistTask(twist, BASE, ~self._drift, self._drift), period)


class Jog(Controller):
    """Executes the latest jog command; brings the arm to rest when it expires."""

    source = Source.JOG

    def __init__(
        self, model: RobotModel, generator: OnlineTrajectoryGenerator, settings: ServoSettings
    ) -> None:
        self._servo = ServoSource(model, settings)
        self._generator, self._limits = generator, model.limits
        self._command: Command | None = None
        self._fresh_until = 0.0
        self._slowing_since: float | None = None
        self._slowed: Command | None = None
        self._solved: Command | None = None  # of which there are joint speeds
        self._velocity: Array = np.zeros(len(model))
        self._due = 0.0
        self.client: Hashable = None  # who sent the command

    def begin(self) -> None:
        """Start jogging with no held axes."""
        self._servo.reset()
        self._command = self._solved = self.outcome = None

    def take(self, command: Command, fresh_until: float, client: Hashable) -> None:
        """Set the command, which expires at ``fresh_until``."""
        if self._command is None or not _equal(command, self._command):
            self._command = command
        self._fresh_until, self.client = fresh_until, client
        self._slowing_since = None

    def update(self, arm: ArmState, period: float) -> RobotState | None:
        """Return the next state; None to come to rest."""
        state, command = arm.commanded, self._command
        if arm.is_held or self._stops(arm):
            command = self._slowing(state, arm.now)
        if command is None:
            self._servo.reset()
            self._solved, self.report = None, MotionReport()
            return None
        cycles = max(1, round(SOLVE_PERIOD / period))
        if cycles == 1 or command is not self._solved or arm.now > self._due - 0.5 * period:
            answer = self._servo.step(state, command, cycles * period)
            self._velocity, self.report = answer.velocity, answer.report
            self._solved, self._due = command, arm.now + cycles * period
        return self._generator.step(state, self._velocity, period)

    def conclude(self, arm: ArmState, state: RobotState) -> bool:
        """End when the arm rests without a fresh command; return whether the jog has ended."""
        return self._stops(arm) and not state.moving

    def _stops(self, arm: ArmState) -> bool:
        return arm.is_paused or arm.now > self._fresh_until

    def _slowing(self, state: RobotState, now: float) -> Command | None:
        """Return a zero twist that slows an expired jog along its line; None when near rest."""
        calm = np.all(np.abs(state.velocity) < REST_SPEED_FACTOR * self._limits.velocity)
        if calm or not isinstance(self._command, TwistCommand):
            return None
        if self._slowing_since is None:
            self._slowing_since = now
            self._slowed = replace(self._command, twist=np.zeros(6))
        return self._slowed if now - self._slowing_since <= MAX_SLOW_DOWN_TIME else None


def _equal(one: Command, other: Command) -> bool:
    """Return whether a command equals another; a pose never counts as equal."""
    match one, other:
        case JointCommand(), JointCommand():
            same = np.array_equal(one.commanded, other.commanded)
            return same and np.array_equal(one.velocity, other.velocity)
        case TwistCommand(axes=None), TwistCommand(axes=None):
            return one.link == other.link and np.array_equal(one.twist, other.twist)
    return False


def _approach(error: Array, gain: float, fastest: float, deceleration: float) -> Array:
    """Return a velocity towards a point: constant, then braking, then proportional."""
    distance = float(np.linalg.norm(error))
    if distance == 0.0:
        return error
    speed = min(fastest, gain * distance, np.sqrt(deceleration * distance))
    approach: Array = error * (speed / distance)
    return approach


def _error(wanted: Pose, actual: Pose, axes: Array) -> Array:
    """Return the twist (6) along ``axes`` that leads from one pose to another in unit time."""
    angular = pin.log3(wanted.rotation @ actual.rotation.T)
    return np.concatenate((axes.T @ (wanted.position - actual.position), axes.T @ angular))


def _moved(pose: Pose, axes: Array, twist: Array) -> Pose:
    """Return a pose moved by a twist along ``axes`` for unit time."""
    return Pose(pin.exp3(axes @ twist[3:]) @ pose.rotation, pose.position + axes @ twist[:3])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The servo's parameters, with moveit_servo's names, and conversion of messages to requests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np
from rclpy.node import Node

from arm_model import (
    Array,
    checked,
    CommandError,
    JointLimits,
    ModelError,
    Pose,
    RobotModel,
    rotation_of,
)
from arm_model.ros import TfListener, xyz, xyzw
from node_runner import ParameterReader
from robot_primitives import setting, switch

from ..controllers.jog import JointCommand, PoseCommand, ServoSettings, TwistCommand
from ..controllers.velocity_ik import IkSettings, VelocityBoundsSettings
from ..core.requests import by_joint, DisplacementRequest, JogRequest

PREFIX = 'moveit_servo.'

DEFAULT_LINEAR_SPEED, DEFAULT_ANGULAR_SPEED = 0.4, 0.8
"""Default scales of tool speed in [m/s] and [rad/s]."""


CLEARANCE_FACTOR = 0.5
"""Clearance of a stop, as a share of the distance to links at which jogs come to rest."""


class Units(Enum):
    """Units of the numbers in commands."""

    UNITLESS = 'unitless'
    SPEED = 'speed_units'


@dataclass(frozen=True, slots=True)
class Scales:
    """Scales that convert command values to speeds; may change while the servo runs."""

    units: Units  # what the numbers are
    # 0 is no cap
    linear: float = setting(
        DEFAULT_LINEAR_SPEED, 0.0, 10.0, 'speed of the tool at 1, cap in speed units [m/s]'
    )
    rotational: float = setting(
        DEFAULT_ANGULAR_SPEED, 0.0, 20.0, 'angular speed at 1, cap in speed units [rad/s]'
    )
    joint: float = setting(0.5, 0.0, 20.0, 'speed of a joint at 1 [rad/s]')
    override: float = 1.0  # factor of all commands, 0 to 1


@dataclass(frozen=True, slots=True)
class ServoParameters:
    """Parameters of the servo."""

    # least distance between links that a jog may bring about in [m]; None is any
    clearance: float | None
    settings: ServoSettings  # how the core jogs
    incoming_command_timeout: float = setting(
        0.1, 0.01, 10.0, 'age of a command at which the arm comes to rest [s]'
    )
    apply_twist_commands_about_ee_frame: bool = switch(
        True, "twists turn about the tip; else about the origin of the command's frame"
    )
    robot_link_command_frame: str = switch(
        '', 'frame of commands without one; empty is the base link'
    )
    cartesian_command_in_topic: str = switch('~/delta_twist_cmds', 'topic of twists')
    joint_command_in_topic: str = switch('~/delta_joint_cmds', 'topic of joint jogs')
    pose_command_in_topic: str = switch('~/pose_target_cmds', 'topic of poses')
    status_topic: str = switch('~/status', 'topic of the status')
    status_rate: float = setting(25.0, 1.0, 500.0, 'rate of the status [Hz]')
    frame_prefix: str = switch('', 'what robot_state_publisher puts before frames in TF')


def declare_servo(node: Node, model: RobotModel) -> ServoParameters:
    """Declare the parameters of the servo.

    Raises:
        ModelError: move_group_name is another group, command_in_type is unknown, or a margin does
            not fit the joints.
    """
    read, group = ParameterReader(node, PREFIX), model.group
    named = read.text('move_group_name', group, 'group of the SRDF that is moved')
    if named != group:
        raise ModelError(f'{PREFIX}move_group_name is {named!r}, but the group is {group!r}')
    _declare_scales(node)
    read_scales(node)
    checks = read.flag('check_collisions', 'jogs brake in front of other links', default=True)
    brakes = VelocityBoundsSettings()
    threshold = read.number(
        'self_collision_proximity_threshold',
        brakes.margin,
        (0.001, 0.1),
        'distance at which jogs come to rest in front of other links [m]',
    )
    brakes = replace(
        brakes,
        margin=threshold,
        pairs=brakes.pairs if checks else 0,
        joint_margins=_joint_margins(read, model.limits),
    )
    return read.settings(
        ServoParameters,
        clearance=CLEARANCE_FACTOR * threshold if checks else None,
        settings=ServoSettings(ik=IkSettings(brakes=brakes)),
    )


def _joint_margins(read: ParameterReader, limits: JointLimits) -> tuple[float, ...]:
    """Read the margins of jogs to the joint limits: Jazzy's list, or Humble's number."""
    meaning = 'distance from the position limits at which jogs come to rest [rad]'
    one = read.number('joint_limit_margin', 0.0, (0.0, 10.0), f'{meaning}, of all joints')
    margins = read.numbers('joint_limit_margins', f'{meaning}: one for all, or one each') or (one,)
    name = f'{PREFIX}joint_limit_margins'
    if len(margins) not in {1, len(limits)}:
        raise ModelError(f'{name} has {len(margins)} numbers; give 1, or {len(limits)}')
    room = 0.5 * (limits.upper - limits.lower)
    wrong = (np.array(margins) < 0.0) | (np.array(margins) >= room)
    if wrong.any():
        joint = int(np.argmax(wrong))
        raise ModelError(
            f'{name} of {limits.names[joint]}: it must be 0 or more, and less than'
            f' {room[joint]:.3f}'
        )
    return margins


def read_scales(node: Node) -> Scales:
    """Return the current scales.

    Raises:
        ModelError: command_in_type is unknown.
    """
    units = str(node.get_parameter(f'{PREFIX}command_in_type').value)
    if units not in {unit.value for unit in Units}:
        known = ' or '.join(unit.value for unit in Units)
        raise ModelError(f'{PREFIX}command_in_type is {units!r}; it must be {known}')
    names = ('scale.linear', 'scale.rotational', 'scale.joint', 'override_velocity_scaling_factor')
    linear, rotational, joint, override = (
        float(node.get_parameter(PREFIX + name).value) for name in names
    )
    # as in moveit_servo, an override of less than a hundredth is none
    return Scales(Units(units), linear, rotational, joint, override if override >= 0.01 else 1.0)


def _declare_scales(node: Node) -> None:
    live = ParameterReader(node, PREFIX, fixed=False)
    live.text('command_in_type', Units.UNITLESS.value, 'unitless (-1 to 1) or speed_units')
    live.settings(Scales, 'scale.', units=Units.UNITLESS)
    live.number('override_velocity_scaling_factor', 0.0, (0.0, 1.0), 'factor; 0 is none')


MAX_DURATION = 60.0  # longest duration of a joint jog in [s]


class CommandConverter:
    """Converts messages to requests; raises an error for an invalid message.

    A request expires some time after its message was sent; both are steady times in [s].
    """

    def __init__(
        self, model: RobotModel, frames: TfListener, parameters: ServoParameters, scales: Scales
    ) -> None:
        self.scales = scales
        self.capped = ''  # how the last command was capped, as text; empty if it was not
        self._model = model
        self._frames = frames
        self._parameters = parameters

    def twist(self, message: Any, sent: float) -> JogRequest:  # noqa: ANN401  # messages have no type
        """Convert a TwistStamped to a request.

        Raises:
            CommandError: A number is not finite, or the frame is unknown.
        """
        twist = np.concatenate((xyz(message.twist.linear), xyz(message.twist.angular)))
        twist = self._scaled(checked(twist, 6, 'twist'))
        expires = sent + self._parameters.incoming_command_timeout
        frame = message.header.frame_id or self._parameters.robot_link_command_frame
        link, axes, about = None, None, None
        if frame and not self._parameters.apply_twist_commands_about_ee_frame:
            about = self._place(frame)
        elif frame and (named := self._frames.link(frame)):
            link = None if named == self._model.base else named
        elif frame:
            axes = self._frames.pose(frame).rotation
        return JogRequest(TwistCommand(twist, link, axes), expires, about)

    def jog(self, message: Any, sent: float) -> JogRequest | DisplacementRequest:  # noqa: ANN401
        """Convert a JointJog to a request: speeds for a duration, or displacements.

        Raises:
            CommandError: Lengths differ, a number is not finite, or both or neither are given.
        """
        names = list(message.joint_names)
        if len(set(names)) < len(names):
            raise CommandError(f'a joint is named twice: {", ".join(names)}')
        if bool(message.velocities) == bool(message.displacements):
            raise CommandError('give either velocities or displacements, one for each joint')
        if message.displacements:
            ways = _by_name(names, message.displacements, 'displacements')
            by_joint(self._model, ways, 'displacements')  # none spoils those that it adds to
            self.capped = ''
            return DisplacementRequest(ways, self.scales.joint * self.scales.override)
        if not 0.0 <= message.duration <= MAX_DURATION:
            raise CommandError(
                f'duration {message.duration} s: 0 (the time-out) to {MAX_DURATION:g}'
            )
        speeds = _by_name(names, message.velocities, 'velocities')
        factor = self.scales.override
        if self.scales.units is Units.UNITLESS:
            self.capped = (
                'velocities were cut to 1' if max(map(abs, speeds.values())) > 1.0 else ''
            )
            factor *= self.scales.joint
            speeds = {name: min(max(speed, -1.0), 1.0) for name, speed in speeds.items()}
        speeds = {name: factor * speed for name, speed in speeds.items()}
        command = JointCommand(*by_joint(self._model, speeds, 'velocities'))
        return JogRequest(
            command, sent + (message.duration or self._parameters.incoming_command_timeout)
        )

    def pose(self, message: Any, sent: float) -> JogRequest:  # noqa: ANN401
        """Convert a PoseStamped to a request.

        Raises:
            CommandError: A number is not finite, the quaternion invalid or the frame unknown.
        """
        position = checked(xyz(message.pose.position), 3, 'position')
        goal = Pose(rotation_of(xyzw(message.pose.orientation)), position)
        frame = message.header.frame_id or self._parameters.robot_link_command_frame
        self.capped = ''
        scales = self.scales
        command = PoseCommand(
            goal,
            scales.override * (scales.linear or DEFAULT_LINEAR_SPEED),
            scales.override * (scales.rotational or DEFAULT_ANGULAR_SPEED),
        )
        expires = sent + self._parameters.incoming_command_timeout
        return JogRequest(command, expires, self._place(frame) if frame else None)

    def _place(self, frame: str) -> str | Pose:
        """Return a link name for a frame that moves with the arm, else the pose of the frame."""
        return self._frames.link(frame) or self._frames.pose(frame)

    def _scaled(self, twist: Array) -> Array:
        """Return a twist in [m/s] and [rad/s]; store in ``capped`` what the caps cut off."""
        scales = self.scales
        most = np.array([scales.linear, scales.rotational])
        if scales.units is Units.UNITLESS:
            cut = np.clip(twist, -1.0, 1.0)
            self.capped = 'the twist was cut to 1 per axis' if np.any(cut != twist) else ''
            return scales.override * np.repeat(most, 3) * cut
        norms = np.linalg.norm(twist.reshape(2, 3), axis=1)
        over = np.where(most > 0.0, norms / np.maximum(most, 1e-9), 0.0).max()
        self.capped = f'the twist was cut to {1.0 / over:.2f}x by scale' if over > 1.0 else ''
        capped: Array = scales.override * twist / max(1.0, float(over))
        return capped


def _by_name(names: list[str], values: Any, what: str) -> Mapping[str, float]:  # noqa: ANN401
    if len(names) != len(values):
        raise CommandError(f'{len(names)} joint_names, but {len(values)} {what}')
    return dict(zip(names, checked(list(values), len(names), what).tolist(), strict=True))

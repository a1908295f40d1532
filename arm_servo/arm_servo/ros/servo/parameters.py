# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the servo, under moveit_servo's names."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from rclpy.node import Node

from arm_model import JointLimits, ModelError, RobotModel
from node_runner import ParameterReader

from ...controllers.jog import ServoSettings
from ...jog.velocity_bounds import VelocityBoundsSettings
from ...jog.velocity_ik import IkSettings

PREFIX = 'moveit_servo.'

DEFAULT_LINEAR_SPEED, DEFAULT_ANGULAR_SPEED = 0.4, 0.8
"""Scales of the tool's speeds in [m/s] and [rad/s]."""


CLEARANCE_FACTOR = 0.5
"""Share of the distance at which jogs come to rest in front of links that a stop may use up."""


class Units(Enum):
    """What the numbers of commands are."""

    UNITLESS = 'unitless'
    SPEED = 'speed_units'


@dataclass(frozen=True, slots=True)
class Scales:
    """How numbers of commands become speeds; may be changed while the servo runs."""

    units: Units  # what the numbers are
    linear: float  # factor, or cap with speed units, of the tool's speed in [m/s]; 0 is no cap
    rotational: float  # the same of its angular speed in [rad/s]
    joint: float  # factor of joint speeds in [rad/s]
    override: float  # factor of all commands, 0 to 1


@dataclass(frozen=True, slots=True)
class ServoParameters:
    """How the servo behaves."""

    timeout: float  # age at which a command counts no more in [s]
    about_tip: bool  # twists of other frames turn about the tip; else about the frame's origin
    default_frame: str  # frame of commands without one; empty is the base
    twist_topic: str  # topic of twists
    joint_topic: str  # topic of joint jogs
    pose_topic: str  # topic of poses
    status_topic: str  # topic of the status
    status_rate: float  # its rate in [Hz]
    # least distance between links that a jog may bring about in [m]; None is any
    clearance: float | None
    settings: ServoSettings  # how the core jogs
    frame_prefix: str = ''  # before the names of the robot's links in TF


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
    return ServoParameters(
        read.number(
            'incoming_command_timeout',
            0.1,
            (0.01, 10.0),
            'age of a command at which the arm comes to rest [s]',
        ),
        read.flag(
            'apply_twist_commands_about_ee_frame',
            "twists turn about the tip; else about the origin of the command's frame",
            default=True,
        ),
        read.text(
            'robot_link_command_frame', '', 'frame of commands without one; empty is the base link'
        ),
        read.text('cartesian_command_in_topic', '~/delta_twist_cmds', 'topic of twists'),
        read.text('joint_command_in_topic', '~/delta_joint_cmds', 'topic of joint jogs'),
        read.text('pose_command_in_topic', '~/pose_target_cmds', 'topic of poses'),
        read.text('status_topic', '~/status', 'topic of the status'),
        read.number('status_rate', 25.0, (1.0, 500.0), 'rate of the status [Hz]'),
        CLEARANCE_FACTOR * threshold if checks else None,
        ServoSettings(ik=IkSettings(brakes=brakes)),
        read.text('frame_prefix', '', 'what robot_state_publisher puts before frames in TF'),
    )


def _joint_margins(read: ParameterReader, limits: JointLimits) -> tuple[float, ...]:
    """Read how far from the limits of the joints jogs come to rest: Jazzy's list, or Humble's."""
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
    """Return the scales as they are set now.

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
    live.number(
        'scale.linear',
        DEFAULT_LINEAR_SPEED,
        (0.0, 10.0),
        'speed of the tool at 1, cap in speed units [m/s]',
    )
    live.number(
        'scale.rotational',
        DEFAULT_ANGULAR_SPEED,
        (0.0, 20.0),
        'angular speed at 1, cap in speed units [rad/s]',
    )
    live.number('scale.joint', 0.5, (0.0, 20.0), 'speed of a joint at 1 [rad/s]')
    live.number('override_velocity_scaling_factor', 0.0, (0.0, 1.0), 'factor; 0 is none')

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the servo's topics as commands for the core."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..arrays import Array, checked
from ..core import MotionCore
from ..exceptions import CommandError
from ..model import Pose
from .frame_tree import combined, rotation_of
from .ros_numbers import xyz, xyzw
from .servo_parameters import Scales, ServoParameters, Units

Order = Callable[[MotionCore, float], None]


@dataclass(frozen=True, slots=True)
class Displacements:
    """An order to move joints on.

    Attributes:
        by_joint: How far in [rad] by joint.
        fastest: Greatest speed of a joint in [rad/s].
    """

    by_joint: Mapping[str, float]
    fastest: float


LONGEST = 60.0
"""Longest duration of a joint jog in [s]."""


class Frames(Protocol):
    """Frames of commands: links of the robot, or others whose pose is known."""

    def is_link(self, frame: str) -> bool:
        """Tell whether a frame is a link of the robot."""

    def pose(self, frame: str) -> Pose:
        """Return the pose of a frame that is no link in the base; raises CommandError."""


class ServoOrders:
    """Makes commands of messages; what is wrong with one is raised before anything moves.

    Attributes:
        scales: How numbers become speeds.
        capped: What was cut off the last command, in words; empty when nothing was.
    """

    def __init__(self, frames: Frames, parameters: ServoParameters, scales: Scales) -> None:
        """Prepare.

        Args:
            frames: Frames of commands.
            parameters: How the servo behaves.
            scales: How numbers become speeds.
        """
        self.scales = scales
        self.capped = ''
        self._frames = frames
        self._parameters = parameters

    def twist(self, message: Any) -> Order:  # noqa: ANN401  # message classes have no type
        """Return the command of a TwistStamped.

        Raises:
            CommandError: A number is not finite, or the frame is unknown.
        """
        twist = np.concatenate((xyz(message.twist.linear), xyz(message.twist.angular)))
        twist = self._scaled(checked(twist, 6, 'twist'))
        frame = message.header.frame_id or self._parameters.default_frame
        if not frame:
            return lambda core, now: core.twist(twist, now)
        if not self._parameters.about_tip:
            place = self._place(frame)
            return lambda core, now: core.twist(_about(core, place(core), twist), now)
        if self._frames.is_link(frame):
            return lambda core, now: core.twist(
                twist, now, link=None if frame == core.model.base else frame
            )
        axes = self._frames.pose(frame).rotation
        return lambda core, now: core.twist(twist, now, axes=axes)

    def jog(self, message: Any) -> Order | Displacements:  # noqa: ANN401
        """Return the command of a JointJog: speeds for a duration, or displacements.

        Raises:
            CommandError: Lengths differ, a number is not finite, or it has both or neither.
        """
        names = list(message.joint_names)
        if len(set(names)) < len(names):
            raise CommandError(f'a joint is named twice: {", ".join(names)}')
        if bool(message.velocities) == bool(message.displacements):
            raise CommandError('give either velocities or displacements, one for each joint')
        if message.displacements:
            ways = _by_name(names, message.displacements, 'displacements')
            self.capped = ''
            return Displacements(ways, self.scales.joint * self.scales.override)
        if not 0.0 <= message.duration <= LONGEST:
            raise CommandError(f'duration {message.duration} s: 0 (the time-out) to {LONGEST:g}')
        speeds = _by_name(names, message.velocities, 'velocities')
        factor = self.scales.override
        if self.scales.units is Units.UNITLESS:
            self.capped = (
                'velocities were cut to 1' if max(map(abs, speeds.values())) > 1.0 else ''
            )
            factor *= self.scales.joint
            speeds = {name: min(max(speed, -1.0), 1.0) for name, speed in speeds.items()}
        speeds = {name: factor * speed for name, speed in speeds.items()}
        duration = message.duration or None
        return lambda core, now: core.jog(speeds, now, duration)

    def pose(self, message: Any) -> Order:  # noqa: ANN401
        """Return the command of a PoseStamped.

        Raises:
            CommandError: A number is not finite, the quaternion is none, or the frame is unknown.
        """
        position = checked(xyz(message.pose.position), 3, 'position')
        goal = Pose(rotation_of(xyzw(message.pose.orientation)), position)
        frame = message.header.frame_id or self._parameters.default_frame
        self.capped = ''
        if not frame:
            return lambda core, now: core.track(goal, now)
        place = self._place(frame)
        return lambda core, now: core.track(combined(place(core), goal), now)

    def _place(self, frame: str) -> Callable[[MotionCore], Pose]:
        """Return what tells the pose of a frame in the base."""
        if self._frames.is_link(frame):
            return lambda core: core.model.pose(core.state.position, frame)
        pose = self._frames.pose(frame)
        return lambda _core: pose

    def _scaled(self, twist: Array) -> Array:
        """Return a twist in [m/s] and [rad/s]; what is cut off is told."""
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


def _about(core: MotionCore, place: Pose, twist: Array) -> Array:
    """Return the tip's twist in the base when the twist turns about the origin of a frame."""
    linear, angular = place.rotation @ twist[:3], place.rotation @ twist[3:]
    arm = core.model.pose(core.state.position).position - place.position
    return np.concatenate((linear + np.cross(angular, arm), angular))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages of the servo's topics as requests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from arm_model import Array, checked, CommandError, Pose, RobotModel, rotation_of
from arm_model.ros import xyz, xyzw

from ...controllers.jog import JointCommand, PoseCommand, TwistCommand
from ...core.requests import by_joint, DisplacementRequest, JogRequest
from .parameters import DEFAULT_ANGULAR_SPEED, DEFAULT_LINEAR_SPEED, Scales, ServoParameters, Units

MAX_DURATION = 60.0  # longest duration of a joint jog in [s]


class Frames(Protocol):
    """Frames of commands: links of the robot, or others whose pose is known."""

    def link(self, frame: str) -> str | None:
        """Return the link of the robot that a frame is; None for another frame."""

    def pose(self, frame: str) -> Pose:
        """Return the pose of a frame that is no link in the base; raises CommandError."""


class CommandConverter:
    """Makes requests of messages; what is wrong with one is raised before anything moves.

    A request expires some time after its message was sent; both are steady times in [s].

    Attributes:
        capped: What was cut off the last command, in words; empty when nothing was.
    """

    def __init__(
        self, model: RobotModel, frames: Frames, parameters: ServoParameters, scales: Scales
    ) -> None:
        """Prepare.

        Args:
            model: The arm; only its names are used.
        """
        self.scales = scales
        self.capped = ''
        self._model = model
        self._frames = frames
        self._parameters = parameters

    def twist(self, message: Any, sent: float) -> JogRequest:  # noqa: ANN401  # messages have no type
        """Return the request of a TwistStamped.

        Raises:
            CommandError: A number is not finite, or the frame is unknown.
        """
        twist = np.concatenate((xyz(message.twist.linear), xyz(message.twist.angular)))
        twist = self._scaled(checked(twist, 6, 'twist'))
        expires = sent + self._parameters.timeout
        frame = message.header.frame_id or self._parameters.default_frame
        link, axes, about = None, None, None
        if frame and not self._parameters.about_tip:
            about = self._place(frame)
        elif frame and (named := self._frames.link(frame)):
            link = None if named == self._model.base else named
        elif frame:
            axes = self._frames.pose(frame).rotation
        return JogRequest(TwistCommand(twist, link, axes), expires, about)

    def jog(self, message: Any, sent: float) -> JogRequest | DisplacementRequest:  # noqa: ANN401
        """Return the request of a JointJog: speeds for a duration, or displacements.

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
        return JogRequest(command, sent + (message.duration or self._parameters.timeout))

    def pose(self, message: Any, sent: float) -> JogRequest:  # noqa: ANN401
        """Return the request of a PoseStamped.

        Raises:
            CommandError: A number is not finite, the quaternion is none, or the frame is unknown.
        """
        position = checked(xyz(message.pose.position), 3, 'position')
        goal = Pose(rotation_of(xyzw(message.pose.orientation)), position)
        frame = message.header.frame_id or self._parameters.default_frame
        self.capped = ''
        scales = self.scales
        command = PoseCommand(
            goal,
            scales.override * (scales.linear or DEFAULT_LINEAR_SPEED),
            scales.override * (scales.rotational or DEFAULT_ANGULAR_SPEED),
        )
        expires = sent + self._parameters.timeout
        return JogRequest(command, expires, self._place(frame) if frame else None)

    def _place(self, frame: str) -> str | Pose:
        """Return a link, whose pose changes with the arm, or the pose of another frame."""
        return self._frames.link(frame) or self._frames.pose(frame)

    def _scaled(self, twist: Array) -> Array:
        """Return a twist in [m/s] and [rad/s]; what is cut off is in ``capped``."""
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

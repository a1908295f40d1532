# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging with a gamepad: from its state to motions. Pure; time is handed in."""

from __future__ import annotations

from operator_input import CommandStream
from operator_input.gamepad import Axis, Button, Deadman, DeadmanTeleop, GamepadState, Grip

from .jog import CartesianJog, Frame, Jog, JointJog

FRAME_BUTTONS = {Button.SELECT: Frame.BASE, Button.START: Frame.TOOL}
"""Buttons that choose along whose axes the tool is jogged."""

JOINT_BUTTONS = {Button.WEST: -1, Button.EAST: 1}
"""Buttons that choose the joint before and the next one."""


class GamepadTeleop(DeadmanTeleop[Jog]):
    """Moves while the deadman is held and a stick is away from rest.

    At rest it asks for nothing, so that it does not overrule a trajectory.

    Attributes:
        frame: Along whose axes the tool is jogged.
        joint: Place of the joint that the d-pad moves.
        joints: How many joints the arm has; None while that is not known.
    """

    def __init__(
        self, speed: float, turbo: float, deadman: Deadman, stream: CommandStream[Jog]
    ) -> None:
        """Start idle.

        Args:
            speed: Share of full speed at the end of a stick's way.
            turbo: The same with the turbo button.
            deadman: Which buttons allow motion.
            stream: Decides when to publish.
        """
        super().__init__(deadman, stream)
        self.frame = Frame.BASE
        self.joint = 0
        self.joints: int | None = None
        self._speeds = {Grip.HELD: speed, Grip.TURBO: turbo}

    def wanted(self) -> Jog | None:
        """Return the motion that is wanted; None without the deadman, and at rest."""
        speed = self._speeds.get(self.grip)
        if speed is None:
            return None
        up = self.state.axis(Axis.DPAD_Y)
        if up:
            return JointJog(self.joint, up * speed)
        jog = direction(self.state, self.frame).scaled(speed, speed)
        return jog if any(jog.linear) or any(jog.angular) else None

    def feed(self, state: GamepadState) -> str:
        """Take a state of the gamepad.

        Args:
            state: At rest when there is none.

        Returns:
            What was chosen, in words; empty for nothing.
        """
        before = self.take(state)
        for button in state.pressed_since(before):
            if button in FRAME_BUTTONS:
                self.frame = FRAME_BUTTONS[button]
                return f'{self.frame.value} frame'
            if button in JOINT_BUTTONS and self.joints:
                self.joint = (self.joint + JOINT_BUTTONS[button]) % self.joints
                return f'the d-pad moves joint {self.joint + 1}'
        return ''


def direction(state: GamepadState, frame: Frame) -> CartesianJog:
    """Return where the sticks point.

    The left stick moves along x and y, the triggers along z (right up, left down); the right stick
    turns about y and z, the d-pad's sides about x.

    Args:
        state: The gamepad.
        frame: Along whose axes.
    """
    z = state.axis(Axis.RIGHT_TRIGGER) - state.axis(Axis.LEFT_TRIGGER)
    return CartesianJog(
        (state.axis(Axis.LEFT_Y), state.axis(Axis.LEFT_X), z),
        (-state.axis(Axis.DPAD_X), state.axis(Axis.RIGHT_Y), state.axis(Axis.RIGHT_X)),
        frame,
    )

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo servo_gamepad``: jog an arm with a gamepad, while the deadman is held."""

from __future__ import annotations

from collections.abc import Callable
import sys

from arm_model import ArmError
from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt
from operator_input import CommandStream, DeadmanMapping
from operator_input.devices import InputDevices
from operator_input.gamepad import Axis, Button, Deadman, GamepadState, Grip
from operator_input.ros import declare_gamepad, run_teleop, TeleopNode

from .jog import CartesianJog, Frame, Jog, JointJog
from .servo_link import ServoLink

FRAME_BUTTONS = {Button.SELECT: Frame.BASE, Button.START: Frame.TOOL}
"""Buttons that select the frame of jogging."""

JOINT_BUTTONS = {Button.WEST: -1, Button.EAST: 1}
"""Buttons that select the previous and the next joint."""


class GamepadTeleop(DeadmanMapping):
    """Converts stick positions to motions while the deadman is held.

    With the sticks at rest it sends no command, so that it does not interrupt a trajectory.
    """

    robot: ServoLink

    def __init__(
        self,
        robot: ServoLink,
        deadman: Deadman,
        stream: CommandStream[Jog],
        speeds: tuple[float, float],
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start idle; ``speeds``: shares of full speed at full stick, without and with turbo."""
        super().__init__(robot, deadman, stream, warn)
        self.frame = Frame.BASE  # along whose axes the tool is jogged
        self.joint = 0  # place of the joint that the d-pad moves
        self._speeds = dict(zip((Grip.HELD, Grip.TURBO), speeds, strict=True))

    def wanted(self, now: float) -> Jog | None:
        """Return the requested motion; None without the deadman or with all sticks at rest."""
        speed = self._speeds.get(self.grip)
        if speed is None:
            return None
        up = self.state.axis(Axis.DPAD_Y)
        if up:
            return JointJog(self.joint, up * speed)
        jog = direction(self.state, self.frame).scaled(speed, speed)
        return jog if any(jog.linear) or any(jog.angular) else None

    def feed(self, state: GamepadState) -> list[str]:
        """Process a gamepad state; return messages about new selections."""
        before, joints = self.take(state), len(self.robot.names.joints)
        for button in state.pressed_since(before):
            if button in FRAME_BUTTONS:
                self.frame = FRAME_BUTTONS[button]
                return [f'{self.frame.value} frame']
            if button in JOINT_BUTTONS and joints:
                self.joint = (self.joint + JOINT_BUTTONS[button]) % joints
                return [f'the d-pad moves joint {self.joint + 1}']
        return []


def direction(state: GamepadState, frame: Frame) -> CartesianJog:
    """Convert stick positions to a motion along the axes of a frame.

    The left stick moves along x and y, the triggers along z (right up, left down); the right stick
    turns about y and z, the d-pad's sides about x.
    """
    z = state.axis(Axis.RIGHT_TRIGGER) - state.axis(Axis.LEFT_TRIGGER)
    return CartesianJog(
        (state.axis(Axis.LEFT_Y), state.axis(Axis.LEFT_X), z),
        (-state.axis(Axis.DPAD_X), state.axis(Axis.RIGHT_Y), state.axis(Axis.RIGHT_X)),
        frame,
    )


class ServoGamepad(TeleopNode):
    """Node that jogs with a gamepad, configured by its parameters.

    Attributes:
        link: The servo.
    """

    @destroyed_when_refused
    def __init__(self, devices: InputDevices | None = None) -> None:
        """Declare the parameters, and connect.

        Raises:
            ParameterError: A parameter is misspelt or invalid.
            PresetError: The preset is unknown.
            SettingError: Parameters are inconsistent.
        """
        super().__init__('servo_gamepad')
        self.source, deadman = declare_gamepad(self, devices)
        self.link, read = ServoLink(self, self.get_logger().info), ParameterReader(self)
        speeds = (
            read.number('speed', 0.3, (0.01, 1.0), "share of the servo's full speed"),
            read.number('turbo_speed', 1.0, (0.01, 1.0), 'the same with the turbo button'),
        )
        warn = self.get_logger().warning
        self.mapping = GamepadTeleop(self.link, deadman, self.link.stream, speeds, warn)
        refuse_misspelt(self)


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_teleop('servo_gamepad', ServoGamepad, ArmError, patient=False)


if __name__ == '__main__':
    sys.exit(main())

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Driving with a gamepad: from its state to velocities and requests. Pure; time is handed in."""

from __future__ import annotations

from operator_input import CommandStream
from operator_input.gamepad import Axis, Button, Deadman, DeadmanTeleop, GamepadState, Grip

from .body_pose import BodyPose, NEUTRAL, PoseSteps
from .modes import Mode
from .requests import ClearFault, ModeRequest, PoseRequest, Request
from .speeds import Speeds
from .velocity import Direction, Velocity, ZERO

MODE_BUTTONS = {
    Button.SOUTH: Mode.STAND,
    Button.EAST: Mode.LIE,
    Button.WEST: Mode.WALK,
    Button.NORTH: Mode.TURN,
    Button.RIGHT_STICK: Mode.GET_UP,
}
"""Buttons that ask the controller for a mode."""

NEUTRAL_BUTTON, CLEAR_BUTTON = Button.START, Button.SELECT


class GamepadTeleop(DeadmanTeleop[Velocity]):
    """Moves while the deadman is held.

    Attributes:
        pose: The pose of the body that was requested last.
    """

    def __init__(
        self,
        normal: Speeds,
        turbo: Speeds,
        deadman: Deadman,
        steps: PoseSteps,
        stream: CommandStream[Velocity],
    ) -> None:
        """Start idle.

        Args:
            normal: Speeds at the end of a stick's way.
            turbo: The same with the turbo button.
            deadman: Which buttons allow motion.
            steps: How far a press of the d-pad tilts and lifts the body.
            stream: Decides when to publish.
        """
        super().__init__(deadman, stream)
        self.pose = NEUTRAL
        self._speeds = {Grip.HELD: normal, Grip.TURBO: turbo}
        self._steps = steps

    def wanted(self) -> Velocity | None:
        """Return the velocity that is wanted; None without the deadman.

        Without a deadman button, a gamepad at rest requests nothing.
        """
        speeds = self._speeds.get(self.grip)
        if speeds is None:
            return None
        velocity = direction(self.state).at(speeds.linear, speeds.angular)
        return None if velocity == ZERO and self._deadman.enable is None else velocity

    def feed(self, state: GamepadState) -> list[Request]:
        """Take a state of the gamepad.

        Args:
            state: At rest when there is none.

        Returns:
            What the person requests besides a velocity. Whatever makes the robot move needs the
            deadman, as walking does; lying down and clearing a fault, which moves nothing, need
            none.
        """
        before = self.take(state)
        allowed = self.grip is not Grip.RELEASED
        requests: list[Request] = []
        for button in state.pressed_since(before):
            mode = MODE_BUTTONS.get(button)
            if mode is not None and (allowed or mode is Mode.LIE):
                requests.append(ModeRequest(mode))
            elif button is CLEAR_BUTTON:
                requests.append(ClearFault())
            elif button is NEUTRAL_BUTTON and allowed:
                self.pose = NEUTRAL
                requests.append(PoseRequest(self.pose))
        return requests + (self._tilt(before, state) if allowed else [])

    def _tilt(self, before: GamepadState, state: GamepadState) -> list[Request]:
        way = BodyPose(
            height=_pressed(Axis.DPAD_Y, before, state),
            roll=-_pressed(Axis.DPAD_X, before, state),
        )
        pose = self._steps.moved(self.pose, way)
        if pose == self.pose:
            return []
        self.pose = pose
        return [PoseRequest(pose)]


def direction(state: GamepadState) -> Direction:
    """Return where the sticks point: the left one walks, the right one turns.

    Args:
        state: The gamepad.
    """
    return Direction(
        x=state.axis(Axis.LEFT_Y), y=state.axis(Axis.LEFT_X), yaw=state.axis(Axis.RIGHT_X)
    )


def _pressed(axis: Axis, before: GamepadState, state: GamepadState) -> float:
    """Return the side of a d-pad that went down, 0 for none."""
    return state.axis(axis) if state.axis(axis) != before.axis(axis) else 0.0

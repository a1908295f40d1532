# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Driving with a gamepad: from its state to velocities and requests. Pure; times are in [s]."""

from __future__ import annotations

from collections.abc import Callable

from operator_input import CommandStream, DeadmanMapping, Robot
from operator_input.gamepad import Axis, Button, Deadman, GamepadState, Grip

from .motion import (
    BodyPose,
    Mode,
    NEUTRAL,
    PoseSteps,
    RobotRequest,
    Speeds,
    Velocity,
    ZERO,
)

MODE_BUTTONS = {
    Button.SOUTH: Mode.STAND,
    Button.EAST: Mode.LIE,
    Button.WEST: Mode.WALK,
    Button.NORTH: Mode.TURN,
    Button.RIGHT_STICK: Mode.GET_UP,
}
"""Buttons that ask the controller for a mode."""

NEUTRAL_BUTTON, CLEAR_BUTTON = Button.START, Button.SELECT


class GamepadTeleop(DeadmanMapping):
    """Moves while the deadman is held: the left stick walks, the right one turns.

    Attributes:
        pose: The pose of the body that was requested last.
    """

    def __init__(
        self,
        robot: Robot,
        deadman: Deadman,
        stream: CommandStream[Velocity],
        normal: Speeds,
        turbo: Speeds,
        *,
        steps: PoseSteps,
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start idle, with the speeds at the end of a stick's way, and the steps of the d-pad."""
        super().__init__(robot, deadman, stream, warn)
        self.pose = NEUTRAL
        self._speeds = {Grip.HELD: normal, Grip.TURBO: turbo}
        self._steps = steps

    def wanted(self, now: float) -> Velocity | None:
        """Return the velocity that is wanted; None without the deadman.

        Without a deadman button, a gamepad at rest requests nothing.
        """
        speeds = self._speeds.get(self.grip)
        if speeds is None:
            return None
        axis = self.state.axis
        velocity = Velocity(axis(Axis.LEFT_Y), axis(Axis.LEFT_X), axis(Axis.RIGHT_X)).at(speeds)
        return None if velocity == ZERO and self._deadman.enable is None else velocity

    def feed(self, state: GamepadState) -> list[Mode | BodyPose | RobotRequest]:
        """Apply a state of the gamepad; return what the person requests besides a velocity.

        Whatever makes the robot move needs the deadman, as walking does; lying down and clearing a
        fault, which moves nothing, need none.
        """
        before = self.take(state)
        allowed = self.grip is not Grip.RELEASED
        requests: list[Mode | BodyPose | RobotRequest] = []
        for button in state.pressed_since(before):
            mode = MODE_BUTTONS.get(button)
            if mode is not None and (allowed or mode is Mode.LIE):
                requests.append(mode)
            elif button is CLEAR_BUTTON:
                requests.append(RobotRequest.CLEAR_FAULT)
            elif button is NEUTRAL_BUTTON and allowed:
                self.pose = NEUTRAL
                requests.append(NEUTRAL)
        pose = self._steps.moved(self.pose, _tilt(before, state))
        if allowed and pose != self.pose:
            self.pose = pose
            requests.append(pose)
        return requests


def _tilt(before: GamepadState, state: GamepadState) -> BodyPose:
    """Return the steps of the sides of the d-pad that went down."""

    def pressed(axis: Axis) -> float:
        return state.axis(axis) if state.axis(axis) != before.axis(axis) else 0.0

    return BodyPose(height=pressed(Axis.DPAD_Y), roll=-pressed(Axis.DPAD_X))

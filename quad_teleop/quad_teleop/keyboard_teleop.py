# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Driving with keys: from key events to velocities and requests. Pure; time is handed in."""

from __future__ import annotations

from operator_input import CommandStream, HeldKeys, KeyAction, KeyEvent, Note, Quit, Suspend

from .body_pose import BodyPose, NEUTRAL, PoseSteps
from .key_map import (
    CLEAR_KEY,
    HELP,
    HELP_KEY,
    MODES,
    MOVES,
    NEUTRAL_KEYS,
    POSES,
    QUIT_KEYS,
    ROBOT_STOP_KEY,
    SPEEDS,
    STOP_KEYS,
    SUSPEND_KEY,
)
from .requests import ClearFault, ModeRequest, PoseRequest, Request, StopRobot
from .speeds import Speeds
from .velocity import Velocity


class KeyboardTeleop:
    """Moves while a key of the map is held, and stops when it is not.

    Attributes:
        speeds: The speeds that are set.
        pose: The pose of the body that was requested last.
    """

    def __init__(
        self, speeds: Speeds, steps: PoseSteps, held: HeldKeys, stream: CommandStream[Velocity]
    ) -> None:
        """Start idle.

        Args:
            speeds: The speeds at the start.
            steps: How far a key tilts and lifts the body.
            held: Decides which key is held.
            stream: Decides when to publish.
        """
        self.speeds = speeds
        self.pose = NEUTRAL
        self._steps = steps
        self._held = held
        self._stream = stream

    def wanted(self, now: float) -> Velocity | None:
        """Return the velocity that is wanted; None when no key requests one.

        Args:
            now: Time [s].
        """
        key = self._held.current(now)
        if key is None:
            return None
        return MOVES[key].at(self.speeds.linear, self.speeds.angular)

    def step(self, now: float) -> Velocity | None:
        """Return what to publish now; call it after every event and when it is due.

        Args:
            now: Time [s].
        """
        return self._stream.step(self.wanted(now), now)

    def due(self, now: float) -> float:
        """Return when step() has to be called at the latest [s]; may be infinite.

        Args:
            now: Time [s].
        """
        return min(self._held.deadline(now), self._stream.due())

    def end(self) -> None:
        """Let go of everything at the end of the program."""
        self._held.clear()
        self._stream.end()

    def feed(self, event: KeyEvent) -> list[Request]:
        """Take an event.

        Args:
            event: What happened to a key.

        Returns:
            What the person requests besides a velocity.
        """
        if event.key in MOVES or not event.is_stroke:
            self._held.feed(event)
            return []
        if event.key in SPEEDS:
            return self._change_speeds(*SPEEDS[event.key])
        if event.key in POSES:
            return self._move_body(self._steps.moved(self.pose, POSES[event.key]))
        if event.action is KeyAction.REPEATED:
            return []
        return self._stroke(event.key)

    def _stroke(self, key: str) -> list[Request]:
        if key in MODES:
            mode = MODES[key]
            if not mode.moves:
                self._held.clear()
            return [ModeRequest(mode)]
        if key in NEUTRAL_KEYS:
            return self._move_body(NEUTRAL)
        if key == HELP_KEY:
            return [Note(HELP)]
        self._held.clear()
        if key == CLEAR_KEY:
            return [ClearFault()]
        if key in QUIT_KEYS:
            return [Quit()]
        if key == SUSPEND_KEY:
            return [Suspend()]
        if key in STOP_KEYS:
            self._stream.stop()
            return [StopRobot()] if key == ROBOT_STOP_KEY else []
        return []

    def _change_speeds(self, linear: int, angular: int) -> list[Request]:
        before, self.speeds = self.speeds, self.speeds.scaled(linear, angular)
        return [Note('this speed is the limit')] if self.speeds == before else []

    def _move_body(self, pose: BodyPose) -> list[Request]:
        before, self.pose = self.pose, pose
        if pose == before and pose != NEUTRAL:
            return [Note('the body does not go further')]
        return [PoseRequest(pose)]

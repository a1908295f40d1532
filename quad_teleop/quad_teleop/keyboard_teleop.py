# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Driving with keys: from key events to velocities and requests. Pure; times are in [s]."""

from __future__ import annotations

from typing import Protocol

from operator_input import (
    CommandStream,
    HeldKeys,
    KeyAction,
    KeyEvent,
    KeyMapping,
    Robot,
    StatusPart,
)

from .key_map import (
    HELP,
    HELP_KEY,
    MODES,
    MOVES,
    NEUTRAL_KEYS,
    POSES,
    Request,
    REQUESTS,
    SPEEDS,
    STOP_KEYS,
)
from .motion import BodyPose, Mode, NEUTRAL, PoseSteps, Speeds, Velocity
from .status import ControllerReport, hint, motion_parts, state_part


class WatchedRobot(Robot, Protocol):
    """The robot as the status line needs it.

    Attributes:
        mode: The mode that was granted last; None before.
    """

    mode: Mode | None

    @property
    def has_subscriber(self) -> bool:
        """Whether anybody listens to the velocities."""

    def report(self, now: float) -> ControllerReport | None:
        """Return what the controller reported last; None when that is long ago."""


class KeyboardTeleop(KeyMapping):
    """Moves while a key of the map is held, and stops when it is not.

    Attributes:
        speeds: The speeds that are set.
        pose: The pose of the body that was requested last.
    """

    introduction = HELP
    robot: WatchedRobot

    def __init__(
        self,
        robot: WatchedRobot,
        held: HeldKeys,
        stream: CommandStream[Velocity],
        speeds: Speeds,
        steps: PoseSteps,
    ) -> None:
        super().__init__(robot, held, stream)
        self.speeds = speeds
        self.pose = NEUTRAL
        self._steps = steps
        self._hint = ''

    def wanted(self, now: float) -> Velocity | None:
        """Return the velocity that is wanted; None when no key requests one."""
        key = self._held.current(now)
        return None if key is None else MOVES[key].at(self.speeds)

    def feed(self, event: KeyEvent) -> list[Request]:
        """Apply an event; return what the person requests besides a velocity."""
        key = event.key
        if key in MOVES or not event.is_stroke:
            self._held.feed(event)
            return []
        if key in SPEEDS:
            before, self.speeds = self.speeds, self.speeds.scaled(*SPEEDS[key])
            return ['this speed is the limit'] if self.speeds == before else []
        if key in POSES:
            return self._move_body(self._steps.moved(self.pose, POSES[key]))
        return [] if event.action is KeyAction.REPEATED else self._stroke(key)

    def status(self, now: float) -> list[StatusPart]:
        """Return what the status line shows; report what keeps the robot from moving."""
        robot, velocity = self.robot, self.wanted(now)
        report, has_subscriber = robot.report(now), robot.has_subscriber
        text = hint(robot.mode, report, velocity, has_subscriber=has_subscriber)
        if text and text != self._hint:
            robot.say(text)
        if text or velocity:  # said once for each reason, and again after the next motion
            self._hint = text
        motion = motion_parts(self.speeds, velocity, self.pose, has_subscriber=has_subscriber)
        return [state_part(robot.mode, report), *motion]

    def _stroke(self, key: str) -> list[Request]:
        if key in MODES:
            mode = MODES[key]
            if not mode.moves:
                self._held.clear()
            return [mode]
        if key in NEUTRAL_KEYS:
            return self._move_body(NEUTRAL)
        if key != HELP_KEY:
            self._held.clear()
        if key in STOP_KEYS:
            self._stream.stop()
        return [REQUESTS[key]] if key in REQUESTS else []

    def _move_body(self, pose: BodyPose) -> list[Request]:
        before, self.pose = self.pose, pose
        if pose == before and pose != NEUTRAL:
            return ['the body does not go further']
        return [pose]

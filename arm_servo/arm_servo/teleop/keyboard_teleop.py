# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging with keys: from key events to motions and requests. Pure; time is handed in."""

from __future__ import annotations

from dataclasses import replace

from operator_input import (
    CommandStream,
    HeldKeys,
    KeyAction,
    KeyEvent,
    Note,
    Quit,
    Suspend,
)

from .exceptions import SettingError
from .jog import Frame, Jog, JointJog
from .key_map import (
    BASE_KEY,
    HELP,
    HELP_KEY,
    JOINT_TYPE_KEY,
    JOINTS,
    PAUSE_KEY,
    plain,
    QUIT_KEYS,
    REVERSE_KEY,
    ROBOT_STOP_KEY,
    SPEEDS,
    STEP_KEY,
    STOP_KEYS,
    SUSPEND_KEY,
    TOOL,
    TOOL_KEY,
    TWIST_TYPE_KEY,
)
from .requests import CommandType, Request, StopRobot, SwitchType, TogglePause
from .scales import Scales, Steps

SPEED_STEP_FACTOR = 1.25  # of a speed key
MIN_SPEED = 0.01  # share of full speed
TAP_SPEED_FACTOR = 0.2  # while a key may be up already: without releases that takes 0.5 s
NOTE_PERIOD = 1.0  # [s] in which a stroke that moves nothing is not reported again

REQUESTS: dict[str, Request] = {
    HELP_KEY: Note(HELP),
    JOINT_TYPE_KEY: SwitchType(CommandType.JOINT_JOG),
    TWIST_TYPE_KEY: SwitchType(CommandType.TWIST),
    PAUSE_KEY: TogglePause(),
    SUSPEND_KEY: Suspend(),
    **dict.fromkeys(QUIT_KEYS, Quit()),
}


class KeyboardTeleop:
    """Moves while a key of the map is held, or by one step for each stroke.

    Attributes:
        speed: Share of full speed, up to 1.
        frame: Along whose axes the tool is jogged.
        sign: Direction of the joint keys, 1 or -1.
        stepping: Each stroke is one step.
        scales: Full speeds of the servo, for the length of a step.
        joints: How many joints the arm has; None while that is not known.
    """

    def __init__(
        self,
        speed: float,
        steps: Steps,
        held: HeldKeys,
        stream: CommandStream[Jog],
        frame: Frame = Frame.BASE,
    ) -> None:
        """Start idle.

        Args:
            speed: Share of full speed at the start.
            steps: How far a stroke moves in step mode.
            held: Decides which key is held.
            stream: Decides when to publish.
            frame: Along whose axes the tool is jogged at the start.

        Raises:
            SettingError: The speed is not between 0.01 and 1.
        """
        if not MIN_SPEED <= speed <= 1.0:
            raise SettingError(f'speed is {speed}: it must be {MIN_SPEED} to 1, of full speed')
        self.speed = speed
        self.frame = frame
        self.sign = 1
        self.stepping = False
        self.scales = Scales()
        self.joints: int | None = None
        self._steps = steps
        self._held = held
        self._stream = stream
        self._step: tuple[Jog, float] | None = None  # motion, end [s]
        self._last_note = ('', 0.0)  # a key that moves nothing, and when it was struck last [s]

    def wanted(self, now: float) -> Jog | None:
        """Return the motion that is wanted; None when no key asks for one.

        Args:
            now: Time [s].
        """
        if self._step is not None:
            jog, end = self._step
            return jog if now < end else None
        key = self._held.current(now)
        if key is None:
            return None
        return self._motion(key, TAP_SPEED_FACTOR if self._held.is_tap(now) else 1.0)

    def step(self, now: float) -> Jog | None:
        """Say what to publish now; call it after every event and when it is due.

        Args:
            now: Time [s].
        """
        if self._step is not None and now >= self._step[1]:
            self._step = None
        return self._stream.step(self.wanted(now), now)

    def due(self, now: float) -> float:
        """Return when step() has to be called at the latest [s]; may be infinite.

        Args:
            now: Time [s].
        """
        due = min(self._held.deadline(now), self._stream.due())
        return due if self._step is None else min(due, self._step[1])

    def end(self) -> None:
        """Let go of everything at the end of the program."""
        self._let_go()
        self._stream.end()

    def feed(self, event: KeyEvent) -> list[Request]:
        """Take an event.

        Args:
            event: What happened to a key.

        Returns:
            What the person asks for besides a motion.
        """
        key = plain(event.key)
        event = KeyEvent(key, event.action, event.time)
        if key in JOINTS and self.joints is not None and JOINTS[key] >= self.joints:
            return self._no_joint(event)
        if key in TOOL or key in JOINTS or not event.is_stroke:
            return self._move(event)
        if key in SPEEDS:
            return self._change_speed(SPEEDS[key])
        return [] if event.action is KeyAction.REPEATED else self._stroke(key)

    def _move(self, event: KeyEvent) -> list[Request]:
        if not self.stepping:
            self._held.feed(event)
        elif event.is_stroke and self._step is None:
            jog, duration = self._steps.pulse(self._motion(event.key), self.scales)
            self._step = jog, event.time + duration
        return []

    def _motion(self, key: str, share: float = 1.0) -> Jog:
        speed = share * self.speed
        if key in JOINTS:
            return JointJog(JOINTS[key], self.sign * speed)
        jog = TOOL[key].scaled(speed, speed)
        return replace(jog, frame=self.frame)

    def _no_joint(self, event: KeyEvent) -> list[Request]:
        self._let_go()
        again = self._last_note[0] == event.key and event.time < self._last_note[1] + NOTE_PERIOD
        if not event.is_stroke or event.action is KeyAction.REPEATED:
            return []
        self._last_note = event.key, event.time
        return [Note(f'the arm has {self.joints} joints: there is no joint {event.key}')] * (
            not again
        )

    def _stroke(self, key: str) -> list[Request]:
        if key == HELP_KEY:
            return [REQUESTS[key]]
        self._let_go()
        if key in REQUESTS:
            return [REQUESTS[key]]
        if key == REVERSE_KEY:
            self.sign = -self.sign
        elif key in {BASE_KEY, TOOL_KEY}:
            self.frame = Frame.BASE if key == BASE_KEY else Frame.TOOL
        elif key == STEP_KEY:
            self.stepping = not self.stepping
        elif key in STOP_KEYS:
            self._stream.stop()
            return [StopRobot()] if key == ROBOT_STOP_KEY else []
        return []

    def _let_go(self) -> None:
        self._held.clear()
        self._step = None

    def _change_speed(self, steps: int) -> list[Request]:
        before = self.speed
        self.speed = min(max(before * SPEED_STEP_FACTOR**steps, MIN_SPEED), 1.0)
        return [Note('this speed is the limit')] if self.speed == before else []

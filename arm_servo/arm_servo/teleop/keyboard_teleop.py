# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging with keys: from key events to motions and requests. Pure; times are in [s]."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from operator_input import (
    CommandStream,
    HeldKeys,
    KeyAction,
    KeyEvent,
    KeyMapping,
    ProgramRequest,
    StatusPart,
    Style,
)

from ..core.requests import CommandType
from .jog import CartesianJog, Frame, Jog, JointJog, ServoReport, ServoRequest, Steps, Vector

if TYPE_CHECKING:
    from .servo_link import ServoLink

SPEED_STEP_FACTOR = 1.25  # of a speed key
MIN_SPEED = 0.01  # share of full speed
TAP_SPEED_FACTOR = 0.2  # while a key may be up already: without releases that takes 0.5 s
NOTE_PERIOD = 1.0  # in which a stroke that moves nothing is not reported again

TOOL = {
    'up': CartesianJog(linear=(1.0, 0.0, 0.0)),
    'down': CartesianJog(linear=(-1.0, 0.0, 0.0)),
    'right': CartesianJog(linear=(0.0, 1.0, 0.0)),
    'left': CartesianJog(linear=(0.0, -1.0, 0.0)),
    ';': CartesianJog(linear=(0.0, 0.0, 1.0)),
    '.': CartesianJog(linear=(0.0, 0.0, -1.0)),
    'page_up': CartesianJog(linear=(0.0, 0.0, 1.0)),
    'page_down': CartesianJog(linear=(0.0, 0.0, -1.0)),
    's': CartesianJog(angular=(1.0, 0.0, 0.0)),
    'x': CartesianJog(angular=(-1.0, 0.0, 0.0)),
    'd': CartesianJog(angular=(0.0, 1.0, 0.0)),
    'c': CartesianJog(angular=(0.0, -1.0, 0.0)),
    'f': CartesianJog(angular=(0.0, 0.0, 1.0)),
    'v': CartesianJog(angular=(0.0, 0.0, -1.0)),
}
"""Keys that move the tool while held."""

JOINTS = {str(number): number - 1 for number in range(1, 9)}
"""Keys that move a joint while held."""

SPEEDS = {'+': 1, '=': 1, '-': -1, '_': -1}  # keys that change the speed, in steps

FRAMES = {'w': Frame.BASE, 'e': Frame.TOOL}
REVERSE_KEY = 'r'
STEP_KEY = 'm'
HELP_KEY = '?'

STOP_KEYS = frozenset({'space', 'k'})
"""Keys that stop at once, with a message even if nothing moves. Other keys stop a motion, too."""

HELP = """\
  hold to move the tool              rotate it             hold to move a joint
    up down      x                     s x  about x          1 2 3 4 5 6 7 8
    right left   y                     d c  about y          R  other direction
    ;  .         z                     f v  about z
  W base axes  E tool axes    + -  speed    M  single steps    P  pause, go on
  J joint, T twist commands only (MoveIt's servo needs the choice)    ?  this help
  Space stops the whole robot; letting go, any other key stop    Q or Ctrl-C quits\
"""
"""Help text with the key map: plain characters, at most 82 columns."""

Request = CommandType | ServoRequest | ProgramRequest | str

REQUESTS: dict[str, Request] = {
    HELP_KEY: HELP,
    'j': CommandType.JOINT_JOG,
    't': CommandType.TWIST,
    'p': ServoRequest.TOGGLE_PAUSE,
    'space': ServoRequest.STOP_ROBOT,  # also what others move
    'ctrl+z': ProgramRequest.SUSPEND,
    **dict.fromkeys(('q', 'ctrl+c', 'ctrl+d', 'ctrl+\\'), ProgramRequest.QUIT),
}


class KeyboardTeleop(KeyMapping):
    """Converts keys to motions: while a key is held, or by one step for each stroke."""

    introduction = HELP
    robot: ServoLink

    def __init__(
        self,
        robot: ServoLink,
        held: HeldKeys,
        stream: CommandStream[Jog],
        speed: float,
        steps: Steps,
    ) -> None:
        super().__init__(robot, held, stream)
        self.speed = speed  # share of full speed, up to 1
        self.frame = Frame.BASE  # along whose axes the tool is jogged
        self.sign = 1  # direction of the joint keys, 1 or -1
        self.stepping = False  # each stroke is one step
        self._steps = steps
        self._step: tuple[Jog, float] | None = None  # motion and its end
        self._last_note = ('', 0.0)  # a key that moves nothing, and when it was struck last

    def wanted(self, now: float) -> Jog | None:
        """Return the motion that the keys request now; None for no motion."""
        if self._step is not None:
            jog, end = self._step
            return jog if now < end else None
        key = self._held.current(now)
        if key is None:
            return None
        return self._motion(key, TAP_SPEED_FACTOR if self._held.is_tap(now) else 1.0)

    def step(self, now: float) -> object | None:
        """Return what to publish now; call it after every event and at the time :meth:`due`."""
        if self._step is not None and now >= self._step[1]:
            self._step = None
        return super().step(now)

    def due(self, now: float) -> float:
        """Return the latest time of the next call of :meth:`step`; may be infinite."""
        due = super().due(now)
        return due if self._step is None else min(due, self._step[1])

    def end(self) -> None:
        """Release everything at the end of the program."""
        self._step = None
        super().end()

    def feed(self, event: KeyEvent) -> list[Request]:
        """Process a key event; return the requests other than motions."""
        key = event.key.lower() if len(event.key) == 1 else event.key
        event = replace(event, key=key)
        joints = len(self.robot.names.joints)
        if key in JOINTS and joints and JOINTS[key] >= joints:
            return self._no_joint(event, joints)
        if key in TOOL or key in JOINTS or not event.is_stroke:
            self._move(event)
            return []
        if key in SPEEDS:
            before = self.speed
            self.speed = min(max(before * SPEED_STEP_FACTOR ** SPEEDS[key], MIN_SPEED), 1.0)
            return ['this speed is the limit'] if self.speed == before else []
        return [] if event.action is KeyAction.REPEATED else self._stroke(key)

    def status(self, now: float) -> list[StatusPart]:
        """Return the parts of the status line, the most important first."""
        robot = self.robot
        speed = f'{self.speed * 100:.0f} %: {self.speed * robot.scales.linear:.3f} m/s'
        parts = [
            servo_part(robot.report(now), paused=robot.paused),
            motion_part(self.wanted(now), robot.names.joints),
            (f'{self.frame.value} frame, joints {"+" if self.sign > 0 else "-"}', Style.BOLD),
            (speed, Style.BOLD),
        ]
        if self.stepping:
            parts.append(('steps', Style.YELLOW))
        if not robot.has_subscriber:
            parts.append(('nobody listens', Style.YELLOW))
        return parts

    def _move(self, event: KeyEvent) -> None:
        if not self.stepping:
            self._held.feed(event)
        elif event.is_stroke and self._step is None:
            jog, duration = self._steps.pulse(self._motion(event.key), self.robot.scales)
            self._step = jog, event.time + duration

    def _motion(self, key: str, share: float = 1.0) -> Jog:
        speed = share * self.speed
        if key in JOINTS:
            return JointJog(JOINTS[key], self.sign * speed)
        return replace(TOOL[key].scaled(speed, speed), frame=self.frame)

    def _no_joint(self, event: KeyEvent, joints: int) -> list[Request]:
        self._let_go()
        if not event.is_stroke or event.action is KeyAction.REPEATED:
            return []
        key, time = self._last_note
        self._last_note = event.key, event.time
        if key == event.key and event.time < time + NOTE_PERIOD:
            return []
        return [f'the arm has {joints} joints: there is no joint {event.key}']

    def _stroke(self, key: str) -> list[Request]:
        if key != HELP_KEY:
            self._let_go()
        self.frame = FRAMES.get(key, self.frame)
        if key == REVERSE_KEY:
            self.sign = -self.sign
        elif key == STEP_KEY:
            self.stepping = not self.stepping
        elif key in STOP_KEYS:
            self._stream.stop()
        return [REQUESTS[key]] if key in REQUESTS else []

    def _let_go(self) -> None:
        self._held.clear()
        self._step = None


def servo_part(report: ServoReport | None, *, paused: bool) -> StatusPart:
    """Return the servo's part of the status line; ``report`` is None if there is none."""
    if paused:
        return 'paused', Style.YELLOW
    if report is None:
        return 'servo ?', Style.YELLOW
    code, message = report
    if code == 0:
        return 'servo ok', Style.BOLD
    return message, Style.RED if code < 0 else Style.YELLOW


def motion_part(jog: Jog | None, joints: tuple[str, ...]) -> StatusPart:
    """Return the motion for the status line, with joint names where known."""
    match jog:
        case JointJog(joint, velocity):
            known = joints[joint] if joint < len(joints) else f'joint {joint + 1}'
            return f'{known} {_sign(velocity)}', Style.GREEN
        case CartesianJog(linear, angular):
            return ' '.join([*_axes('', linear), *_axes('turn ', angular)]), Style.GREEN
    return f'{"idle":<12}', Style.DIM


def _axes(word: str, vector: Vector) -> list[str]:
    return [
        f'{word}{axis} {_sign(value)}' for axis, value in zip('xyz', vector, strict=True) if value
    ]


def _sign(value: float) -> str:
    return '+' if value > 0 else '-'

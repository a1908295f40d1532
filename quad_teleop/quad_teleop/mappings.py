# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Key and gamepad mappings for a walking robot. No ROS; times are in [s].

The keys are those of teleop_twist_keyboard, with additions for a walking robot: ``t`` and ``b``,
up and down there, change the body height here. The letters for roll, yaw and height are those of
champ_teleop.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from operator_input import (
    CommandStream,
    DeadmanMapping,
    HeldKeys,
    KeyAction,
    KeyEvent,
    KeyMapping,
    ProgramRequest,
    Robot,
    StatusPart,
)
from operator_input.gamepad import Axis, Button, Deadman, GamepadState, Grip

from .motion import (
    BodyPose,
    ControllerReport,
    hint,
    Mode,
    motion_parts,
    NEUTRAL,
    PoseSteps,
    RobotRequest,
    Speeds,
    state_part,
    Velocity,
    ZERO,
)

MOVES = {
    'u': Velocity(x=1, yaw=1),
    'i': Velocity(x=1),
    'o': Velocity(x=1, yaw=-1),
    'j': Velocity(yaw=1),
    'l': Velocity(yaw=-1),
    'm': Velocity(x=-1, yaw=-1),
    ',': Velocity(x=-1),
    '.': Velocity(x=-1, yaw=1),
    'U': Velocity(x=1, y=1),
    'I': Velocity(x=1),
    'O': Velocity(x=1, y=-1),
    'J': Velocity(y=1),
    'L': Velocity(y=-1),
    'M': Velocity(x=-1, y=1),
    '<': Velocity(x=-1),
    '>': Velocity(x=-1, y=-1),
}
"""Keys that move as long as they are held, which way as factors of the two speeds."""

SPEEDS = {
    'q': (1, 1),
    'z': (-1, -1),
    'w': (1, 0),
    'x': (-1, 0),
    'e': (0, 1),
    'c': (0, -1),
}
"""Keys that change the linear and the angular speed, in steps."""

MODES = {
    '0': Mode.LIE,
    '1': Mode.STAND,
    '2': Mode.WALK,
    '3': Mode.TURN,
    '9': Mode.GET_UP,
}
"""Keys that ask the controller for a mode."""

POSES = {
    't': BodyPose(height=1),
    'b': BodyPose(height=-1),
    'v': BodyPose(height=1),
    'n': BodyPose(height=-1),
    'page_up': BodyPose(height=1),
    'page_down': BodyPose(height=-1),
    'f': BodyPose(roll=-1),
    'h': BodyPose(roll=1),
    'left': BodyPose(roll=-1),
    'right': BodyPose(roll=1),
    'a': BodyPose(pitch=1),
    'd': BodyPose(pitch=-1),
    'down': BodyPose(pitch=1),
    'up': BodyPose(pitch=-1),
    'r': BodyPose(yaw=1),
    'y': BodyPose(yaw=-1),
}
"""Keys that tilt and lift the body, a step for each stroke."""

NEUTRAL_KEYS = frozenset({'g', 'home'})
"""Keys that let the body stand as it does by itself."""

STOP_KEYS = frozenset({'space', 'k'})
"""Keys that stop at once, and say so even when nothing moves. Any other key stops a motion too."""

HELP_KEY = '?'

HELP = """\
  hold to move     Shift: sideways     body                   speed
    u  i  o            U  I  O         t b  v n  up, down     q z  both
    j  k  l            J  K  L         f h       roll         w x  walking
    m  ,  .            M  <  >         a d       pitch        e c  turning
                                       r y       yaw
  1 stand  2 walk  3 turn  0 lie       g         neutral      ?    this help
  9 gets up after a fall
  Space STOP: the gait ends, too     letting go, any other key stop
  Backspace clears a fault           Ctrl-C quits\
"""
"""The map, for the eye: plain characters, fits into 79 columns."""

Request = Mode | BodyPose | RobotRequest | ProgramRequest | str

REQUESTS: dict[str, Request] = {
    HELP_KEY: HELP,
    'backspace': RobotRequest.CLEAR_FAULT,
    'space': RobotRequest.STOP,  # ends the gait, too, of any client
    'ctrl+z': ProgramRequest.SUSPEND,
    **dict.fromkeys(('ctrl+c', 'ctrl+d', 'ctrl+\\'), ProgramRequest.QUIT),
}


class WatchedRobot(Robot, Protocol):
    """Interface to the robot for the status line."""

    mode: Mode | None  # the mode that was granted last; None before

    @property
    def has_subscriber(self) -> bool:
        """Whether the velocity topic has subscribers."""

    def report(self, now: float) -> ControllerReport | None:
        """Return the last controller report; None if it is outdated."""


class KeyboardTeleop(KeyMapping):
    """Moves while a mapped key is held, and stops when it is released."""

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
        self.speeds = speeds  # the speeds that are set
        self.pose = NEUTRAL  # the pose of the body that was requested last
        self._steps = steps
        self._hint = ''

    def wanted(self, now: float) -> Velocity | None:
        """Return the requested velocity; None if no key requests one."""
        key = self._held.current(now)
        return None if key is None else MOVES[key].at(self.speeds)

    def feed(self, event: KeyEvent) -> list[Request]:
        """Process an event; return the user's requests other than velocities."""
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
        """Return the status line; include what keeps the robot from moving."""
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
    """Moves while the deadman is held: the left stick walks, the right one turns."""

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
        """Start idle, with the speeds at full stick deflection and the d-pad steps."""
        super().__init__(robot, deadman, stream, warn)
        self.pose = NEUTRAL  # the pose of the body that was requested last
        self._speeds = {Grip.HELD: normal, Grip.TURBO: turbo}
        self._steps = steps

    def wanted(self, now: float) -> Velocity | None:
        """Return the requested velocity; None without the deadman.

        Without a deadman button, a gamepad at rest requests nothing.
        """
        speeds = self._speeds.get(self.grip)
        if speeds is None:
            return None
        axis = self.state.axis
        velocity = Velocity(axis(Axis.LEFT_Y), axis(Axis.LEFT_X), axis(Axis.RIGHT_X)).at(speeds)
        return None if velocity == ZERO and self._deadman.enable is None else velocity

    def feed(self, state: GamepadState) -> list[Mode | BodyPose | RobotRequest]:
        """Process a gamepad state; return the user's requests other than velocities.

        All requests that move the robot need the deadman, except lying down. Clearing a fault
        moves nothing and does not need it.
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
    """Return the steps for newly pressed d-pad directions."""

    def pressed(axis: Axis) -> float:
        return state.axis(axis) if state.axis(axis) != before.axis(axis) else 0.0

    return BodyPose(height=pressed(Axis.DPAD_Y), roll=-pressed(Axis.DPAD_X))

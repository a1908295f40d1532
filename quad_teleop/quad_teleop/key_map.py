# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What each key does: the map of teleop_twist_keyboard, and what a walking robot has besides.

``t`` and ``b``, up and down there, are the height of the body here. Roll, yaw and height by
letters are those of champ_teleop.
"""

from __future__ import annotations

from operator_input import ProgramRequest

from .motion import BodyPose, Mode, RobotRequest, Velocity

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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What each key does: the map of MoveIt's servo_keyboard_input, and what it lacks.

Arrows, ``.``, ``;``, W, E, 1 to 7, R, Q are those of the tutorial, J and T those of Jazzy.
Rotation keys, speed keys, steps, stop and pause are ours. Letters count with and without Shift.
"""

from __future__ import annotations

from operator_input import ProgramRequest

from ..core.requests import CommandType
from .jog import CartesianJog, Frame, ServoRequest

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
"""Keys that move the tool as long as they are held."""

JOINTS = {str(number): number - 1 for number in range(1, 9)}
"""Keys that move a joint as long as they are held."""

SPEEDS = {'+': 1, '=': 1, '-': -1, '_': -1}
"""Keys that change the speed, in steps."""

FRAMES = {'w': Frame.BASE, 'e': Frame.TOOL}
REVERSE_KEY = 'r'
STEP_KEY = 'm'
HELP_KEY = '?'

STOP_KEYS = frozenset({'space', 'k'})
"""Keys that stop at once, and say so even when nothing moves. Any other key stops a motion too."""

HELP = """\
  hold to move the tool              rotate it             hold to move a joint
    up down      x                     s x  about x          1 2 3 4 5 6 7 8
    right left   y                     d c  about y          R  other direction
    ;  .         z                     f v  about z
  W base axes  E tool axes    + -  speed    M  single steps    P  pause, go on
  J joint, T twist commands only (MoveIt's servo needs the choice)    ?  this help
  Space stops the whole robot; letting go, any other key stop    Q or Ctrl-C quits\
"""
"""The map, for the eye: plain characters, fits into 82 columns."""

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

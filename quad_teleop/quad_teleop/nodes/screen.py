# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The status line of teleop_keyboard."""

from __future__ import annotations

from dataclasses import dataclass
import math

from operator_input import ReleaseSource

from ..body_pose import BodyPose, NEUTRAL
from ..modes import Mode
from ..speeds import Speeds
from ..velocity import Velocity

BOLD, DIM, GREEN, YELLOW, RESET = '\x1b[1m', '\x1b[2m', '\x1b[32m', '\x1b[33m', '\x1b[0m'

SOURCES = {
    ReleaseSource.TERMINAL: 'true releases',
    ReleaseSource.KEYBOARD: 'true releases (evdev)',
    ReleaseSource.TIME_OUT: 'timed releases',
}


@dataclass(frozen=True, slots=True)
class View:
    """What is shown.

    Attributes:
        mode: Mode that was granted last.
        speeds: The speeds that are set.
        velocity: What is wanted now.
        pose: How the body shall stand.
        source: Who says when a key goes up.
        is_heard: Whether anybody listens.
    """

    mode: Mode | None
    speeds: Speeds
    velocity: Velocity | None
    pose: BodyPose
    source: ReleaseSource
    is_heard: bool


def status(view: View, colour: bool) -> str:
    """Write the status line; what matters most stands first, a narrow window cuts the rest.

    Args:
        view: What to show.
        colour: Use colours.
    """
    parts = [
        (view.mode.value if view.mode else 'mode ?', BOLD),
        (f'{view.speeds.linear:.2f} m/s {view.speeds.angular:.2f} rad/s', BOLD),
        (_motion(view.velocity), GREEN if view.velocity else DIM),
    ]
    if not view.is_heard:
        parts.append(('nobody listens', YELLOW))
    if view.pose != NEUTRAL:
        parts.append((_body(view.pose), ''))
    parts.append((SOURCES[view.source], DIM))
    return ' | '.join(f'{code}{text}{RESET}' if colour and code else text for text, code in parts)


def hint(view: View) -> str:
    """Say why the robot may not move although it is asked to; empty for nothing to say.

    Args:
        view: What is shown.
    """
    if view.velocity is None or not view.is_heard:
        return ''
    if view.mode is not None and not view.mode.moves:
        return f'the mode is {view.mode.value}: press 2 to walk, or 3 to turn on the spot'
    return ''


def _motion(velocity: Velocity | None) -> str:
    if velocity is None:
        return f'{"idle":<27}'
    return f'x {velocity.x:+.2f} y {velocity.y:+.2f} yaw {velocity.yaw:+.2f}'


def _body(pose: BodyPose) -> str:
    angles = ' '.join(f'{math.degrees(angle):+.0f}' for angle in (pose.roll, pose.pitch, pose.yaw))
    return f'body {pose.height * 1000:+.0f} mm {angles} deg'

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The status line of teleop_keyboard."""

from __future__ import annotations

from dataclasses import dataclass
import math

from operator_input import RELEASE_WORDS, ReleaseSource, status_text, Style

from ..body_pose import BodyPose, NEUTRAL
from ..controller_report import ControllerReport
from ..modes import Mode
from ..speeds import Speeds
from ..velocity import Velocity


@dataclass(frozen=True, slots=True)
class View:
    """What is shown.

    Attributes:
        mode: Mode that was granted last.
        report: What the controller reports of itself; None when there is none.
        speeds: The speeds that are set.
        velocity: What is wanted now.
        pose: How the body shall stand.
        source: Who says when a key goes up.
        has_subscriber: Whether anybody listens.
    """

    mode: Mode | None
    report: ControllerReport | None
    speeds: Speeds
    velocity: Velocity | None
    pose: BodyPose
    source: ReleaseSource
    has_subscriber: bool


def status(view: View, colour: bool) -> str:
    """Write the status line; what matters most stands first, a narrow window cuts the rest.

    Args:
        view: What to show.
        colour: Use colours.
    """
    parts = [
        _state(view),
        (f'{view.speeds.linear:.2f} m/s {view.speeds.angular:.2f} rad/s', Style.BOLD),
        (_motion(view.velocity), Style.GREEN if view.velocity else Style.DIM),
    ]
    if not view.has_subscriber:
        parts.append(('no subscriber', Style.YELLOW))
    if view.pose != NEUTRAL:
        parts.append((_body(view.pose), Style.PLAIN))
    parts.append((RELEASE_WORDS[view.source], Style.DIM))
    return status_text(parts, colour=colour)


def hint(view: View) -> str:
    """Return why the robot may not move although it is commanded to; empty for no reason.

    Args:
        view: What is shown.
    """
    report = view.report
    if report is not None and report.has_fault:
        return f'fault: {report.message}; Backspace clears it, 0 lies down, 9 gets up'
    if view.velocity is None or not view.has_subscriber:
        return ''
    moves = report.follows_velocities if report else view.mode is None or view.mode.moves
    if moves:
        return ''
    return f'the robot does not walk now ({_state(view)[0]}): press 2 to walk, 3 to turn'


def _state(view: View) -> tuple[str, Style]:
    if view.report is not None:
        return view.report.state, Style.RED if view.report.has_fault else Style.BOLD
    return view.mode.value if view.mode else 'mode ?', Style.BOLD


def _motion(velocity: Velocity | None) -> str:
    if velocity is None:
        return f'{"idle":<27}'
    return f'x {velocity.x:+.2f} y {velocity.y:+.2f} yaw {velocity.yaw:+.2f}'


def _body(pose: BodyPose) -> str:
    angles = ' '.join(f'{math.degrees(angle):+.0f}' for angle in (pose.roll, pose.pitch, pose.yaw))
    return f'body {pose.height * 1000:+.0f} mm {angles} deg'

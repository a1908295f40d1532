# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the controller reports on /diagnostics (REP 107), and what a person at a keyboard reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

from operator_input import StatusPart, Style

from .motion import BodyPose, Mode, NEUTRAL, Speeds, Velocity

NAME = 'controller_node: state'
"""Name of the status, after a namespace if there is one."""

ERROR = 2  # of diagnostic_msgs/DiagnosticStatus: a fault is latched
REPORT_TIMEOUT = 3.0  # [s] after which a report is history
FOLLOWS_VELOCITIES = frozenset({'walk', 'turn', 'policy'})
"""Modes in which velocities do anything."""


@dataclass(frozen=True, slots=True)
class ControllerReport:
    """One report.

    Attributes:
        state: What the robot does: ``walk``, ``to stand``, ``fault``.
        goal: The mode that it is on its way to.
        has_fault: Whether a fault is latched.
        message: What is not, in words.
        time: When it came [s].
    """

    state: str
    goal: str
    has_fault: bool
    message: str
    time: float

    def is_fresh(self, now: float) -> bool:
        """Return whether it still counts at a time [s]."""
        return now - self.time < REPORT_TIMEOUT


def read_report(
    name: str, level: int, message: str, values: Mapping[str, str], now: float
) -> ControllerReport | None:
    """Read a status of /diagnostics, come at a time [s]; None if it is not the controller's."""
    if not name.endswith(NAME) or 'state' not in values:
        return None
    state = values['state']
    return ControllerReport(state, values.get('goal', state), level == ERROR, message, now)


def state_part(mode: Mode | None, report: ControllerReport | None) -> StatusPart:
    """Show what the controller reports, else the mode that it granted last."""
    if report is not None:
        return report.state, Style.RED if report.has_fault else Style.BOLD
    return mode.value if mode else 'mode ?', Style.BOLD


def motion_parts(
    speeds: Speeds, velocity: Velocity | None, pose: BodyPose, *, has_subscriber: bool
) -> list[StatusPart]:
    """Show the speeds that are set, the velocity that is wanted, and how the body shall stand."""
    parts = [(f'{speeds.linear:.2f} m/s {speeds.angular:.2f} rad/s', Style.BOLD)]
    if velocity is None:
        parts.append((f'{"idle":<27}', Style.DIM))
    else:
        way = f'x {velocity.x:+.2f} y {velocity.y:+.2f} yaw {velocity.yaw:+.2f}'
        parts.append((way, Style.GREEN))
    if not has_subscriber:
        parts.append(('no subscriber', Style.YELLOW))
    if pose != NEUTRAL:
        angles = ' '.join(f'{math.degrees(a):+.0f}' for a in (pose.roll, pose.pitch, pose.yaw))
        parts.append((f'body {pose.height * 1000:+.0f} mm {angles} deg', Style.PLAIN))
    return parts


def hint(
    mode: Mode | None,
    report: ControllerReport | None,
    velocity: Velocity | None,
    *,
    has_subscriber: bool,
) -> str:
    """Return why the robot may not move although it is commanded to; empty for no reason."""
    if report is not None and report.has_fault:
        return f'fault: {report.message}; Backspace clears it, 0 lies down, 9 gets up'
    if velocity is None or not has_subscriber:
        return ''
    moves = report.goal in FOLLOWS_VELOCITIES if report else mode is None or mode.moves
    if moves:
        return ''
    state, _ = state_part(mode, report)
    return f'the robot does not walk now ({state}): press 2 to walk, 3 to turn'

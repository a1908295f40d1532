# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The status line of servo_keyboard_input."""

from __future__ import annotations

from dataclasses import dataclass

from arm_model import ArmNames
from operator_input import RELEASE_WORDS, ReleaseSource, status_text, Style

from .jog import CartesianJog, Frame, Jog, JointJog, Vector
from .scales import Scales

AXES = ('x', 'y', 'z')


@dataclass(frozen=True, slots=True)
class ServoView:
    """What the servo says of itself.

    Attributes:
        code: Code of its status; 0 is well, negative refuses.
        message: The same in words.
    """

    code: int
    message: str


@dataclass(frozen=True, slots=True)
class View:
    """What is shown.

    Attributes:
        servo: What the servo says; None when it says nothing.
        names: Names of the arm's parts.
        scales: Full speeds of the servo.
        speed: Share of full speed.
        frame: Along whose axes the tool is jogged.
        sign: Direction of the joint keys.
        stepping: Each stroke is one step.
        paused: The servo is paused.
        jog: What is wanted now.
        source: Who says when a key goes up.
        has_subscriber: Whether anything subscribes.
    """

    servo: ServoView | None
    names: ArmNames
    scales: Scales
    speed: float
    frame: Frame
    sign: int
    stepping: bool
    paused: bool
    jog: Jog | None
    source: ReleaseSource
    has_subscriber: bool


def status(view: View, colour: bool) -> str:
    """Write the status line; what matters most stands first, a narrow window cuts the rest.

    Args:
        view: What to show.
        colour: Use colours.
    """
    scales, joints = view.scales, '+' if view.sign > 0 else '-'
    parts = [
        _servo(view),
        (motion(view.jog, view.names) or f'{"idle":<12}', Style.GREEN if view.jog else Style.DIM),
        (f'{view.frame.value} frame, joints {joints}', Style.BOLD),
        (f'{view.speed * 100:.0f} %: {view.speed * scales.linear:.3f} m/s', Style.BOLD),
    ]
    if view.stepping:
        parts.append(('steps', Style.YELLOW))
    if not view.has_subscriber:
        parts.append(('nobody listens', Style.YELLOW))
    parts.append((RELEASE_WORDS[view.source], Style.DIM))
    return status_text(parts, colour=colour)


def motion(jog: Jog | None, names: ArmNames) -> str:
    """Write what moves; empty for nothing.

    Args:
        jog: What is wanted.
        names: Names of the arm's parts.
    """
    match jog:
        case JointJog(joint, velocity):
            known = names.joints[joint] if joint < len(names.joints) else f'joint {joint + 1}'
            return f'{known} {"+" if velocity > 0 else "-"}'
        case CartesianJog(linear, angular):
            return ' '.join([*_signs('', linear), *_signs('turn ', angular)])
    return ''


def _signs(word: str, vector: Vector) -> list[str]:
    return [
        f'{word}{axis} {"+" if value > 0 else "-"}'
        for axis, value in zip(AXES, vector, strict=True)
        if value
    ]


def _servo(view: View) -> tuple[str, Style]:
    if view.paused:
        return 'paused', Style.YELLOW
    if view.servo is None:
        return 'servo ?', Style.YELLOW
    if view.servo.code == 0:
        return 'servo ok', Style.BOLD
    return view.servo.message, Style.RED if view.servo.code < 0 else Style.YELLOW

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The status line of servo_keyboard_input."""

from __future__ import annotations

from dataclasses import dataclass

from operator_input import ReleaseSource

from .jog import CartesianJog, Frame, Jog, JointJog, Vector
from .names import ArmNames
from .scales import Scales

BOLD, DIM, GREEN, YELLOW = '\x1b[1m', '\x1b[2m', '\x1b[32m', '\x1b[33m'
RED, RESET = '\x1b[1;31m', '\x1b[0m'
AXES = ('x', 'y', 'z')

SOURCES = {
    ReleaseSource.TERMINAL: 'true releases',
    ReleaseSource.KEYBOARD: 'true releases (evdev)',
    ReleaseSource.TIME_OUT: 'timed releases',
}


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
        is_heard: Whether anybody listens.
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
    is_heard: bool


def status(view: View, colour: bool) -> str:
    """Write the status line; what matters most stands first, a narrow window cuts the rest.

    Args:
        view: What to show.
        colour: Use colours.
    """
    scales, joints = view.scales, '+' if view.sign > 0 else '-'
    parts = [
        _servo(view),
        (motion(view.jog, view.names) or f'{"idle":<12}', GREEN if view.jog else DIM),
        (f'{view.frame.value} frame, joints {joints}', BOLD),
        (f'{view.speed * 100:.0f} %: {view.speed * scales.linear:.3f} m/s', BOLD),
    ]
    if view.stepping:
        parts.append(('steps', YELLOW))
    if not view.is_heard:
        parts.append(('nobody listens', YELLOW))
    parts.append((SOURCES[view.source], DIM))
    return ' | '.join(f'{code}{text}{RESET}' if colour and code else text for text, code in parts)


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


def _servo(view: View) -> tuple[str, str]:
    if view.paused:
        return 'paused', YELLOW
    if view.servo is None:
        return 'servo ?', YELLOW
    if view.servo.code == 0:
        return 'servo ok', BOLD
    return view.servo.message, RED if view.servo.code < 0 else YELLOW

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parts of the status line of servo_keyboard_input."""

from __future__ import annotations

from operator_input import StatusPart, Style

from .jog import CartesianJog, Jog, JointJog, Vector

ServoReport = tuple[int, str]
"""Code of a servo's status, where 0 is well and a negative one refuses; and the same in words."""


def servo_part(report: ServoReport | None, *, paused: bool) -> StatusPart:
    """Show what the servo reports; None for nothing."""
    if paused:
        return 'paused', Style.YELLOW
    if report is None:
        return 'servo ?', Style.YELLOW
    code, message = report
    if code == 0:
        return 'servo ok', Style.BOLD
    return message, Style.RED if code < 0 else Style.YELLOW


def motion_part(jog: Jog | None, joints: tuple[str, ...]) -> StatusPart:
    """Show what moves, by the names of the joints as far as they are known."""
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

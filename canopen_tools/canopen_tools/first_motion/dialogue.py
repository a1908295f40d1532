# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Questions to the person at the terminal, and what is shown there."""

from __future__ import annotations

from collections.abc import Sequence
import shutil
import sys
import textwrap

from canopen_core import CanopenError
from first_motion import Cause, JointKind, read_quantity, Seen

WIDTH_MIN = 40  # [characters]


class FirstMotionError(CanopenError):
    """The motion cannot be made, or was ended by an error; the message has the reason."""


def ask_seen(kind: JointKind, reported: float) -> Seen:
    """Ask what the person saw; the drive reports a distance in [rad] or [m]."""
    say(
        'What did you see? + is the direction in which the position of the joint shall grow (of '
        'its axis in the URDF, by the right-hand rule).'
    )
    answers = {'+': 1, '-': -1, '0': 0, 'o': 0}
    while (
        way := _asked('which way, + or -; 0 for no motion, o for another joint: ')
    ) not in answers:
        say('  type one of + - 0 o')
    if way in '0o':
        return Seen(0, other_joint=way == 'o')
    while True:
        text = _asked(
            f'how far about, in {kind.value} (Enter: {kind.shown(abs(reported))}, as reported): '
        )
        if not text:
            return Seen(answers[way])
        try:
            far = read_quantity(text, kind)
        except ValueError as error:
            say(f'  {error}')
            continue
        if far.kind is kind and far.value > 0.0:
            return Seen(answers[way], far.value)
        say(f'  a distance above 0 in {kind.value}')


def choose(causes: Sequence[Cause]) -> Cause | None:
    """Ask for one of several causes; None for none of them."""
    numbers = {str(number): cause for number, cause in enumerate(causes, 1)}
    while True:
        answer = _asked(f'which of them is it, 1 to {len(causes)} (Enter: none): ')
        if not answer:
            return None
        if answer in numbers:
            return numbers[answer]


def agrees(question: str) -> bool:
    """Ask for a yes; everything else is a no."""
    return _asked(f'{question} [y/N] ').lower() in {'y', 'yes'}


def _asked(question: str) -> str:
    try:
        return input(question).strip()
    except EOFError as error:
        raise FirstMotionError('the input has ended') from error


def say(text: str) -> None:
    """Show a paragraph, broken between words."""
    indent = ' ' * (len(text) - len(text.lstrip()))
    width = shutil.get_terminal_size().columns - 1
    lines = textwrap.wrap(text, max(width, WIDTH_MIN), subsequent_indent=f'{indent}  ')
    sys.stdout.write('\n'.join(lines) + '\n')
    sys.stdout.flush()

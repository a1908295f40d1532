# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Talks with the person who calibrates."""

from __future__ import annotations

from typing import Protocol


class CancelledError(Exception):
    """The person has cancelled; nothing is written."""


class Console(Protocol):
    """A person who answers."""

    def write(self, text: str) -> None:
        """Show a text."""

    def prompt(self, question: str) -> str:
        """Return the answer to a question, without blanks around it.

        Raises:
            CancelledError: Nobody answers any more.
        """


class TerminalConsole:
    """A person at a terminal."""

    def write(self, text: str) -> None:
        """Print a text."""
        print(text, flush=True)  # noqa: T201  # what the program is for

    def prompt(self, question: str) -> str:
        """Return the answer to a question.

        Raises:
            CancelledError: Ctrl-C or Ctrl-D was pressed.
        """
        try:
            return input(f'{question} ').strip()
        except (EOFError, KeyboardInterrupt):
            raise CancelledError('cancelled; nothing was written') from None


def confirm(console: Console, question: str, *, default: bool = False) -> bool:
    """Return the answer to a question of yes or no."""
    choices = '[Y/n]' if default else '[y/N]'
    answer = console.prompt(f'{question} {choices}').lower()
    return answer.startswith('y') if answer else default


def prompt_number(console: Console, question: str) -> float:
    """Prompt for a positive number, until there is one."""
    while True:
        answer = console.prompt(question)
        try:
            number = float(answer.replace(',', '.'))
        except ValueError:
            number = 0.0
        if 0.0 < number < float('inf'):
            return number
        console.write(f'{answer!r} is not a positive number; for example 0.95')

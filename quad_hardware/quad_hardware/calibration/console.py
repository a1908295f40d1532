# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Talks with the person who calibrates."""

from __future__ import annotations

from typing import Protocol


class CancelledError(Exception):
    """The person does not want to go on; nothing is written."""


class Console(Protocol):
    """Someone to ask."""

    def say(self, text: str) -> None:
        """Tell something."""

    def ask(self, question: str) -> str:
        """Ask something and return the answer, without blanks around it.

        Raises:
            CancelledError: There is nobody any more.
        """


class TerminalConsole:
    """A person at a terminal."""

    def say(self, text: str) -> None:
        """Print something."""
        print(text, flush=True)  # noqa: T201  # what the program is for

    def ask(self, question: str) -> str:
        """Ask something and return the answer.

        Raises:
            CancelledError: Ctrl-C or Ctrl-D was pressed.
        """
        try:
            return input(f'{question} ').strip()
        except (EOFError, KeyboardInterrupt):
            raise CancelledError('cancelled; nothing was written') from None


def ask_yes(console: Console, question: str, *, default: bool = False) -> bool:
    """Ask a question of yes or no."""
    choices = '[Y/n]' if default else '[y/N]'
    answer = console.ask(f'{question} {choices}').lower()
    return answer.startswith('y') if answer else default


def ask_number(console: Console, question: str) -> float:
    """Ask for a positive number, until there is one."""
    while True:
        answer = console.ask(question)
        try:
            number = float(answer.replace(',', '.'))
        except ValueError:
            number = 0.0
        if 0.0 < number < float('inf'):
            return number
        console.say(f'{answer!r} is no positive number; for example 0.95')

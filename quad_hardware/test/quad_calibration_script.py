# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A person who calibrates, written down."""

from __future__ import annotations

from collections.abc import Callable

from quad_hardware.calibration.wizard import CancelledError, Console


class Script(Console):
    """Someone who answers in order, moves the robot before, and remembers what was said."""

    def __init__(self, *answers: str | tuple[Callable[[], None], str]) -> None:
        self._answers = list(answers)
        self.said: list[str] = []

    def write(self, text: str) -> None:
        """Listen."""
        self.said.append(text)

    def prompt(self, question: str) -> str:
        """Answer; leave when there is no answer left."""
        self.said.append(question)
        if not self._answers:
            raise CancelledError('cancelled; nothing was written')
        answer = self._answers.pop(0)
        if isinstance(answer, tuple):
            move, answer = answer
            move()
        return answer

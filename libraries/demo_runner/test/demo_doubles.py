# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A display and a supervisor for tests of the scenario of a demo."""

from __future__ import annotations

from process_supervisor import Notice, Outcome, Phase


class FakeDisplay:
    """A display that keeps phases and notices."""

    def __init__(self) -> None:
        self.phases: list[str] = []
        self.notices: list[Notice] = []

    def phase(self, text: str) -> None:
        """Keep it."""
        self.phases.append(text)

    def show(self, figures: object) -> None:
        """Nobody looks."""

    def line(self, name: str, text: str) -> None:
        """Nobody reads."""

    def notice(self, notice: Notice) -> None:
        """Keep it."""
        self.notices.append(notice)

    def close(self) -> None:
        """Nothing is open."""


class FakeSupervisor:
    """A supervisor that runs until a stop is requested."""

    def __init__(self, phase: Phase = Phase.RUNNING) -> None:
        self.phase = phase
        self.outcome: Outcome | None = None

    def stop(self, outcome: Outcome) -> None:
        """Stop at once."""
        self.outcome = outcome
        self.phase = Phase.STOPPED

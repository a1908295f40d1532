# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Requests true key releases of a terminal, and verifies its answer.

A terminal with the Kitty keyboard protocol answers ``CSI ? u``; every terminal answers ``CSI c``.
If the second answer comes without the first, there is no such protocol. Nothing waits for either:
until the protocol is there, keys are read the old way.
"""

from __future__ import annotations

from enum import Enum

from .reports import Kitty, Report, ReportKind

QUERY = '\x1b[?u\x1b[c'
WANTED = (
    Kitty.DISAMBIGUATE | Kitty.EVENT_TYPES | Kitty.ALTERNATE_KEYS | Kitty.ALL_KEYS | Kitty.TEXT
)
NEEDED = Kitty.EVENT_TYPES | Kitty.ALL_KEYS
"""Without ALL_KEYS the keys that type a character do not report their release."""

PUSH, POP = f'\x1b[>{WANTED:d}u', '\x1b[<u'


class Stage(Enum):
    """How far the negotiation is."""

    IDLE = 'idle'
    REQUESTED = 'requested'
    PUSHED = 'switched on, not confirmed'
    ACTIVE = 'active'
    ABSENT = 'absent'


class KittyNegotiation:
    """The dialogue with the terminal; pure: takes reports, returns what to write.

    Attributes:
        stage: How far it is.
    """

    def __init__(self) -> None:
        self.stage = Stage.IDLE
        self._attributes_due = 0

    @property
    def is_waiting(self) -> bool:
        """Whether answers may still come."""
        return self._attributes_due > 0

    def start(self) -> str:
        """Return the question."""
        self.stage = Stage.REQUESTED
        self._attributes_due += 1
        return QUERY

    def take(self, report: Report) -> str:
        """Take a report of the terminal.

        Args:
            report: Any.

        Returns:
            What to write; empty for nothing.
        """
        if report.kind is ReportKind.DEVICE_ATTRIBUTES:
            return self._attributes()
        if report.kind is ReportKind.KITTY_FLAGS:
            return self._flags(report.flags)
        return ''

    def stop(self) -> str:
        """Return what gives the terminal back as it was."""
        was, self.stage = self.stage, Stage.IDLE
        return POP if was in {Stage.PUSHED, Stage.ACTIVE} else ''

    def _flags(self, flags: Kitty) -> str:
        if self.stage is Stage.REQUESTED:
            self.stage = Stage.PUSHED
            self._attributes_due += 1
            return PUSH + QUERY
        if self.stage is Stage.PUSHED:
            if NEEDED in flags:
                self.stage = Stage.ACTIVE
                return ''
            self.stage = Stage.ABSENT
            return POP
        return ''

    def _attributes(self) -> str:
        self._attributes_due = max(self._attributes_due - 1, 0)
        if self._attributes_due or self.stage not in {Stage.REQUESTED, Stage.PUSHED}:
            return ''  # an answer to the first of two questions, or all is settled
        was, self.stage = self.stage, Stage.ABSENT
        return POP if was is Stage.PUSHED else ''

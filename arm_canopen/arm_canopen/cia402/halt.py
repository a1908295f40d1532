# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The halt of one drive: bit 8 of the controlword, and when it may be taken back."""

from __future__ import annotations

from ..standard.drive import Controlword, OperationMode
from .modes import Mode, NO_BITS

HALT_BIT = int(Controlword.HALT)
RESUME_TIMEOUT = 2.5  # [s] for which a halted drive may take to acknowledge a set-point


class Halt:
    """Holds a drive until a target that came later has been handed over.

    Attributes:
        held: The drive is halted.
    """

    def __init__(self) -> None:
        """Begin without a halt."""
        self.held = False
        self._leaving_since: float | None = None
        self._ends_in: OperationMode | None = None

    @property
    def leaving(self) -> bool:
        """Whether a target is on its way that will end it."""
        return self._leaving_since is not None

    def hold(self) -> None:
        """Halt; whatever would have ended an earlier halt does not end this one."""
        self.held = True
        self._leaving_since = self._ends_in = None

    def release(self) -> None:
        """End it at once: there is nothing old that could go on."""
        self.held = False
        self._leaving_since = self._ends_in = None

    def leave(self, now: float) -> None:
        """End it when the drive has taken the target that was commanded at this time in [s]."""
        if self.held:
            self._leaving_since = now

    def end_in(self, mode: OperationMode) -> None:
        """End it when the drive shows another mode, in which it has no target yet."""
        if self.held:
            self._ends_in = mode

    def bits(self, mode: Mode) -> int:
        """Return bit 8 for a drive that is moved, or was moved last, by a mode."""
        return HALT_BIT if self.held and mode.halts_by_bit else NO_BITS

    def advance(self, now: float, mode: Mode) -> bool:
        """End it where that is due, for a drive that obeys a mode.

        Args:
            now: Steady time in [s].
            mode: The mode.

        Returns:
            False when the drive has not taken its new target in time, and stays halted.
        """
        if self._ends_in is mode.number:
            self.release()
        if self._leaving_since is None:
            return True
        if mode.taken:
            self.release()
        elif now - self._leaving_since > RESUME_TIMEOUT:
            self.hold()
            return False
        return True

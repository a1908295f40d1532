# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The halt of one drive: bit 8 of the controlword, and when it may be taken back."""

from __future__ import annotations

from canopen_core.standard import Controlword, OperationMode

from ..master.scheduler import completed, Promise
from .modes import Mode, NO_BITS

HALT_BIT = int(Controlword.HALT)
RESUME_TIMEOUT = 2.5  # [s] for which a halted drive may take to acknowledge a set-point
UNDER_HALT_TIME = 0.5  # [s] for the acknowledge of a set-point while bit 8 is set
RELEASED_TIME = 0.05  # [s] for it where bit 8 went with bit 4: an old move might go on meanwhile
ANSWER_CYCLES = 5  # in which a drive answers what it sees, if that takes longer


class Halt:
    """Holds a drive until a target that came later has been handed over.

    A set-point of mode 1 is offered while bit 8 is set, so that a move of before cannot go on. A
    drive that does not acknowledge there gets it once more in the controlword that takes bit 8
    back, and from then on always so; at the end of its halt it has no other target to go to.
    Where that one is not acknowledged either, it is halted again.

    Attributes:
        held: The drive is halted.
        unanswered: It is because it has not taken the target that was to end the halt.
    """

    def __init__(self) -> None:
        self.held = self.unanswered = False
        self._leaving_since: float | None = None
        self._delivery = completed()
        self._offered_since: float | None = None
        self._ends_in: OperationMode | None = None
        self._released = False  # bit 8 is taken back, and the acknowledge is awaited
        self._ends_with_offer = False  # the drive sees no set-point under halt

    @property
    def leaving(self) -> bool:
        """Whether a target is on its way that will end it."""
        return self._leaving_since is not None

    def hold(self) -> None:
        """Halt; whatever would have ended an earlier halt does not end this one."""
        self._forget()
        self.held = True

    def release(self) -> None:
        """End it at once: there is nothing old that could go on."""
        self._forget()
        self.held = False

    def leave(self, now: float, delivery: Promise[None]) -> None:
        """End it when the drive has taken the target that was commanded at ``now`` in [s].

        Where the drive refuses its delivery, the halt goes on.
        """
        if self.held:
            self._leaving_since = now
            self._delivery = delivery
            self.unanswered = False

    def end_in(self, mode: OperationMode) -> None:
        """End it when the drive shows another mode, in which it has no target yet."""
        if self.held:
            self._ends_in = mode

    def bits(self, mode: Mode) -> int:
        """Return bit 8 for a drive that is moved, or was moved last, by a mode."""
        holds = self.held and mode.halts_by_bit and not self._released
        return HALT_BIT if holds else NO_BITS

    def advance(self, now: float, period: float, mode: Mode) -> bool:
        """End it where that is due, for a drive that acts on a mode.

        Returns:
            False when the drive has not taken its new target in time, and stays halted.
        """
        if self._ends_in is mode.number:
            self.release()
        if self._leaving_since is None:
            return True
        if self._delivery.error is not None:
            self.hold()
            return True
        if mode.taken:
            self.release()
            return True
        if self._offered_since is not None:
            waited = now - self._offered_since
            answers = ANSWER_CYCLES * period
            if self._released and waited > max(RELEASED_TIME, answers):
                return self._end_unanswered(mode)
            if not self._released and waited > max(UNDER_HALT_TIME, answers):
                self._offered_since = None
                self._ends_with_offer = True
                mode.offer_again()
        elif mode.offered:
            self._offered_since = now
            self._released = self._ends_with_offer
        if now - self._leaving_since > RESUME_TIMEOUT:
            return self._hold_unanswered()
        return True

    def _end_unanswered(self, mode: Mode) -> bool:
        """Halt again, unless it is a drive that is not known to acknowledge anything."""
        if not mode.goes_on_unanswered():
            return self._hold_unanswered()
        self._ends_with_offer = False
        self.release()
        return True

    def _hold_unanswered(self) -> bool:
        self.hold()
        self.unanswered = True
        self._ends_with_offer = False
        return False

    def _forget(self) -> None:
        self._leaving_since = self._offered_since = self._ends_in = None
        self._released = self.unanswered = False

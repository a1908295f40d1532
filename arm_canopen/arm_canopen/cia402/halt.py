# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The halt of one drive: bit 8 of the controlword, and when it may be taken back."""

from __future__ import annotations

from enum import Enum

from canopen_core.standard import Controlword, OperationMode

from ..master.scheduler import completed, Promise
from .modes import Mode, NO_BITS, ProfilePosition

HALT_BIT = int(Controlword.HALT)
RESUME_TIMEOUT = 2.5  # [s] for which a halted drive may take to acknowledge a set-point
UNDER_HALT_TIME = 0.5  # [s] for the acknowledge of a set-point while bit 8 is set
RELEASED_TIME = 0.05  # [s] for it where bit 8 went with bit 4: an old move might go on meanwhile
ANSWER_CYCLES = 5  # in which a drive answers what it sees, if that takes longer


class HaltState(Enum):
    """Whether an axis is halted, and what will end that."""

    ENDED = 'it is not halted'
    HELD = 'bit 8 is set, or the set-points were braked; no target is on its way'
    UNANSWERED = 'as held: the drive has not taken the target that was to end the halt'
    LEAVING = 'a target is on its way that will end it'
    LIFTED = 'so it is, and bit 8 went with its bit 4: the acknowledge is awaited'


class Halt:
    """Holds a drive until a target that came later has been handed over.

    A set-point of mode 1 is offered while bit 8 is set, so that a move of before cannot go on. A
    drive that does not acknowledge there gets it once more in the controlword that takes bit 8
    back, and from then on always so; at the end of its halt it has no other target to go to.
    Where that one is not acknowledged either, it is halted again.
    """

    def __init__(self) -> None:
        self.state = HaltState.ENDED
        self._leaving_since = 0.0
        self._delivery = completed()
        self._offered_since: float | None = None
        self._ends_in: OperationMode | None = None
        self._ends_with_offer = False  # the drive sees no set-point under halt

    @property
    def held(self) -> bool:
        """Whether the drive is halted; the next target ends it."""
        return self.state is not HaltState.ENDED

    @property
    def leaving(self) -> bool:
        """Whether a target is on its way that will end it."""
        return self.state in (HaltState.LEAVING, HaltState.LIFTED)

    @property
    def rests(self) -> bool:
        """Whether the drive is halted, and no target is on its way that will end it."""
        return self.state in (HaltState.HELD, HaltState.UNANSWERED)

    def hold(self) -> None:
        """Halt; whatever would have ended an earlier halt does not end this one."""
        self._enter(HaltState.HELD)

    def release(self) -> None:
        """End it at once: there is nothing old that could go on."""
        self._enter(HaltState.ENDED)

    def leave(self, now: float, delivery: Promise[None]) -> None:
        """End it when the drive has taken the target that was commanded at ``now`` in [s].

        Where the drive refuses its delivery, the halt goes on.
        """
        if self.rests:
            self.state = HaltState.LEAVING
        if self.held:
            self._leaving_since, self._delivery = now, delivery

    def end_in(self, mode: OperationMode) -> None:
        """End it when the drive shows another mode, in which it has no target yet."""
        if self.held:
            self._ends_in = mode

    def bits(self, mode: Mode) -> int:
        """Return bit 8 for a drive that is moved, or was moved last, by a mode."""
        sets = self.held and self.state is not HaltState.LIFTED and mode.halts_by_bit
        return HALT_BIT if sets else NO_BITS

    def advance(self, now: float, period: float, mode: Mode) -> bool:
        """End it where that is due, for a drive that acts on a mode.

        Returns:
            False when the drive has not taken its new target in time, and stays halted.
        """
        if self._ends_in is mode.number:
            self.release()
        if not self.leaving:
            return True
        if self._delivery.error is not None:
            self.hold()
        elif mode.taken:
            self.release()
        elif isinstance(mode, ProfilePosition) and not self._advance_offer(now, period, mode):
            if not mode.goes_on_unanswered():  # else it is not known to acknowledge anything
                return self._hold_unanswered()
            self._ends_with_offer = False
            self.release()
        elif now - self._leaving_since > RESUME_TIMEOUT:
            return self._hold_unanswered()
        return True

    def _advance_offer(self, now: float, period: float, mode: ProfilePosition) -> bool:
        """Offer a set-point under halt, then without; False when neither is acknowledged."""
        if self._offered_since is None:
            if mode.offered:
                self._offered_since = now
                self.state = HaltState.LIFTED if self._ends_with_offer else HaltState.LEAVING
            return True
        waited, answers = now - self._offered_since, ANSWER_CYCLES * period
        if self.state is HaltState.LIFTED:
            return waited <= max(RELEASED_TIME, answers)
        if waited > max(UNDER_HALT_TIME, answers):
            self._offered_since = None
            self._ends_with_offer = True
            mode.offer_again()
        return True

    def _hold_unanswered(self) -> bool:
        self._enter(HaltState.UNANSWERED)
        self._ends_with_offer = False
        return False

    def _enter(self, state: HaltState) -> None:
        self.state = state
        self._offered_since = self._ends_in = None

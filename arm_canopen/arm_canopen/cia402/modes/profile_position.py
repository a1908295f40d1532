# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Mode 1, profile position: moves and the handshake by which the drive takes them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import Enum
import math

from canopen_core import DriveError
from canopen_core.standard import Controlword, OperationMode, Statusword

from ...master.process_image import Writer
from ...master.scheduler import completed, Promise
from ..state import Actual, AxisState
from .mode import Mode, TARGET_REACHED

ACKNOWLEDGE = int(Statusword.SET_POINT_ACKNOWLEDGE)
NEW_SET_POINT = int(Controlword.NEW_SET_POINT)
CHANGE_IMMEDIATELY = int(Controlword.CHANGE_IMMEDIATELY)
ACKNOWLEDGE_TIMEOUT = 1.0  # [s] a drive acknowledges a set-point within a few cycles
QUEUE_MAX = 16  # moves that may wait for the drive
EDGE_CYCLES = 3  # of SYNC in which a drive sees bit 4 change
NEAR_INC = 10  # [inc] from its destination at which an axis has no way to go
STOPPED = 'it was stopped before the drive had it'
FULL_AFTER = 0.1  # [s] after which bit 12 is no late answer any more, but a full buffer


@dataclass(frozen=True, slots=True)
class Move:
    """A set-point of mode 1, and how the drive shall take it (CiA 402-2, 10.3)."""

    target: float  # position in user units; a distance when it is relative
    relative: bool = False  # from the last set-point on (bit 6)
    immediate: bool = True  # at once, ending the move that runs (bit 5); else after it
    blend: bool = False  # pass the set-point before at speed instead of stopping there (bit 9)

    @property
    def bits(self) -> int:
        """Its bits in the controlword."""
        bits = Controlword(0)
        if self.relative:
            bits |= Controlword.RELATIVE
        if self.immediate:
            bits |= Controlword.CHANGE_IMMEDIATELY
        if self.blend:
            bits |= Controlword.CHANGE_ON_SET_POINT
        return int(bits)


class Handshake(Enum):
    """Where the exchange of a set-point stands (CiA 402-2, 10.3)."""

    IDLE = 'the drive takes a set-point'
    WRITTEN = 'the value is on its way, bit 4 follows in the next cycle'
    OFFERED = 'bit 4 is set, the drive has not acknowledged yet'
    RELEASED = 'acknowledged, bit 4 is cleared, the drive still shows bit 12'
    WITHDRAWN = 'bit 4 is cleared without an acknowledge, until the drive has seen that'
    FORCED = 'bit 4 is set though the buffer is full (bit 12): an immediate move empties it'
    AWAITED = 'bit 4 is cleared after that; bit 12 goes when the set-point was taken'


@dataclass(frozen=True, slots=True)
class Waiting:
    """A move that waits for the drive."""

    value: int  # what is written to 0x607A
    move: Move  # the move
    destination: float  # where it ends in user units
    # done when the drive has it
    delivery: Promise[None] = field(default_factory=Promise, compare=False)

    def note_sent(self, sent: Promise[None]) -> None:
        """Reject the delivery where the drive has refused the value."""
        if sent.error is not None:
            self.delivery.reject(sent.error)


class ProfilePosition(Mode):
    """Mode 1: the drive makes the profile; set-points are handed over by bits 4 and 12.

    Of immediate moves the newest counts: it replaces those that still wait for the handshake.
    Others queue, and none of them is lost; relative ones too, for each counts from the one before.

    The delivery of a move is done when the drive has acknowledged it. A drive that acts on a
    set-point, but has never raised bit 12, does not do so at all, which is reported once. From
    then on a set-point counts as taken when it was offered, and a move that waits for the one
    before follows bit 10 (target reached).
    """

    number = OperationMode.PROFILE_POSITION

    def __init__(
        self,
        view: AxisState,
        target: Writer,
        warn: Callable[[str], None],
        *,
        target_leads: bool,
    ) -> None:
        """With ``target_leads`` the value leaves a cycle ahead.

        The mapping then does not make sure that a drive sees 0x607A before bit 4 of the same
        cycle.
        """
        self._target_leads = target_leads
        self._view = view
        self._units = view.units
        self._target = target
        self._warn = warn
        self._queue: deque[Waiting] = deque()
        self._bits = CHANGE_IMMEDIATELY
        self._offered_at = 0.0
        self._full_since: float | None = None
        self._imposed: Waiting | None = None
        self._cycles_left = 0
        self.setpoint: float | None = None  # of the last move that was handed over
        self.by_sdo = target.by_sdo
        self._reference: float | None = None
        self._taken = False
        self._acknowledges: bool | None = None  # None until the drive has shown it
        self._offered: Waiting | None = None
        self._acts = False  # bit 10 has gone since the set-point was offered
        self._delivery = completed()
        self.handshake = Handshake.IDLE

    @property
    def taken(self) -> bool:
        """Whether the drive has acknowledged a set-point after the last brake."""
        return self._taken

    @property
    def offered(self) -> bool:
        """Whether bit 4 is set and bit 12 awaited; not where it was set before (full buffer)."""
        return self.handshake is Handshake.OFFERED

    def reached(self, statusword: int) -> bool:
        """Whether the drive has taken all moves, and shows the end of the last one (bit 10)."""
        handed_over = self.handshake is Handshake.IDLE and not self._queue
        return handed_over and super().reached(statusword)

    @property
    def waiting(self) -> int:
        """Number of moves that have not been handed over."""
        return len(self._queue)

    def preload(self, actual: Actual) -> Promise[None]:
        """Write the actual position as the target, without announcing it."""
        self._forget()
        self._bits = CHANGE_IMMEDIATELY
        self.setpoint = self._reference = self._units.position.commanded(actual.position_inc)
        return self._target.deliver(actual.position_inc)

    def brake(self) -> None:
        """Forget what the drive has not taken; what it has taken is halted by bit 8."""
        self._forget()
        self._reference = None

    def set_target(self, target: float) -> Promise[None]:
        """Go to a position at once."""
        return self.move(Move(target))

    def destination(self, move: Move) -> float:
        """Return where a move ends, in user units.

        Raises:
            DriveError: It is relative, and what it counts from was halted or never acknowledged.
        """
        if not move.relative:
            return move.target
        reference = self._queue[-1].destination if self._queue else self._reference
        if reference is None:
            raise DriveError(
                'a relative move counts from the last set-point, which was halted or not '
                'acknowledged; command an absolute position first'
            )
        return reference + move.target

    def move(self, move: Move) -> Promise[None]:
        """Queue a move for the handshake.

        Returns:
            Done when the drive has its value, or a newer one that has replaced it.

        Raises:
            DriveError: The value does not fit 0x607A, too many moves wait, or it is relative and
                there is nothing to count from.
        """
        scale = self._units.distance if move.relative else self._units.position
        value = scale.to_device(move.target, self._target.limits)
        waiting = Waiting(value, move, self.destination(move))
        if move.immediate and not move.relative:
            waiting = replace(waiting, delivery=self._replaced())
        elif len(self._queue) >= QUEUE_MAX:
            raise DriveError(
                f'{QUEUE_MAX} moves wait for the drive already; send the next one later'
            )
        self._queue.append(waiting)
        return waiting.delivery

    def withdraw(self, delivery: Promise[None], error: DriveError) -> None:
        """Forget a move that has not been offered, and those behind it, which count from it."""
        delivery.reject(error)  # where its value is on its way, it is not offered any more
        if self.offered and self._offered is not None and self._offered.delivery is delivery:
            self._withdraw()
        deliveries = [waiting.delivery for waiting in self._queue]
        if delivery in deliveries:
            place = deliveries.index(delivery)
            if behind := len(deliveries) - place - 1:
                self._warn(f'a move was withdrawn, and {behind} behind it, too')
            self._drop_waiting(f'the move before it was withdrawn: {error}', keep=place)

    def step(self, now: float, period: float, statusword: int) -> int:
        """Advance the handshake."""
        acknowledged = bool(statusword & ACKNOWLEDGE)
        if self.handshake is Handshake.OFFERED:
            self._acts |= not statusword & TARGET_REACHED
            self._watch_acknowledge(now, acknowledged=acknowledged)
        elif self.handshake is Handshake.WRITTEN:
            self._watch_delivery(now, acknowledged=acknowledged)
        elif self.handshake in (Handshake.WITHDRAWN, Handshake.FORCED):
            self._show_edge(now)
        elif self.handshake is Handshake.AWAITED:
            timeout = max(FULL_AFTER, EDGE_CYCLES * period)
            self._watch_emptied(now, timeout, acknowledged=acknowledged)
        elif acknowledged:
            self._watch_full(now)
        elif self._follows_at_once or statusword & TARGET_REACHED:
            self._full_since = self._imposed = None
            self._hand_over(now, acknowledged=False)
        if self.handshake in (Handshake.OFFERED, Handshake.FORCED):
            return self._bits | NEW_SET_POINT
        return self._bits

    @property
    def _follows_at_once(self) -> bool:
        """Whether the next move may be offered while the one before runs."""
        waits = bool(self._queue) and not self._queue[0].move.immediate
        return self._acknowledges is not False or not waits

    def _forget(self) -> None:
        self._drop_waiting(STOPPED)
        if self._offered is not None:
            self._offered.delivery.reject(DriveError(STOPPED))
        self._offered = self._imposed = None
        self._taken = False
        if self.handshake in (Handshake.OFFERED, Handshake.FORCED):
            self.handshake = Handshake.WITHDRAWN
            self._cycles_left = EDGE_CYCLES
        elif self.handshake is not Handshake.WITHDRAWN:
            self.handshake = Handshake.IDLE

    def _hand_over(self, now: float, *, acknowledged: bool) -> None:
        self.handshake = Handshake.IDLE
        if not self._queue:
            return
        self._offered = waiting = self._queue.popleft()
        self._delivery = self._target.deliver(waiting.value)
        self._delivery.when_done(waiting.note_sent)
        self._bits = waiting.move.bits
        self._reference = waiting.destination
        if self._target_leads or not self._delivery.done:
            self.handshake = Handshake.WRITTEN
        else:
            self._watch_delivery(now, acknowledged=acknowledged)

    def _watch_delivery(self, now: float, *, acknowledged: bool) -> None:
        """Offer what the drive has; what it has refused moves nothing, nor what counts from it."""
        withdrawn = self._offered.delivery.error if self._offered is not None else None
        error = self._delivery.error or withdrawn
        if error is not None:
            self.handshake = Handshake.IDLE
            self._reference = None
            self._drop_waiting(f'the drive does not have the move before it: {error}')
        elif self._delivery.done:
            self._offer(now, acknowledged=acknowledged)

    def _replaced(self) -> Promise[None]:
        """Drop the moves that wait; return the promise that they all end with."""
        replaced = [move.delivery for move in self._queue if not move.delivery.done]
        self._queue.clear()
        delivery: Promise[None] = replaced.pop() if replaced else Promise()
        for older in replaced:
            older.follow(delivery)
        return delivery

    def _drop_waiting(self, reason: str, *, keep: int = 0) -> None:
        """Forget the moves that have not been handed over, but for the first ones."""
        while len(self._queue) > keep:
            self._queue.pop().delivery.reject(DriveError(reason))

    def _offer(self, now: float, *, acknowledged: bool) -> None:
        if self._offered is not None:
            self.setpoint = self._offered.destination
        self._offered_at = now
        self._cycles_left = EDGE_CYCLES
        self._acts = False
        if self._acknowledges is False:
            self._take()
        self.handshake = Handshake.FORCED if acknowledged else Handshake.OFFERED

    def _show_edge(self, now: float) -> None:
        self._cycles_left -= 1
        if self._cycles_left > 0:
            return
        self._offered_at = now
        imposed = self.handshake is Handshake.FORCED
        self.handshake = Handshake.AWAITED if imposed else Handshake.IDLE

    def _watch_full(self, now: float) -> None:
        """Bit 12 stays, so the buffer of the drive is full; an immediate move empties it.

        CiA 402-2, 10.3.2: with bit 5 a set-point is processed at once, and those that wait in
        the drive are discarded. Others wait until the move that runs has ended; so do relative
        ones, which must not be offered twice.
        """
        move = self._queue[0].move if self._queue else None
        if move is None or move.relative or not move.immediate:
            self._full_since = None
        elif self._full_since is None:
            self._full_since = now
        elif self._imposed is None and now - self._full_since > FULL_AFTER:
            self._imposed = self._queue[0]
            self._hand_over(now, acknowledged=True)
        elif ACKNOWLEDGE_TIMEOUT < now - self._full_since < math.inf:
            self._full_since = math.inf  # said once
            self._warn(
                f'bit 12 has been set for {ACKNOWLEDGE_TIMEOUT:g} s, so a new set-point cannot be '
                'handed over; it will be when the drive takes the bit back'
            )

    def _watch_emptied(self, now: float, timeout: float, *, acknowledged: bool) -> None:
        """See whether a full drive has taken an immediate move; else it is handed over later."""
        imposed = self._imposed
        if not acknowledged:
            self._imposed = None
            self._take()
            self._hand_over(now, acknowledged=False)
        elif now - self._offered_at > timeout:
            self.handshake = Handshake.RELEASED
            self._offer_later(imposed)

    def offer_again(self) -> None:
        """Clear bit 4 until the drive has seen that, and offer the newest target."""
        if self.handshake is not Handshake.OFFERED:
            return
        self._offer_later(self._offered)
        self._withdraw()

    def goes_on_unanswered(self) -> bool:
        """Count a set-point as taken where the drive has never acknowledged one."""
        if self._acknowledges is None and self.handshake is Handshake.OFFERED:
            self._never_acknowledged()
            return True
        return False

    @property
    def _is_replaced(self) -> bool:
        """Whether the next move makes the one that is offered needless."""
        move = self._queue[0].move if self._queue else None
        return move is not None and move.immediate and not move.relative

    def _watch_acknowledge(self, now: float, *, acknowledged: bool) -> None:
        if acknowledged:
            self._acknowledges = True
            self._take()
            self.handshake = Handshake.RELEASED
        elif self._acknowledges is False:
            self._cycles_left -= 1
            if self._cycles_left <= 0:
                self._withdraw()
        elif now - self._offered_at > ACKNOWLEDGE_TIMEOUT:
            self._not_acknowledged()

    def _take(self) -> None:
        """The drive has the set-point that was offered."""
        self._taken = True
        if self._offered is not None:
            self._offered.delivery.resolve(None)

    def _offer_later(self, waiting: Waiting | None) -> None:
        """Offer a set-point once more, unless the next one replaces it."""
        if waiting is None:
            return
        if self._is_replaced:
            waiting.delivery.follow(self._queue[0].delivery)
        else:
            self._queue.appendleft(waiting)

    def _withdraw(self) -> None:
        self.handshake = Handshake.WITHDRAWN
        self._cycles_left = EDGE_CYCLES

    def _never_acknowledged(self) -> None:
        """Go on without bit 12; an absolute move is offered again, as it may have met a halt."""
        self._acknowledges = False
        offered = self._offered
        if offered is not None and offered.move.immediate and not offered.move.relative:
            self._offer_later(offered)
        else:
            self._take()
        self._withdraw()
        self._warn(
            f'set-points are not acknowledged (bit 12 did not come within {ACKNOWLEDGE_TIMEOUT:g} '
            's): from now on they count as taken, and queued moves wait for bit 10 (target '
            'reached)'
        )

    def _not_acknowledged(self) -> None:
        """Conclude from an acknowledge that has not come in time, and from what the axis does."""
        offered, view = self._offered, self._view
        there = offered is None or (
            abs(self._units.position.raw(offered.destination) - view.position_inc) <= NEAR_INC
        )
        acts = self._acts or there or not view.stands
        if self._acknowledges is None and acts:
            self._never_acknowledged()
            return
        self._reference = None
        self._withdraw()
        text = f'the set-point was not acknowledged within {ACKNOWLEDGE_TIMEOUT:g} s (bit 12)'
        self._warn(f'{text}; it may not have been taken')
        if acts:
            self._take()
        elif offered is not None:
            offered.delivery.reject(DriveError(text))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""EMCY, SYNC and TIME as a device sends and receives them (CiA 301, 7.2.5 to 7.2.7)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import contextlib
from datetime import datetime, timedelta

from canopen_core import CodecError
from canopen_core.can import Frame
from canopen_core.standard import (
    AbortCode,
    CAN_ID_MASK,
    COB_ID_INVALID,
    CobId,
    decode_time_of_day,
    Emergency,
    Index,
    SYNC_PRODUCER,
    TIME_CONSUMER,
    TIME_PRODUCER,
    Value,
)

from .object_store import (
    check_can_id,
    check_cob_id,
    FRAME_BITS,
    Integer,
    NEVER,
    ObjectStore,
    refusal,
)

GENERIC_ERROR = 0x01
GENERIC_CODE = 0x1000
REGISTER_BITS: tuple[tuple[int, int, int], ...] = (
    (0x2000, 0x2FFF, 1 << 1),  # current
    (0x3000, 0x3FFF, 1 << 2),  # voltage
    (0x4000, 0x4FFF, 1 << 3),  # temperature
    (0x8100, 0x82FF, 1 << 4),  # communication
    (0x8300, 0x8FFF, 1 << 5),  # device profile specific
    (0xFF00, 0xFFFF, 1 << 7),  # manufacturer specific
)
"""First code, last code and bit of the error register (CiA 301, tables 26 and 48)."""

INHIBIT_UNIT = 0.0001  # [s] 0x1015 counts 100 us
PENDING_MAX = 16  # messages kept while none may be sent


def register_bits(code: int) -> int:
    """Return the bits of the error register 0x1001 that belong to an error code."""
    for first, last, bit in REGISTER_BITS:
        if first <= code <= last:
            return GENERIC_ERROR | bit
    return GENERIC_ERROR


class EmcyProducer:
    """Keeps the active errors (0x1001) and their history (0x1003), and sends EMCY."""

    def __init__(self, store: ObjectStore, send: Callable[[Frame], None]) -> None:
        self._flush_at = self._repeat_at = NEVER
        self._repeat_period = 0.0
        self._last = Emergency(GENERIC_CODE, GENERIC_ERROR)
        self._send = send
        self._register = store.integer(Index.ERROR_REGISTER)
        self._cob_id = store.integer(Index.EMCY_COB_ID, default=COB_ID_INVALID)
        self._cob_id.check = lambda value: check_cob_id(self._cob_id, value)
        self._inhibit = store.integer(Index.EMCY_INHIBIT_TIME)  # [100 us]
        self._active: dict[int, set[object]] = {}  # who has an error, by its code
        self._pending: deque[Emergency] = deque(maxlen=PENDING_MAX)
        self._allowed = False
        self._next_time = 0.0
        self._count = store.integer(Index.PREDEFINED_ERROR_FIELD)
        self._count.check = self._check_count
        self._count.listener = self._clear_history
        self._history = [
            store.integer(Index.PREDEFINED_ERROR_FIELD, entry.subindex)
            for entry in store.dictionary.subindices(Index.PREDEFINED_ERROR_FIELD)
            if entry.subindex > 0
        ]
        for number, variable in enumerate(self._history, start=1):
            variable.before_read = _presence_check(self._count, number, variable)

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which a message is due."""
        return min(self._flush_at, self._repeat_at)

    def reset(self) -> None:
        """Clear all errors, as after power-on."""
        self._active.clear()
        self._pending.clear()
        self._register.value = 0
        self._next_time = 0.0
        self._flush_at = NEVER

    def allow(self, allowed: bool, now: float) -> None:
        """Allow EMCY messages, or suppress them (NMT Stopped)."""
        self._allowed = allowed
        self._flush(now)

    def report(
        self, code: int, now: float, source: object = None, vendor: bytes = bytes(5)
    ) -> None:
        """Report an error, unless it is already active.

        ``source`` is its origin, such as an axis; the error is gone when all sources cleared it.
        """
        sources = self._active.setdefault(code, set())
        known = bool(sources)
        sources.add(source)
        if known:
            return
        self._update_register()
        self._record(code)
        self._last = Emergency(code, self._register.value, vendor)
        self._queue(self._last, now)

    def set_error(self, code: int, present: bool, now: float, source: object = None) -> None:
        """Report an error if it is present at a time in [s], else clear it."""
        if present:
            self.report(code, now, source)
        else:
            self.clear(code, now, source)

    def clear(self, code: int, now: float, source: object = None) -> None:
        """Report that an error is gone; the error register in the message has the other ones."""
        sources = self._active.get(code, set())
        sources.discard(source)
        if sources or code not in self._active:
            return
        del self._active[code]
        self._update_register()
        self._queue(Emergency(0, self._register.value), now)

    def advance(self, now: float) -> None:
        """Send messages delayed by the inhibit time."""
        if now >= self._repeat_at:
            self._repeat_at = now + self._repeat_period
            self._queue(self._last, now)
        elif now >= self._flush_at:
            self._flush(now)

    def repeat(self, period: float, now: float) -> None:
        """Repeat the last EMCY of an error periodically from a time in [s] on; 0 stops that."""
        self._repeat_period = period
        self._repeat_at = now if period else NEVER

    def _update_register(self) -> None:
        value = 0
        for code in self._active:
            value |= register_bits(code)
        self._register.value = value

    def _record(self, code: int) -> None:
        # the newest error stands in sub-index 1 (CiA 301, 7.5.2.4)
        for older, newer in zip(self._history[:0:-1], self._history[-2::-1], strict=True):
            older.value = newer.value
        if self._history:
            self._history[0].value = code
            self._count.value = min(self._count.value + 1, len(self._history))

    def _queue(self, emergency: Emergency, now: float) -> None:
        self._pending.append(emergency)
        self._flush(now)

    def _flush(self, now: float) -> None:
        self._flush_at = NEVER
        while self._pending and self._allowed:
            if now < self._next_time:
                self._flush_at = self._next_time
                return
            emergency = self._pending.popleft()
            if not self._cob_id.value & COB_ID_INVALID:
                self._send(Frame(self._cob_id.value & CAN_ID_MASK, emergency.encode()))
                self._next_time = now + self._inhibit.value * INHIBIT_UNIT

    def _check_count(self, value: Value) -> None:
        if value != 0:  # writing 0 erases the history, nothing else may be written
            raise refusal(AbortCode.VALUE_RANGE, self._count.entry)

    def _clear_history(self, _now: float) -> None:
        for variable in self._history:
            variable.value = 0


def _presence_check(count: Integer, number: int, variable: Integer) -> Callable[[], None]:
    def check() -> None:
        if number > count.value:
            raise refusal(AbortCode.NO_DATA, variable.entry)

    return check


MICROSECOND = 1e-6  # [s]
PERIOD_WEIGHT = 0.125  # weight of a new interval in the measured period
PERIOD_MAX = 1.0  # [s] a longer interval is a pause
LOST_PERIODS = 3.0  # SYNC is gone after so many periods without one


class SyncConsumer:
    """Counts SYNC messages and measures their period."""

    def __init__(
        self,
        store: ObjectStore,
        handle: Callable[[int, float], None],
        length_error: Callable[[bool, float], None],
        changed: Callable[[], None],
    ) -> None:
        """Bind 0x1005, 0x1006, 0x1007 and 0x1019.

        ``handle`` is called with the counter (0 without one) and the time of each SYNC,
        ``length_error`` with whether its length was wrong, and ``changed`` when the identifier of
        SYNC has changed.
        """
        # time between two SYNCs in [s], from 0x1006 or else measured; 0 when unknown
        self.period = 0.0
        self.last_time = float('-inf')  # steady time of the last SYNC in [s]
        self._paused = False
        self._handle = handle
        self._length_error = length_error
        self._changed = changed
        self._cob_id = store.integer(Index.SYNC_COB_ID, default=CobId.SYNC)
        self._cob_id.check = self._check_cob_id
        self._cob_id.listener = lambda _now: self._changed()
        self._cycle = store.integer(Index.CYCLE_PERIOD)  # [us]
        self._cycle.listener = lambda _now: self.reset()
        self._overflow = store.integer(Index.SYNC_OVERFLOW)
        self._window = store.integer(Index.SYNC_WINDOW)  # [us]

    @property
    def can_id(self) -> int:
        """Identifier of the SYNC message."""
        return self._cob_id.value & CAN_ID_MASK

    def alive(self, now: float) -> bool:
        """Return whether SYNC arrives regularly at this time."""
        return self.period > 0.0 and now - self.last_time < LOST_PERIODS * self.period

    def window_closed(self, now: float) -> bool:
        """Return whether it is too late for synchronous PDOs of this period (0x1007)."""
        window = self._window.value * MICROSECOND
        return window > 0.0 and now - self.last_time > window

    def reset(self) -> None:
        """Discard the measured period."""
        self.period = self._cycle.value * MICROSECOND
        self.last_time = float('-inf')
        self._paused = False

    def receive(self, frame: Frame, now: float) -> None:
        """Process a SYNC, and report a wrong length."""
        self._length_error(len(frame.data) != bool(self._overflow.value), now)
        if not self._cycle.value:
            self._measure(now)
        self.last_time = now
        self._handle(frame.data[0] if frame.data else 0, now)

    def _measure(self, now: float) -> None:
        interval = now - self.last_time
        if self.alive(now):
            self.period += PERIOD_WEIGHT * (interval - self.period)
            self._paused = False
        elif self.period and not self._paused:
            self._paused = True  # one long interval is a pause, two are another period
        else:
            self.period = interval if interval < PERIOD_MAX else 0.0
            self._paused = False

    def _check_cob_id(self, value: Value) -> None:
        if isinstance(value, int) and value & SYNC_PRODUCER:
            raise refusal(AbortCode.VALUE_RANGE, self._cob_id.entry)
        check_can_id(self._cob_id.entry, value)


class TimeConsumer:
    """Keeps the network's time of the last TIME message."""

    def __init__(self, store: ObjectStore, changed: Callable[[], None]) -> None:
        """Bind 0x1012; ``changed`` is called when it enables TIME or changes the identifier."""
        self._cob_id = store.integer(Index.TIME_COB_ID)
        self._cob_id.check = self._check
        self._cob_id.listener = lambda _now: changed()
        self._received: tuple[datetime, float] | None = None

    @property
    def can_id(self) -> int | None:
        """Identifier of the TIME message; None if the device does not consume TIME."""
        value = self._cob_id.value
        return value & CAN_ID_MASK if value & TIME_CONSUMER else None

    def at(self, now: float) -> datetime | None:
        """Return the network's time at steady time ``now`` in [s], None before any message."""
        if self._received is None:
            return None
        time, moment = self._received
        return time + timedelta(seconds=now - moment)

    def reset(self) -> None:
        """Discard the time, as after power-on."""
        self._received = None

    def receive(self, frame: Frame, now: float) -> None:
        """Process a TIME message; ignore one with the wrong length."""
        with contextlib.suppress(CodecError):
            self._received = decode_time_of_day(frame.data), now

    def _check(self, value: Value) -> None:
        word, held = int(value) if isinstance(value, int) else 0, self._cob_id.value
        used = TIME_CONSUMER | TIME_PRODUCER
        if word & used and held & used and (word ^ held) & FRAME_BITS:
            raise refusal(AbortCode.VALUE_RANGE, self._cob_id.entry)
        check_can_id(self._cob_id.entry, word & CAN_ID_MASK)

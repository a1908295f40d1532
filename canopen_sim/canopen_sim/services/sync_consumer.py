# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SYNC as a device sees it (CiA 301, 7.2.5)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.can import Frame
from canopen_core.standard import (
    AbortCode,
    CAN_ID_MASK,
    CobId,
    Index,
    SYNC_PRODUCER,
    Value,
)

from ..objects.object_store import check_can_id, ObjectStore, refusal

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
        ``length_error`` with whether its length was wrong, and ``changed`` when SYNC has another
        identifier from now on.
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
        """Return whether SYNC comes regularly at this time."""
        return self.period > 0.0 and now - self.last_time < LOST_PERIODS * self.period

    def window_closed(self, now: float) -> bool:
        """Return whether it is too late for synchronous PDOs of this period (0x1007)."""
        window = self._window.value * MICROSECOND
        return window > 0.0 and now - self.last_time > window

    def reset(self) -> None:
        """Forget what was measured."""
        self.period = self._cycle.value * MICROSECOND
        self.last_time = float('-inf')
        self._paused = False

    def receive(self, frame: Frame, now: float) -> None:
        """Process a SYNC; one of the wrong length is reported as well."""
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

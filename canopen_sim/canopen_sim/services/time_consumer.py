# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Network time as a device takes it (CiA 301, 7.2.6 and 7.5.2.15)."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
from datetime import datetime, timedelta

from canopen_core import CodecError
from canopen_core.can import Frame
from canopen_core.standard import (
    AbortCode,
    CAN_ID_MASK,
    decode_time_of_day,
    Index,
    TIME_CONSUMER,
    TIME_PRODUCER,
    Value,
)

from ..objects.object_store import check_can_id, FRAME_BITS, ObjectStore, refusal


class TimeConsumer:
    """Keeps the network's time of the last TIME message."""

    def __init__(self, store: ObjectStore, changed: Callable[[], None]) -> None:
        """Bind 0x1012; ``changed`` is called when TIME is wanted, or under another identifier."""
        self._cob_id = store.integer(Index.TIME_COB_ID)
        self._cob_id.check = self._check
        self._cob_id.listener = lambda _now: changed()
        self._received: tuple[datetime, float] | None = None

    @property
    def can_id(self) -> int | None:
        """Identifier of the TIME message, None when the device takes none."""
        value = self._cob_id.value
        return value & CAN_ID_MASK if value & TIME_CONSUMER else None

    def at(self, now: float) -> datetime | None:
        """Return the network's time at steady time ``now`` in [s], None before any message."""
        if self._received is None:
            return None
        time, moment = self._received
        return time + timedelta(seconds=now - moment)

    def reset(self) -> None:
        """Forget the time, as after switching on."""
        self._received = None

    def receive(self, frame: Frame, now: float) -> None:
        """Process a TIME message; one of another length is ignored."""
        with contextlib.suppress(CodecError):
            self._received = decode_time_of_day(frame.data), now

    def _check(self, value: Value) -> None:
        word, held = int(value) if isinstance(value, int) else 0, self._cob_id.value
        used = TIME_CONSUMER | TIME_PRODUCER
        if word & used and held & used and (word ^ held) & FRAME_BITS:
            raise refusal(AbortCode.VALUE_RANGE, self._cob_id.entry)
        check_can_id(self._cob_id.entry, word & CAN_ID_MASK)

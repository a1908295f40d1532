# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The EMCYs of one device (CiA 301, 7.2.7)."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
import math

from canopen_core import CodecError
from canopen_core.can import Frame
from canopen_core.standard import Emergency, error_code_text

from .events import EventKind, Severity

HISTORY = 16  # EMCYs that are remembered
REPEAT_PERIOD = 10.0  # [s] in which one that comes again is counted, and not reported
REPORTS_MAX = 8  # that are reported in that time, whatever they are
NAMED_MAX = 3  # codes that a count names


class EmergencyLog:
    """Reports each EMCY in words, and remembers the last ones.

    One that comes again and again, or many that alternate, are a flood: it is reported once in
    :data:`REPEAT_PERIOD`, with the number of its messages, until none has come for that long.
    """

    def __init__(self, report: Callable[[EventKind, Severity, str], None]) -> None:
        # the last EMCYs, the newest at the end, with the steady time of each in [s]; of a flood
        # each one once
        self.history: deque[tuple[float, Emergency]] = deque(maxlen=HISTORY)
        # last one that was no reset, None when the device reported its end
        self.last: Emergency | None = None
        self._report = report
        self._came: dict[str, float] = {}
        self._newest = ''
        self._reported: deque[float] = deque(maxlen=REPORTS_MAX)
        self._repeats: Counter[str] = Counter()
        self._counted_since = 0.0
        self._counted_at = -REPEAT_PERIOD

    def since(self, begin: float) -> Emergency | None:
        """Return the last EMCY, when it came after a steady time in [s] and was no reset."""
        if self.last is None or not self.history or self.history[-1][0] < begin:
            return None
        return self.last

    def restarted(self) -> None:
        """The device restarted: whatever it was, it ended with that."""
        self.last = None
        self._came.clear()
        self._newest = ''

    def receive(self, frame: Frame) -> None:
        """Store an EMCY message."""
        try:
            emergency = Emergency.decode(frame.data)
        except CodecError as error:
            text = f'odd EMCY: {error}'
            self._report_or_count(Severity.WARNING, text, 'odd', frame.timestamp)
            return
        now = frame.timestamp
        for entry in list(self.history):
            if entry[1] == emergency and now - entry[0] < REPEAT_PERIOD:
                self.history.remove(entry)
        self.history.append((now, emergency))
        self.last = None if emergency.is_reset else emergency
        severity = Severity.INFO if emergency.is_reset else Severity.ERROR
        code = error_code_text(emergency.code)
        self._report_or_count(severity, f'EMCY: {emergency}', code, now)

    def look(self, now: float) -> None:
        """Report the number of those that were only counted, where that is due."""
        counted = now - self._counted_since
        if not self._repeats or counted < REPEAT_PERIOD:
            return
        repeats, self._repeats = self._repeats, Counter()
        named = ', '.join(f'{count} x {name}' for name, count in repeats.most_common(NAMED_MAX))
        others = ', and others' if len(repeats) > NAMED_MAX else ''
        text = f'EMCY: {repeats.total()} more in {counted:.0f} s ({named}{others})'
        self._report(EventKind.EMERGENCY, Severity.WARNING, text)

    def _report_or_count(self, severity: Severity, text: str, name: str, now: float) -> None:
        newest, self._newest = self._newest, text
        came_before = now - self._came.get(name, -math.inf) < REPEAT_PERIOD
        self._came[name] = now
        flooded = now - self._counted_at < REPEAT_PERIOD
        full = len(self._reported) == REPORTS_MAX and now - self._reported[0] < REPEAT_PERIOD
        if not full and not (came_before and (flooded or text == newest)):
            self._reported.append(now)
            self._report(EventKind.EMERGENCY, severity, text)
            return
        if not self._repeats:
            self._counted_since = now
        self._repeats[name] += 1
        self._counted_at = now

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The EMCYs of one device (CiA 301, 7.2.7)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from ..can.frame import Frame
from ..exceptions import CodecError
from ..standard.emcy import Emergency
from .events import EventKind, Severity

HISTORY = 16  # EMCYs that are remembered


class EmergencyLog:
    """Reports each EMCY in words, and remembers the last ones.

    Attributes:
        history: The last EMCYs, the newest at the end, with the steady time of each in [s].
        last: Last one that was no reset, None when the device reported its end.
    """

    def __init__(self, report: Callable[[EventKind, Severity, str], None]) -> None:
        """Begin without any.

        Args:
            report: Takes the events of the device.
        """
        self.history: deque[tuple[float, Emergency]] = deque(maxlen=HISTORY)
        self.last: Emergency | None = None
        self._report = report

    def since(self, begin: float) -> Emergency | None:
        """Return the last EMCY, when it came after a steady time in [s] and was no reset."""
        if self.last is None or not self.history or self.history[-1][0] < begin:
            return None
        return self.last

    def restarted(self) -> None:
        """The device restarted: whatever it was, it ended with that."""
        self.last = None

    def receive(self, frame: Frame) -> None:
        """Take an EMCY message."""
        try:
            emergency = Emergency.decode(frame.data)
        except CodecError as error:
            self._report(EventKind.EMERGENCY, Severity.WARNING, f'odd EMCY: {error}')
            return
        self.history.append((frame.timestamp, emergency))
        self.last = None if emergency.is_reset else emergency
        severity = Severity.INFO if emergency.is_reset else Severity.ERROR
        self._report(EventKind.EMERGENCY, severity, f'EMCY: {emergency}')

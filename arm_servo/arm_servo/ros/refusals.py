# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Why the last command was refused: for the status as long as it is fresh, for the log once."""

from __future__ import annotations

import math
import re

STATUS_PERIOD = 0.5  # how long a refusal stands in the status in [s]

REPEAT_PERIOD = 5.0
"""Time without a refusal after which one that was logged is logged again in [s]."""

NUMBER_PATTERN = re.compile(r'(?<![\w.])\d+(\.\d+)?')
"""What differs from message to message of one stream, such as the age of its stamps."""


class LoggedReasons:
    """Which reasons of one stream are in the log already."""

    def __init__(self) -> None:
        self._logged = ('', -math.inf)

    def is_new(self, reason: str, now: float) -> bool:
        """Return whether a reason is to be logged; one that differs in numbers only is not."""
        kind, (logged, seen) = NUMBER_PATTERN.sub('', reason), self._logged
        self._logged = (kind, now)
        return kind != logged or now - seen >= REPEAT_PERIOD


class Refusals:
    """Remembers the last refusal; any thread may note one, a single thread reports."""

    def __init__(self) -> None:
        self._last = ('', -math.inf)
        self._logged = LoggedReasons()

    def note(self, reason: str, now: float) -> None:
        """Note why a command was refused."""
        self._last = (reason, now)

    def clear(self, sent: float) -> None:
        """Note that a command of a time in [s] was taken: a refusal since then stands."""
        if self._last[1] <= sent:
            self._last = ('', -math.inf)

    def fresh(self, now: float) -> str:
        """Return the refusal for the status; empty when there is none."""
        reason, since = self._last
        return reason if now - since <= STATUS_PERIOD else ''

    def to_log(self, now: float) -> str:
        """Return the refusal if it is not in the log; one that differs in numbers only is."""
        reason = self.fresh(now)
        return reason if reason and self._logged.is_new(reason, now) else ''

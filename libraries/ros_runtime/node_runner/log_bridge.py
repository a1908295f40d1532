# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Forwards records of Python's ``logging`` to the ROS log: console and /rosout.

The layers without ROS (bus, cycle, serial link) log with ``logging``. Their threads must not wait
for DDS, so records are queued, and another thread logs them.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
import copy
from dataclasses import dataclass
import logging
import math
import threading
import time

from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.logging import get_logger
from rclpy.node import Node

BURST = 10  # records of one source within a window
WINDOW = 1.0  # [s]

QUEUE_LENGTH = 500
"""Maximum number of queued records; further ones are counted and dropped."""


@dataclass(slots=True)
class _Window:
    begin: float
    admitted: int = 0
    suppressed: int = 0


class LogRateLimit:
    """Admits the first records of each source in a window, and counts the others.

    Times are on the steady clock in [s].
    """

    def __init__(self, burst: int = BURST, window: float = WINDOW) -> None:
        self._burst = burst
        self._window = window
        self._windows: dict[Hashable, _Window] = {}

    def admit(self, source: Hashable, now: float) -> bool:
        """Return whether a record may be logged."""
        window = self._windows.setdefault(source, _Window(now))
        if window.admitted >= self._burst:
            window.suppressed += 1
            return False
        window.admitted += 1
        return True

    def collect(self, now: float) -> dict[Hashable, int]:
        """Close expired windows; return how many records of each source were dropped in them."""
        over = [
            source
            for source, window in self._windows.items()
            if now - window.begin >= self._window
        ]
        ended = {source: self._windows.pop(source) for source in over}
        return {source: window.suppressed for source, window in ended.items() if window.suppressed}

    @property
    def idle(self) -> bool:
        """Whether no window is open."""
        return not self._windows


class RosLogBridge(logging.Handler):
    """Logs the records of ``logging`` to ROS, in its own thread.

    From :meth:`attach` on, records are logged by a node and reach /rosout; before it, they reach
    only the console.
    """

    def __init__(
        self,
        name: str,
        *,
        limit: LogRateLimit | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Prepare without logging; ``name`` is the logger name until a node is attached."""
        super().__init__(logging.WARNING)
        self._logger = get_logger(name)
        self._attached = False
        self._limit = limit or LogRateLimit()
        self._clock = clock
        self._records: deque[logging.LogRecord] = deque()
        self._dropped = 0
        self._wake = threading.Event()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name='log bridge', daemon=True)

    def start(self) -> None:
        """Receive the records of all loggers."""
        self._thread.start()
        logging.getLogger().addHandler(self)

    def attach(self, node: Node) -> None:
        """Log as this node, unless one is already attached."""
        if not self._attached:
            self._attached = True
            self._logger = node.get_logger()

    def emit(self, record: logging.LogRecord) -> None:
        """Queue a record; never waits."""
        if not self._limit.admit(f'{record.name}:{record.lineno}', self._clock()):
            return
        if len(self._records) >= QUEUE_LENGTH:
            self._dropped += 1
            return
        queued = copy.copy(record)  # other handlers get the record, too
        queued.msg, queued.args = record.getMessage(), None  # what the arguments are may change
        self._records.append(queued)
        self._wake.set()

    def close(self) -> None:
        """Log the queued records, and end."""
        logging.getLogger().removeHandler(self)
        if self._thread.is_alive():
            self._closing = True
            self._wake.set()
            self._thread.join()
        super().close()

    def _run(self) -> None:
        while not self._closing:
            self._wake.wait(None if self._limit.idle else WINDOW)
            self._wake.clear()
            self._log_queued(self._clock())
        self._log_queued(math.inf)

    def _log_queued(self, now: float) -> None:
        while self._records:
            record = self._records.popleft()
            _log(self._logger, record.levelno, self.format(record))
        self.acquire()  # what emit changes
        try:
            dropped, self._dropped = self._dropped, 0
            suppressed = self._limit.collect(now)
        finally:
            self.release()
        for source, count in suppressed.items():
            _log(self._logger, logging.WARNING, f'{count} more records of {source} suppressed')
        if dropped:
            _log(self._logger, logging.WARNING, f'{dropped} records dropped, the queue was full')


def log_as(node: Node) -> None:
    """Log the records of this process's ``logging`` as those of a node.

    Only the first node of a process counts. Without :func:`.run_program` it does nothing.
    """
    for handler in logging.getLogger().handlers:
        if isinstance(handler, RosLogBridge):
            handler.attach(node)


def _log(logger: RcutilsLogger, level: int, message: str) -> None:
    """Log at a level; rclpy requires a call site of its own for each level."""
    if level >= logging.CRITICAL:
        logger.fatal(message)
    elif level >= logging.ERROR:
        logger.error(message)
    elif level >= logging.WARNING:
        logger.warning(message)
    else:
        logger.info(message)

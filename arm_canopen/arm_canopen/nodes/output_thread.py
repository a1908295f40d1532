# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One thread that publishes, answers and logs for the cycle, which must not wait for DDS."""

from __future__ import annotations

from collections.abc import Callable
from queue import SimpleQueue
import threading

from rclpy.impl.rcutils_logger import RcutilsLogger


class OutputThread:
    """Runs what other threads post, one after another."""

    def __init__(self, logger: RcutilsLogger) -> None:
        """Prepare; the thread starts with :meth:`start`.

        Args:
            logger: Takes the defects of what was posted.
        """
        self._logger = logger
        self._queue: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._run, name='ros output', daemon=True)

    def start(self) -> None:
        """Start to work."""
        self._thread.start()

    def stop(self) -> None:
        """Finish what was posted, then end."""
        self._queue.put(None)
        if self._thread.is_alive():
            self._thread.join()

    def post(self, work: Callable[[], None]) -> None:
        """Have a function run soon; returns at once."""
        self._queue.put(work)

    def _run(self) -> None:
        while (work := self._queue.get()) is not None:
            self._guarded(work)

    def _guarded(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001  # one bad message must not end all others
            self._logger.error(f'cannot publish: {type(error).__name__}: {error}')  # noqa: G004

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A thread that publishes, responds and logs for the cycle, which must not wait for DDS."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import partial
from queue import SimpleQueue
import threading

from rclpy.impl.rcutils_logger import RcutilsLogger

WAITING_MAX = 1000  # pieces of work from which on only the newest of each stream is kept


class OutputThread:
    """Runs functions that other threads post, one after another."""

    def __init__(self, logger: RcutilsLogger) -> None:
        """``logger`` reports exceptions of posted functions, and dropped ones."""
        self._logger = logger
        self._queue: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._newest: dict[Hashable, Callable[[], None]] = {}
        self._left_out = 0
        self._thread = threading.Thread(target=self._run, name='ros output', daemon=True)

    @property
    def waiting(self) -> int:
        """Number of queued functions."""
        return self._queue.qsize()

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Run all posted functions, then end the thread."""
        self._queue.put(None)
        if self._thread.is_alive():
            self._thread.join()

    def post(self, work: Callable[[], None]) -> None:
        """Queue a function; returns at once.

        Use it for results that a client waits for, such as service responses: none is dropped.
        """
        self._queue.put(work)

    def post_stream(self, key: Hashable, work: Callable[[], None]) -> None:
        """Queue a function of a stream; returns at once.

        While ROS is slower than the streams, only the newest function of each is kept.
        """
        with self._lock:
            waits = key in self._newest
            if not waits and self._queue.qsize() < WAITING_MAX:
                self._queue.put(work)
                return
            self._newest[key] = work  # also when there is room again: nothing overtakes it
            self._left_out += waits
            if not waits:
                self._queue.put(partial(self._run_newest, key))

    def _run_newest(self, key: Hashable) -> None:
        with self._lock:
            work = self._newest.pop(key)
            left_out = 0
            if not self._newest:
                left_out, self._left_out = self._left_out, 0
        if left_out:
            text = (
                f'{left_out} messages were left out, because ROS takes them too slowly; is this '
                'computer, or a subscriber, overloaded?'
            )
            self._logger.warning(text)
        work()

    def _run(self) -> None:
        while (work := self._queue.get()) is not None:
            self._run_one(work)

    def _run_one(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001  # one bad message must not end all others
            self._logger.error(f'cannot publish: {type(error).__name__}: {error}')  # noqa: G004

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A thread that owns a bus: of a master and its cycle, or of simulated devices."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from functools import partial
import logging
import threading
import time
from typing import Any, TypeVar

from ..exceptions import BusError
from .bus import Bus
from .frame import Frame

T = TypeVar('T')

STOP_TIMEOUT = 5.0  # [s] for the step that runs to end
REOPEN_PAUSE = 0.1  # [s] between two attempts to read a bus that went away

logger = logging.getLogger(__name__)


class _Answer(Future[T]):
    """A future that cannot be awaited where it is made."""

    def __init__(self, maker: threading.Thread) -> None:
        super().__init__()
        self._maker = maker

    def result(self, timeout: float | None = None) -> T:
        """Wait; a BusError in the thread that would have to go on meanwhile."""
        if not self.done() and threading.current_thread() is self._maker:
            raise BusError(
                f'{self._maker.name} cannot wait for itself: a callback must not wait for its '
                'bus; hand the call to another thread'
            )
        return super().result(timeout)


class BusThread:
    """Reads a bus, and runs what other threads hand over, between two steps of its owner.

    Other threads get a future for what they hand over; nothing is locked.
    """

    def __init__(
        self,
        bus: Bus,
        name: str,
        serve: Callable[[], None],
        owner: str,
        future: Callable[[], Future[Any]] | None = None,
    ) -> None:
        """Prepare; serve is the owner's loop until :attr:`stopping`. The caller closes the bus."""
        self.stopping = False
        self.on_failure: Callable[[], None] = lambda: None  # called when a defect has ended it
        self._bus = bus
        self._loop = serve
        self._owner = owner
        self._work: deque[tuple[Future[Any], Callable[[], None]]] = deque()
        self._open: set[Future[Any]] = set()
        self._too_early = ''
        self._started = False
        self._ended = False
        self._failed = False
        self._begin: Callable[[], None] = lambda: None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._future = future or partial(_Answer, self._thread)

    def refuse_before_start(self, reason: str) -> None:
        """Refuse what is handed over before the start, which otherwise waits for it."""
        self._too_early = reason

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Start the thread, which calls begin first; it may want a priority."""
        self._begin = begin
        self._started = True
        self._thread.start()

    def stop(self) -> None:
        """End the thread after the step that runs, and wait for it for 5 s."""
        self.stopping = True
        if not self._started:
            self._end()
            return
        self._bus.wake()
        self._thread.join(STOP_TIMEOUT)
        if self._thread.is_alive():
            logger.error('%s hangs in its driver, and is left', self._owner)

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Run a function in the thread; it must not wait.

        Returns:
            Its result or its error; a BusError where the thread has ended or ends before.
        """
        future: Future[T] = self._future()
        self._hand_over(future, lambda: future.set_result(function()))
        return future

    def run_later(self, begin: Callable[[Future[T]], None]) -> Future[T]:
        """Start something in the thread that ends later, there it sets the result of the future.

        Returns:
            The future; a BusError where the thread ends before.
        """
        future: Future[T] = self._future()

        def start() -> None:
            self._open.add(future)
            future.add_done_callback(self._open.discard)
            begin(future)

        self._hand_over(future, start)
        return future

    def receive(self, timeout: float) -> list[Frame]:
        """Wait for frames; a bus that went away, or fails by a defect, is waited for."""
        try:
            frames = self._bus.receive(timeout)
        except Exception as error:  # noqa: BLE001  # the cycle of the owner goes on
            self.note_failure(error)
            time.sleep(min(REOPEN_PAUSE, timeout))
            return []
        self._failed = self._failed and not frames
        return frames

    def note_failure(self, error: Exception) -> None:
        """Log the first failure of the bus; the next one after frames have arrived again."""
        if self._failed or self.stopping:
            return
        self._failed = True
        if isinstance(error, BusError):
            logger.error('%s', error)
        else:
            logger.error('a defect in reading %s', self._bus.name, exc_info=error)

    def do_work(self) -> None:
        """Run what was handed over; for the owner, in the thread."""
        while self._work:
            future, work = self._work.popleft()
            if future.set_running_or_notify_cancel():
                try:
                    work()
                except Exception as error:  # noqa: BLE001  # belongs to the holder of the future
                    future.set_exception(error)

    def _hand_over(self, future: Future[Any], work: Callable[[], None]) -> None:
        if self._too_early and not (self._started or self._ended):
            future.set_exception(BusError(self._too_early))
            return
        self._work.append((future, work))
        if self._ended:
            self._refuse_work()
        else:
            self._bus.wake()

    def _refuse_work(self) -> None:
        """Fail all queued calls. Thread-safe."""
        while True:
            try:
                future, _ = self._work.popleft()
            except IndexError:
                return
            if future.set_running_or_notify_cancel():
                future.set_exception(BusError(f'{self._owner} has ended'))

    def _run(self) -> None:
        failure: Exception | None = None
        try:
            self._begin()
            self._loop()
        except Exception as error:
            logger.exception('%s has ended by a defect', self._owner)
            failure = error
        finally:
            self._end()
        if failure is not None:
            self._defect(failure)
            self.on_failure()

    def _defect(self, error: Exception) -> None:
        """Do what can still be done after a defect that has ended the thread, in the thread."""

    def _end(self) -> None:
        self._ended = True
        for future in list(self._open):
            future.set_exception(BusError(f'{self._owner} has ended'))
        self._refuse_work()

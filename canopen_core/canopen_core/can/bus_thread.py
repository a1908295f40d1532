# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A thread that owns a bus, for the cycle of a master or for simulated devices."""

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
    """A future that refuses to be waited for in the bus thread itself."""

    def __init__(self, maker: threading.Thread) -> None:
        super().__init__()
        self._maker = maker

    def result(self, timeout: float | None = None) -> T:
        """Wait for the result; raise a BusError in the bus thread, which would block itself."""
        if not self.done() and threading.current_thread() is self._maker:
            raise BusError(
                f'{self._maker.name} cannot wait for itself: a callback must not wait for its '
                'bus; hand the call to another thread'
            )
        return super().result(timeout)


class BusThread:
    """Reads a bus, and runs functions queued by other threads between two steps of its owner.

    Other threads get a future for each queued function; nothing is locked.
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
        """Refuse functions queued before the start, instead of keeping them until then."""
        self._too_early = reason

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Start the thread, which calls begin first, for example to set its priority."""
        self._begin = begin
        self._started = True
        self._thread.start()

    def stop(self) -> None:
        """End the thread after the present step, and wait up to 5 s for it."""
        self.stopping = True
        if not self._started:
            self._end()
            return
        self._bus.wake()
        self._thread.join(STOP_TIMEOUT)
        if self._thread.is_alive():
            logger.error('%s hangs in its driver, and is left', self._owner)

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Run a function in the thread; the function must not block.

        Returns:
            Future with its result or error, or a BusError if the thread ends before.
        """
        future: Future[T] = self._future()
        self._hand_over(future, lambda: future.set_result(function()))
        return future

    def run_later(self, begin: Callable[[Future[T]], None]) -> Future[T]:
        """Start an operation in the thread that later sets the result of the future there.

        Returns:
            The future; it gets a BusError if the thread ends before.
        """
        future: Future[T] = self._future()

        def start() -> None:
            self._open.add(future)
            future.add_done_callback(self._open.discard)
            begin(future)

        self._hand_over(future, start)
        return future

    def receive(self, timeout: float) -> list[Frame]:
        """Wait for frames; if the bus disappeared or fails, wait until it works again."""
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
        """Run queued functions; the owner calls this in the thread."""
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
        """Clean up in the thread after an unexpected exception has ended its loop."""

    def _end(self) -> None:
        self._ended = True
        for future in list(self._open):
            future.set_exception(BusError(f'{self._owner} has ended'))
        self._refuse_work()

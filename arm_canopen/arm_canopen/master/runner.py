# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread that drives a network on a real bus, on absolute deadlines of the steady clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from functools import partial
import logging
import math
import threading
import time
from typing import Any, TypeVar

from realtime_loop import Cycle, CycleTimer

from ..can.bus import Bus
from ..can.frame import Frame
from ..exceptions import BusError
from .network import Network
from .scheduler import Promise
from .statistics import CycleFigures, CycleStatistics

T = TypeVar('T')

REPORTED_LATENESS = 0.1  # [s] lateness of a cycle that is worth a word
REOPEN_PAUSE = 0.1  # [s] between two looks at a bus that went away

ENDED = 'the CANopen master has ended'

logger = logging.getLogger(__name__)


class NetworkThread:
    """Owns the cycle, and all reading and writing of the bus.

    Other threads hand work to it with ``call`` and ``run`` and get a future; nothing is locked.

    Attributes:
        network: The network that it runs.
        period: Length of the cycle in [s].
    """

    def __init__(self, bus: Bus, network: Network) -> None:
        """Prepare; the thread starts with :meth:`start`.

        Args:
            bus: An open bus; it stays the caller's to close.
            network: The network whose frames go over it.
        """
        self.network = network
        self.period = network.config.master.cycle_period
        self._bus = bus
        self._statistics = CycleStatistics(self.period)
        self._work: deque[tuple[Future[Any], Callable[[], None]]] = deque()
        self._cycle_time = 0.0
        self._stopping = False
        self._ended = False
        self._open: set[Future[Any]] = set()
        self._bus_failed = False
        self._begin: Callable[[], None] = lambda: None
        self._thread = threading.Thread(target=self._run, name='canopen', daemon=True)

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Start the network and its cycle.

        Args:
            begin: Called first in the thread, which may want a priority.
        """
        self._begin = begin
        self._thread.start()

    def stop(self) -> None:
        """End the thread after the cycle that runs, and wait for it."""
        self._stopping = True
        self._bus.wake()
        if self._thread.is_alive():
            self._thread.join()

    def call(self, function: Callable[[], T]) -> Future[T]:
        """Run a function in the thread of the cycle; it must not wait."""
        future: Future[T] = Future()
        self._hand_over(future, lambda: future.set_result(function()))
        return future

    def run(self, sequence: Callable[[], Promise[T]]) -> Future[T]:
        """Start something that ends later; the future gets its result.

        Args:
            sequence: Called in the thread of the cycle; returns the promise.
        """
        future: Future[T] = Future()

        def finish(promise: Promise[T]) -> None:
            self._open.discard(future)
            if future.done():  # the thread ended before the sequence did
                return
            if promise.error is not None:
                future.set_exception(promise.error)
            else:
                future.set_result(promise.result())

        def begin() -> None:
            self._open.add(future)
            sequence().when_done(finish)

        self._hand_over(future, begin)
        return future

    def run_coroutine(self, make: Callable[[], Coroutine[Promise[Any], None, T]]) -> Future[T]:
        """As :meth:`run`, for a coroutine that is made in the thread of the cycle."""
        return self.run(lambda: self.network.scheduler.spawn(make()))

    def figures(self) -> CycleFigures:
        """Return the figures of the cycle; call it in the thread of the cycle."""
        return self._statistics.figures()

    def _hand_over(self, future: Future[Any], work: Callable[[], None]) -> None:
        self._work.append((future, work))
        if self._ended:
            self._refuse_work()
        else:
            self._bus.wake()

    def _refuse_work(self) -> None:
        """Leave nobody waiting for what will not be done any more."""
        while self._work:
            future, _ = self._work.popleft()
            if future.set_running_or_notify_cancel():
                future.set_exception(BusError(ENDED))

    def _run(self) -> None:
        try:
            self._begin()
            self._cycle_until_stopped()
        except Exception:
            logger.exception('the CANopen cycle has ended by a defect')
        finally:
            self._ended = True
            self._refuse_work()
            for future in self._open:
                future.set_exception(BusError(ENDED))

    def _cycle_until_stopped(self) -> None:
        self.network.start(time.monotonic())
        timer = CycleTimer(self.period, time.monotonic())
        while not self._stopping:
            self._serve_until(timer.deadline)
            now = time.monotonic()
            cycle = timer.begin(now)
            self._guarded(self.network.sync)
            sent = time.monotonic()
            self._statistics.record(cycle.late + sent - now, cycle.skipped)
            self._begin_cycle(cycle, now)

    def _begin_cycle(self, cycle: Cycle, now: float) -> None:
        """Do what follows SYNC, with what has come before it taken first.

        After a pause of this process, that is older than the time-outs that it would otherwise
        seem to have missed.
        """
        self._cycle_time = cycle.time
        frames = self._receive(0.0)
        self._take([frame for frame in frames if frame.timestamp < now])
        if cycle.late > REPORTED_LATENESS:
            self._guarded(partial(self.network.note_pause, cycle.late))
        self._guarded(partial(self.network.cycle, now, self.period))
        self._take([frame for frame in frames if frame.timestamp >= now])
        self._update_when_due(now)  # the deadline may have passed before anybody looks again

    def _serve_until(self, deadline: float) -> None:
        """Take frames, hand-overs and timers, and update, until the next SYNC is due."""
        network = self.network
        while not self._stopping:
            now = time.monotonic()
            if now >= deadline:
                return
            timer = network.scheduler.next_deadline() or math.inf
            wake = min(deadline, timer, network.next_update)
            self._take(self._receive(max(0.0, wake - now)))
            now = time.monotonic()
            if now >= deadline:
                return
            self._guarded(partial(network.advance, now))
            self._update_when_due(now)

    def _update_when_due(self, now: float) -> None:
        if now >= self.network.next_update:
            self._guarded(partial(self.network.update, self._cycle_time, self.period))

    def _receive(self, timeout: float) -> list[Frame]:
        try:
            frames = self._bus.receive(timeout)
        except BusError as error:
            if not self._bus_failed:
                self._bus_failed = True
                logger.error('%s', error)
            time.sleep(min(REOPEN_PAUSE, timeout))
            return []
        self._bus_failed = False
        return frames

    def _take(self, frames: list[Frame]) -> None:
        receive = self.network.receive
        self.network.scheduler.set_time(time.monotonic())
        for frame in frames:
            try:
                receive(frame)
            except Exception:  # noqa: PERF203  # one frame must not cost the next
                logger.exception('a defect in the CANopen master, at the frame %s', frame)
        while self._work:
            self._do(*self._work.popleft())

    def _do(self, future: Future[Any], work: Callable[[], None]) -> None:
        if future.set_running_or_notify_cancel():
            try:
                work()
            except Exception as error:  # noqa: BLE001  # belongs to whoever holds the future
                self._open.discard(future)
                future.set_exception(error)

    def _guarded(self, work: Callable[[], object]) -> None:
        """Let no defect in one cycle end the cycles that keep the drives under control."""
        try:
            work()
        except Exception:
            logger.exception('a defect in the CANopen cycle')

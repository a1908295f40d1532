# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread that drives a network on a real bus, on absolute deadlines of the steady clock."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
import logging
import math
import time
from typing import Any, TypeVar

from canopen_core import BusError
from canopen_core.can import Bus, BusThread, Frame
from realtime_loop import Cycle, CycleTimer

from .network import Network
from .scheduler import Promise

T = TypeVar('T')

WINDOW = 2000  # cycles over which percentiles are computed
REPORTED_LATENESS = 0.1  # [s] smallest reported lateness of a cycle
IDLE_SHARE = 0.5  # of a period, in which a bus that was silent until its end is not read again

OWNER = 'the CANopen master'  # of the thread, for messages

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class CycleFigures:
    """Statistics of the cycle: jitter over the last window, counts since the start."""

    period: float  # nominal period in [s]
    cycles: int  # number of cycles
    overruns: int  # cycles skipped because the previous one ended too late
    jitter_p50: float  # median lateness of SYNC when handed to the bus, in [s]
    jitter_p99: float  # 99th percentile of the lateness in [s]
    jitter_max: float  # largest lateness in [s]


class CycleStatistics:
    """Collects the lateness of each cycle against its deadline."""

    def __init__(self, period: float, window: int = WINDOW) -> None:
        """``period`` is in [s]; percentiles cover the last ``window`` cycles."""
        self._period = period
        self._late: deque[float] = deque(maxlen=window)
        self._cycles = 0
        self._overruns = 0

    def record(self, late: float, skipped: int) -> None:
        """Add a cycle: SYNC minus deadline in [s], and how many deadlines had passed."""
        self._late.append(late)
        self._cycles += 1
        self._overruns += skipped

    def figures(self) -> CycleFigures:
        """Return the current statistics."""
        ordered = sorted(self._late) or [0.0]
        last = len(ordered) - 1
        return CycleFigures(
            period=self._period,
            cycles=self._cycles,
            overruns=self._overruns,
            jitter_p50=ordered[last // 2],
            jitter_p99=ordered[last * 99 // 100],
            jitter_max=ordered[-1],
        )


@dataclass(frozen=True)
class Clock:
    """Clock of a master and waiting of its callers; tests replace it by simulated time."""

    now: Callable[[], float] = time.monotonic  # steady time in [s]
    # of what another thread hands over; None for one that waits in real time
    future: Callable[[], Future[Any]] | None = None


class NetworkThread(BusThread):
    """Thread that runs the cycle and does all reading and writing of the bus.

    To run without a thread, call :meth:`begin` and then :meth:`step` repeatedly.
    """

    def __init__(self, bus: Bus, network: Network, clock: Clock | None = None) -> None:
        """``bus`` must be open; the caller closes it."""
        clock = clock or Clock()
        super().__init__(bus, 'canopen', self._serve, OWNER, clock.future)
        self.now = clock.now  # steady time in [s]
        self.network = network  # the network that it runs
        self.period = network.config.master.cycle_period  # length of the cycle in [s]
        # defect that ended the thread; None while it runs, and after a regular end
        self.failure: BusError | None = None
        # called in the thread after a defect; returns in words what was still done
        self.on_defect: Callable[[], str] = lambda: ''
        self._statistics = CycleStatistics(self.period)
        self._cycle_time = 0.0
        self._timer = CycleTimer(self.period, clock.now())

    def run(self, sequence: Callable[[], Promise[T]]) -> Future[T]:
        """Call ``sequence`` in the thread of the cycle; the future gets what its promise gets."""

        def begin(future: Future[T]) -> None:
            def finish(promise: Promise[T]) -> None:
                if future.done():  # the thread ended before the sequence did
                    return
                if promise.error is not None:
                    future.set_exception(promise.error)
                else:
                    future.set_result(promise.result())

            sequence().when_done(finish)

        return self.run_later(begin)

    def run_coroutine(self, make: Callable[[], Coroutine[Promise[Any], None, T]]) -> Future[T]:
        """Like :meth:`run`, for a coroutine that ``make`` creates in the thread of the cycle."""
        return self.run(lambda: self.network.scheduler.spawn(make()))

    def figures(self) -> CycleFigures:
        """Return the statistics of the cycle; call it in the thread of the cycle."""
        return self._statistics.figures()

    def _defect(self, error: Exception) -> None:
        text = f'{OWNER} has ended by a defect: {type(error).__name__}: {error}'
        try:
            text += self.on_defect()
        except Exception:
            logger.exception('a second defect, after the end of the CANopen cycle')
        self.failure = BusError(text)

    def begin(self) -> None:
        """Start to boot the devices; the first cycle is due at once."""
        self.network.start(self.now())
        self._timer = CycleTimer(self.period, self.now())

    @property
    def next_due(self) -> float:
        """Time at which the next cycle, update or timer is due in [s]."""
        timer = self.network.scheduler.next_deadline() or math.inf
        return min(self._timer.deadline, timer, self.network.next_update)

    def step(self) -> None:
        """Receive until something is due, and process that; SYNC takes precedence."""
        now, idle = self.now(), False
        if now < self._timer.deadline:
            # TPDOs that answer SYNC act together, when the last has come
            self._bus.batch = self.network.pending_pdos or 1
            frames = self.receive(max(0.0, self.next_due - now))
            self._take(frames)
            now, idle = self.now(), not frames
            if now < self._timer.deadline:
                self._log_defects(partial(self.network.advance, now))
                self._update_when_due(now)
                return
        cycle = self._timer.begin(now)
        self._log_defects(self.network.sync)
        self._statistics.record(cycle.late + self.now() - now, cycle.skipped)
        idle = idle and cycle.late < IDLE_SHARE * self.period
        self._begin_cycle(cycle, now, [] if idle else self.receive(0.0))

    def _serve(self) -> None:
        self.begin()
        while not self.stopping:
            self.step()

    def _begin_cycle(self, cycle: Cycle, now: float, frames: list[Frame]) -> None:
        """Run the work after SYNC; process frames received before it first.

        After a pause of this process, such frames prevent time-outs that they would otherwise seem
        to have missed.
        """
        self._cycle_time = cycle.time
        self._take([frame for frame in frames if frame.timestamp < now])
        if cycle.late > REPORTED_LATENESS:
            self._log_defects(partial(self.network.note_pause, cycle.late, now))
        self._log_defects(partial(self.network.cycle, now, self.period))
        self._take([frame for frame in frames if frame.timestamp >= now])
        self._update_when_due(now)  # the deadline may pass before the next check

    def _update_when_due(self, now: float) -> None:
        if now >= self.network.next_update:
            self._log_defects(partial(self.network.update, self._cycle_time, self.period))

    def _take(self, frames: list[Frame]) -> None:
        receive = self.network.receive
        self.network.scheduler.set_time(self.now())
        for frame in frames:
            try:
                receive(frame)
            except Exception:  # noqa: PERF203  # an error in one frame must not affect the next
                logger.exception('a defect in the CANopen master, at the frame %s', frame)
        self.do_work()

    def _log_defects(self, work: Callable[[], object]) -> None:
        """Run ``work`` and log its exceptions, so that the drives stay under control."""
        try:
            work()
        except Exception:
            logger.exception('a defect in the CANopen cycle')

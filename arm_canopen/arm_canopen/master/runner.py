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

WINDOW = 2000  # cycles that the percentiles look back
REPORTED_LATENESS = 0.1  # [s] lateness of a cycle that is worth a word
IDLE_SHARE = 0.5  # of a period, in which a bus that was silent until its end is not read again

OWNER = 'the CANopen master'  # of the thread, for messages

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class CycleFigures:
    """What the cycle did; jitter over the last window, counts since the start."""

    period: float  # nominal period in [s]
    cycles: int  # number of cycles
    overruns: int  # cycles that were left out because the one before ended too late
    jitter_p50: float  # median lateness of SYNC, when it has been handed to the bus, in [s]
    jitter_p99: float  # 99th percentile of the lateness in [s]
    jitter_max: float  # largest lateness in [s]


class CycleStatistics:
    """Collects the lateness of each cycle against its deadline."""

    def __init__(self, period: float, window: int = WINDOW) -> None:
        """The ``period`` is in [s]; the percentiles look back ``window`` cycles."""
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
        """Return the figures of now."""
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
    """The time of a master, and what its callers wait with; tests have a time of their own."""

    now: Callable[[], float] = time.monotonic  # steady time in [s]
    # of what another thread hands over; None for one that waits in real time
    future: Callable[[], Future[Any]] | None = None


class NetworkThread(BusThread):
    """Owns the cycle, and all reading and writing of the bus.

    Without a thread, :meth:`begin` and then :meth:`step`, again and again, do the same.
    """

    def __init__(self, bus: Bus, network: Network, clock: Clock | None = None) -> None:
        """The bus is open, and stays the caller's to close."""
        clock = clock or Clock()
        super().__init__(bus, 'canopen', self._serve, OWNER, clock.future)
        self.now = clock.now  # steady time in [s]
        self.network = network  # the network that it runs
        self.period = network.config.master.cycle_period  # length of the cycle in [s]
        # defect that has ended it; None while it runs, and after a wanted end
        self.failure: BusError | None = None
        # called in the thread, for what can still be done; returns what was, in words
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
        """As :meth:`run`, for a coroutine that is made in the thread of the cycle."""
        return self.run(lambda: self.network.scheduler.spawn(make()))

    def figures(self) -> CycleFigures:
        """Return the figures of the cycle; call it in the thread of the cycle."""
        return self._statistics.figures()

    def _defect(self, error: Exception) -> None:
        text = f'{OWNER} has ended by a defect: {type(error).__name__}: {error}'
        try:
            text += self.on_defect()
        except Exception:
            logger.exception('a second defect, after the end of the CANopen cycle')
        self.failure = BusError(text)

    def begin(self) -> None:
        """Begin to boot the devices; the first cycle is due at once."""
        self.network.start(self.now())
        self._timer = CycleTimer(self.period, self.now())

    @property
    def next_due(self) -> float:
        """When the next cycle, update or timer is due in [s]."""
        timer = self.network.scheduler.next_deadline() or math.inf
        return min(self._timer.deadline, timer, self.network.next_update)

    def step(self) -> None:
        """Receive until something is due, and do that; SYNC comes before all else."""
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
        """Do what follows SYNC, with what has come before it taken first.

        After a pause of this process, that is older than the time-outs that it would otherwise
        seem to have missed.
        """
        self._cycle_time = cycle.time
        self._take([frame for frame in frames if frame.timestamp < now])
        if cycle.late > REPORTED_LATENESS:
            self._log_defects(partial(self.network.note_pause, cycle.late, now))
        self._log_defects(partial(self.network.cycle, now, self.period))
        self._take([frame for frame in frames if frame.timestamp >= now])
        self._update_when_due(now)  # the deadline may have passed before the next look

    def _update_when_due(self, now: float) -> None:
        if now >= self.network.next_update:
            self._log_defects(partial(self.network.update, self._cycle_time, self.period))

    def _take(self, frames: list[Frame]) -> None:
        receive = self.network.receive
        self.network.scheduler.set_time(self.now())
        for frame in frames:
            try:
                receive(frame)
            except Exception:  # noqa: PERF203  # one frame must not cost the next
                logger.exception('a defect in the CANopen master, at the frame %s', frame)
        self.do_work()

    def _log_defects(self, work: Callable[[], object]) -> None:
        """Contain a defect in one cycle, so that the drives stay under control."""
        try:
            work()
        except Exception:
            logger.exception('a defect in the CANopen cycle')

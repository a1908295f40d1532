# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread that steps the controller when feedback arrives, or at the deadline.

Steps are scheduled at absolute times. While feedback arrives, a step waits for it slightly beyond
its due time, and the schedule is phase-locked to the arrivals, so each step uses fresh feedback.
Without feedback, steps run on schedule. The rate stays nominal; a faster or slower feedback shifts
it by a few per cent at most.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection
from dataclasses import replace
import threading
import time
from typing import Any

from quad_description import RobotState

from ..states.controller import Controller
from ..states.modes import Output

WINDOW = 0.08  # periods before and after its time in which feedback makes a step
GAIN = 0.2  # share of its distance from the schedule that an arrival draws the schedule by
PAIR_TIME = 0.002  # [s] that joint states wait for the attitude of the same report
RECORDED_STEPS = 1000  # that the figures are of

StepTimes = tuple[float, float, float | None]
"""Time since the step before, until its command was published, and from the feedback that it used
to the command, None without one, in [s]."""


class Pacer:
    """Schedules the steps; times are on a monotonic clock in [s]."""

    def __init__(self, period: float, now: float) -> None:
        """Schedule the first step at once."""
        self._period = period
        self._window = WINDOW * period
        self._due = now
        self._locked = False
        self.overruns = 0  # steps that were left out because the one before came too late

    def deadline(self, fresh: bool) -> float:
        """Return the latest start of the next step; fresh means unused feedback exists."""
        if fresh:
            return self._due
        return self._due + self._window if self._locked else self._due

    def takes(self, now: float) -> bool:
        """Return whether feedback that arrives now triggers a step."""
        return now >= self._due - self._window

    def stepped(self, now: float, arrival: float | None) -> None:
        """Schedule the next step; arrival is that of the feedback used, None without any."""
        error = 0.0 if arrival is None else arrival - self._due
        error = min(max(error, -self._window), self._window)
        self._due += self._period + GAIN * error
        self._locked = arrival is not None
        late = now - self._due
        if late >= 0.0:
            skipped = int(late / self._period) + 1
            self.overruns += skipped
            self._due += skipped * self._period


def loop_figures(recorded: Collection[StepTimes], period: float) -> dict[str, float]:
    """Return timing statistics of the last steps: rate in [1/s], all others in [s].

    Jitter is the deviation of an interval from the period; a step is the time until its command is
    published.
    """
    intervals = [interval for interval, _, _ in recorded]
    jitter = sorted(abs(interval - period) for interval in intervals)
    durations = sorted(duration for _, duration, _ in recorded)
    latencies = sorted(latency for _, _, latency in recorded if latency is not None)
    total = sum(intervals)
    return {
        'rate': len(intervals) / total if total > 0.0 else 0.0,
        'jitter_p50': _percentile(jitter, 0.5),
        'jitter_p99': _percentile(jitter, 0.99),
        'jitter_max': _percentile(jitter, 1.0),
        'step_p99': _percentile(durations, 0.99),
        'feedback_to_command_p50': _percentile(latencies, 0.5),
        'feedback_to_command_p99': _percentile(latencies, 0.99),
    }


def _percentile(ordered: list[float], share: float) -> float:
    return ordered[int((len(ordered) - 1) * share)] if ordered else 0.0


class ControlLoop:
    """Owns the control thread; access the controller only under :attr:`lock`."""

    def __init__(
        self,
        controller: Controller,
        period: float,
        publish: Callable[[Output], None],
        fail: Callable[[Exception], None],
        record: Callable[[Output, float, float, float | None], None] | None = None,
    ) -> None:
        """Set up the loop; :meth:`start` starts its thread.

        Args:
            fail: Called in the thread with the exception that ended it.
            record: Called in the thread with each published output, the time since the previous
                step, the duration of the step, and the latency from feedback to command in [s].
        """
        self.lock = threading.Lock()  # hold it to call the controller between two steps
        self._controller, self._period = controller, period
        self._publish, self._fail, self._record = publish, fail, record
        self._recorded: deque[StepTimes] = deque(maxlen=RECORDED_STEPS)
        self._steps = 0
        self._pacer = Pacer(period, time.monotonic())
        self._arrived = threading.Condition()
        self._measurement = RobotState()
        self._arrival: float | None = None
        self._stopping = False
        self._begin: Callable[[], None] = lambda: None
        self._thread = threading.Thread(target=self._guarded, name='control', daemon=True)

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Start the thread; it calls ``begin`` first, for example to set its priority."""
        self._begin = begin
        self._pacer = Pacer(self._period, time.monotonic())
        self._thread.start()

    def stop(self) -> None:
        """Stop the thread; the last targets stay."""
        with self._arrived:
            self._stopping = True
            self._arrived.notify()
        if self._thread.is_alive():
            self._thread.join()

    def offer(self, **values: Any) -> None:  # noqa: ANN401
        """Update fields of the RobotState for the next step; joints may trigger one at once."""
        with self._arrived:
            self._measurement = replace(self._measurement, **values)
            if 'joints' in values:
                self._arrival = time.monotonic()
                if self._pacer.takes(self._arrival):
                    self._arrived.notify()
            elif 'imu' in values and self._arrival is not None:
                self._arrived.notify()

    def figures(self) -> dict[str, float]:
        """Return timing statistics: counts since the start, and :func:`loop_figures`."""
        with self._arrived:
            counts = {'steps': self._steps, 'overruns': self._pacer.overruns}
            recorded = list(self._recorded)
        return counts | loop_figures(recorded, self._period)  # the thread need not wait for it

    def _guarded(self) -> None:
        try:
            self._begin()
            self._run()
        except Exception as error:  # noqa: BLE001  # whatever it is, the node must learn of it
            self._fail(error)

    def _run(self) -> None:
        last = time.monotonic()
        while True:
            with self._arrived:
                self._wait()
                if self._stopping:
                    return
                now = time.monotonic()
                arrival = self._arrival
                measurement, self._measurement = self._measurement, RobotState()
                self._arrival = None
                self._pacer.stepped(now, arrival)
            with self.lock:
                output = self._controller.step(measurement, now - last)
            self._publish(output)
            end = time.monotonic()
            latency = end - arrival if arrival is not None else None
            with self._arrived:
                self._recorded.append((now - last, end - now, latency))
                self._steps += 1
            if self._record is not None:
                self._record(output, now - last, end - now, latency)
            last = now

    def _wait(self) -> None:
        """Wait until a step is due, or feedback triggers one."""
        while not self._stopping:
            now = time.monotonic()
            left = self._pacer.deadline(self._arrival is not None) - now
            if self._arrival is not None and self._pacer.takes(now):
                # joints and attitude of one report come one after the other
                paired = self._measurement.imu is not None
                left = 0.0 if paired else min(left, self._arrival + PAIR_TIME - now)
            if left <= 0.0:
                return
            self._arrived.wait(left)

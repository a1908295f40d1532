# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread that steps the controller, on the arrival of feedback or else on its deadline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import threading
import time
from typing import Any

from quad_description import RobotState

from ..states.controller import Controller
from ..states.status import Output
from ..timing.pacer import LoopFigures, LoopStatistics, Pacer

PAIR_TIME = 0.002  # [s] that joint states wait for the attitude of the same report


class ControlLoop:
    """Owns the thread; everything else of the controller is used under :attr:`lock`."""

    def __init__(
        self,
        controller: Controller,
        period: float,
        publish: Callable[[Output], None],
        fail: Callable[[Exception], None],
        record: Callable[[Output, float, float, float | None], None] | None = None,
    ) -> None:
        """Prepare; the thread starts with :meth:`start`.

        Args:
            fail: Takes what ended the thread, in the thread.
            record: Takes every output after it was published, in the thread, with the time since
                the step before, that of the step, and from feedback to command in [s].
        """
        self.lock = threading.Lock()  # hold it to call the controller between two steps
        self._controller, self._period = controller, period
        self._publish, self._fail, self._record = publish, fail, record
        self._statistics = LoopStatistics(period)
        self._pacer = Pacer(period, time.monotonic())
        self._arrived = threading.Condition()
        self._measurement = RobotState()
        self._arrival: float | None = None
        self._stopping = False
        self._begin: Callable[[], None] = lambda: None
        self._thread = threading.Thread(target=self._guarded, name='control', daemon=True)

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Begin to step.

        Args:
            begin: Called first in the thread, which may want a priority.
        """
        self._begin = begin
        self._pacer = Pacer(self._period, time.monotonic())
        self._thread.start()

    def stop(self) -> None:
        """End the thread; the last targets stay."""
        with self._arrived:
            self._stopping = True
            self._arrived.notify()
        if self._thread.is_alive():
            self._thread.join()

    def offer(self, **values: Any) -> None:  # noqa: ANN401
        """Hand in fields of a RobotState for the next step; joints may make one at once."""
        with self._arrived:
            self._measurement = replace(self._measurement, **values)
            if 'joints' in values:
                self._arrival = time.monotonic()
                if self._pacer.takes(self._arrival):
                    self._arrived.notify()
            elif 'imu' in values and self._arrival is not None:
                self._arrived.notify()

    def figures(self) -> LoopFigures:
        """Return how well the time is kept."""
        with self._arrived:
            statistics, overruns = self._statistics.copy(), self._pacer.overruns
        return statistics.figures(overruns)  # the thread need not wait for the sorting

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
                self._statistics.record(now - last, end - now, latency)
            if self._record is not None:
                self._record(output, now - last, end - now, latency)
            last = now

    def _wait(self) -> None:
        """Wait until a step is due, or feedback makes one."""
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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread that steps the controller, on the arrival of feedback or else on its deadline."""

from __future__ import annotations

from collections.abc import Callable
import threading
import time

from quad_description import ImuSample, JointSample, RobotState
from quad_description.rotations import Vector

from ..states.controller import Controller
from ..states.status import Output
from ..timing.pacer import Pacer
from ..timing.statistics import LoopFigures, LoopStatistics

PAIR_TIME = 0.002  # [s] that joint states wait for the attitude of the same report


class ControlLoop:
    """Owns the thread; everything else of the controller is used under :attr:`lock`.

    Attributes:
        lock: Hold it to call the controller between two steps.
    """

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
        self.lock = threading.Lock()
        self._controller, self._period = controller, period
        self._publish, self._fail, self._record = publish, fail, record
        self._statistics = LoopStatistics(period)
        self._pacer = Pacer(period, time.monotonic())
        self._arrived = threading.Condition()
        self._joints: JointSample | None = None
        self._imu: ImuSample | None = None
        self._battery: float | None = None
        self._linear_velocity: Vector | None = None
        self._foot_contacts: tuple[bool, ...] | None = None
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

    def offer_joints(self, joints: JointSample) -> None:
        """Hand in joint states; they may make a step at once."""
        with self._arrived:
            self._joints, self._arrival = joints, time.monotonic()
            if self._pacer.takes(self._arrival):
                self._arrived.notify()

    def offer_imu(self, imu: ImuSample) -> None:
        """Hand in an attitude for the next step."""
        with self._arrived:
            self._imu = imu
            if self._arrival is not None:
                self._arrived.notify()

    def offer_battery(self, battery: float | None) -> None:
        """Hand in a charge for the next step."""
        with self._arrived:
            self._battery = battery

    def offer_linear_velocity(self, velocity: Vector) -> None:
        """Hand in a velocity of the body in its own frame [m/s] for the next step."""
        with self._arrived:
            self._linear_velocity = velocity

    def offer_foot_contacts(self, contacts: tuple[bool, ...]) -> None:
        """Hand in which feet are on the ground for the next step."""
        with self._arrived:
            self._foot_contacts = contacts

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
                measurement = RobotState(
                    self._joints,
                    self._imu,
                    self._battery,
                    linear_velocity=self._linear_velocity,
                    foot_contacts=self._foot_contacts,
                )
                self._joints = self._imu = self._battery = self._arrival = None
                self._linear_velocity = self._foot_contacts = None
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
                paired = self._imu is not None
                left = 0.0 if paired else min(left, self._arrival + PAIR_TIME - now)
            if left <= 0.0:
                return
            self._arrived.wait(left)

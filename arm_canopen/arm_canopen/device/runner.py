# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread that runs simulated devices on a real bus."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import logging
import threading
import time

from ..can.bus import Bus
from ..can.frame import Frame
from ..exceptions import BusError
from .host import DeviceHost

IDLE_WAIT = 1.0  # [s] longest wait when no device has a deadline
RETRY_PAUSE = 0.1  # [s] between two looks at a bus that went away

logger = logging.getLogger(__name__)


class DeviceRunner:
    """Waits for frames and deadlines, and gives them to the devices of a host.

    A bus that goes away (interface down) is waited for; the devices go on meanwhile, as real
    ones do.

    Attributes:
        host: The devices; add them before :meth:`start`, and leave them to the thread then.
    """

    def __init__(self, bus: Bus) -> None:
        """Prepare; the thread starts with :meth:`start`.

        Args:
            bus: An open bus; it stays the caller's to close.
        """
        self.host = DeviceHost(self._send)
        self._bus = bus
        self._stopping = False
        self._bus_failed = False
        self._thread = threading.Thread(target=self.run, name='devices', daemon=True)

    def start(self) -> None:
        """Switch the devices on, in a thread of their own."""
        self._thread.start()

    def stop(self) -> None:
        """Fall silent, as if the power of all devices was cut, and end the thread."""
        self._stopping = True
        self._bus.wake()
        if self._thread.is_alive():
            self._thread.join()

    def run(self) -> None:
        """Run the devices in this thread, until :meth:`stop` is called from another one."""
        host = self.host
        while not self._stopping:
            if not self._guarded(partial(host.advance, time.monotonic())):
                time.sleep(RETRY_PAUSE)  # what is due stays due
            wait = min(host.deadline - time.monotonic(), IDLE_WAIT)
            for frame in self._receive(max(0.0, wait)):
                self._guarded(partial(host.receive, frame, frame.timestamp or time.monotonic()))

    def _guarded(self, work: Callable[[], None]) -> bool:
        """Let the devices not die of a defect in one; return whether there was none."""
        try:
            work()
        except Exception:
            logger.exception('a defect in a simulated device')
            return False
        return True

    def _receive(self, timeout: float) -> list[Frame]:
        try:
            frames = self._bus.receive(timeout)
        except BusError as error:
            if not self._stopping:
                self._tell_failure(error)
                time.sleep(RETRY_PAUSE)
            return []
        self._bus_failed = self._bus_failed and not frames
        return frames

    def _send(self, frame: Frame) -> None:
        try:
            self._bus.send(frame)
        except BusError as error:
            self._tell_failure(error)

    def _tell_failure(self, error: BusError) -> None:
        """Log the first failure; the next one after frames have arrived again."""
        if not self._bus_failed:
            self._bus_failed = True
            logger.error('%s', error)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An LSS master and simulated devices in virtual time; answers may come late."""

from __future__ import annotations

from collections.abc import Coroutine, Iterable
import heapq
from itertools import count
from typing import Any, TypeVar

from device_rig import drive_dictionary, with_defaults

from arm_canopen.can import Frame
from arm_canopen.master import Promise, Scheduler
from arm_canopen.standard import LssAddress, UNCONFIGURED
from canopen_sim import DeviceHost
from canopen_tools.lss_master import LssMaster

T = TypeVar('T')


class LssNetwork:
    """A bus that takes some time."""

    def __init__(self, addresses: Iterable[LssAddress], node_ids: Iterable[int] = ()) -> None:
        """Switch devices of these identities on; without a node id one has none."""
        # how late frames of the devices arrive in [s], one after another; 1 ms after these
        self.delays: list[float] = []
        self.received: list[Frame] = []  # frames of the devices, without LSS answers
        self._scheduler = Scheduler(1.0)
        self._order = count()
        self._way: list[tuple[float, int, Frame]] = []
        self.host = DeviceHost(self._answer)  # the devices
        ids = iter(node_ids)
        for address in addresses:
            values = {(0x1018, part + 1): number for part, number in enumerate(address)}
            self.host.add(next(ids, UNCONFIGURED), with_defaults(drive_dictionary(), values))
        self.host.advance(1.0)
        self.master = LssMaster(self._scheduler, self._send)  # the LSS master

    @property
    def now(self) -> float:
        """Virtual time in [s]."""
        return self._scheduler.now

    def run(self, coroutine: Coroutine[Promise[Any], None, T]) -> T:
        """Run a service to its end."""
        task = self._scheduler.spawn(coroutine)
        while not task.done:
            deadline = self._scheduler.next_deadline()
            arrival = self._way[0][0] if self._way else float('inf')
            assert deadline is not None
            self._scheduler.set_time(min(deadline, arrival))
            while self._way and self._way[0][0] <= self.now:
                frame = heapq.heappop(self._way)[2]
                self.master.receive(frame._replace(timestamp=self.now))
                if frame.can_id != 0x7E4:
                    self.received.append(frame)
            self.host.advance(self.now)
            self._scheduler.advance(self.now)
        return task.result()

    def _send(self, frame: Frame) -> None:
        self.host.receive(frame, self.now)

    def _answer(self, frame: Frame) -> None:
        delay = self.delays.pop(0) if self.delays else 0.001
        heapq.heappush(self._way, (self.now + delay, next(self._order), frame))

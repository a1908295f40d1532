# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether a bus has devices with the node ids of those that are to be simulated on it.

Two devices with one node id both answer the master, and both follow it: nothing shows it but odd
errors. So simulated devices listen, and request the device type of each of their node ids, before
they get power.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
import contextlib
import time

from canopen_core import BusError, CanopenError
from canopen_core.can import Bus, Frame
from canopen_core.standard import CobId, Index, sdo

ANSWER_TIME = 0.15  # [s] a device answers an SDO within some milliseconds, unless it is too busy
EVIDENCE = {CobId.SDO_RESPONSE: 'SDO response', CobId.HEARTBEAT: 'heartbeat or boot-up'}
"""Frames that only the device with a node id sends, by their first identifier."""


class NodeIdCheck:
    """Listens for devices with given node ids, beside other work of a start."""

    def __init__(
        self, bus: Bus, node_ids: Iterable[int], clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Request an answer of each; what was received before counts, too.

        The bus has no other reader.
        """
        self.found: dict[int, str] = {}  # what was received from them, in words, by identifier
        self._bus = bus
        self._clock = clock
        ids = [*node_ids]
        self._known = {
            base + node_id: f'{name} (0x{base + node_id:03X}) of node id {node_id}'
            for base, name in EVIDENCE.items()
            for node_id in ids
        }
        self._until = clock() + ANSWER_TIME
        self._receive(0.0)
        with contextlib.suppress(BusError):  # a bus that is down has no devices
            for node_id in [] if self.found else ids:
                request = sdo.UploadRequest(Index.DEVICE_TYPE, 0).encode()
                bus.send(Frame(CobId.SDO_REQUEST + node_id, request))

    def finish(self) -> None:
        """Wait for the rest of the time in which a device would have answered.

        Raises:
            CanopenError: There are such devices; the message names their frames and the remedy.
        """
        readable = self._receive(0.0)  # what came beside other work, however long that took
        while readable and not self.found and (left := self._until - self._clock()) > 0.0:
            readable = self._receive(left)
        if self.found:
            raise CanopenError(
                f'{self._bus.name} has devices with these node ids already; received: '
                f'{", ".join(self.found[can_id] for can_id in sorted(self.found))}. End the other '
                'simulated devices (fake_slaves, bringup --simulate), or choose another '
                'can_interface_name'
            )

    def _receive(self, timeout: float) -> bool:
        """Check received frames; return whether the bus can be read."""
        try:
            frames = self._bus.receive(timeout)
        except BusError:
            return False
        for frame in frames:
            plain = not (frame.is_remote or frame.is_extended or frame.is_error)
            if plain and frame.can_id in self._known:
                self.found[frame.can_id] = self._known[frame.can_id]
        return True

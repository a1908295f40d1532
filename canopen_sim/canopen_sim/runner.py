# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The thread that runs simulated devices on a real bus."""

from __future__ import annotations

from collections.abc import Sequence
import logging
import time

from canopen_core import BusError
from canopen_core.can import Bus, BusThread, Frame
from canopen_core.standard import CobId, NODE_ID_MAX

from .device import Device
from .host import DeviceHost

IDLE_WAIT = 1.0  # [s] longest wait when no device has a deadline
STALL = 0.1  # [s] without a processor from which on devices count as having stood still

logger = logging.getLogger(__name__)


class DeviceRunner(BusThread):
    """Waits for frames and deadlines, and gives them to the devices of a host.

    A bus that goes away (interface down) is waited for; the devices go on meanwhile, as real
    ones do. A defect in one device is logged, and the others go on.
    """

    def __init__(self, bus: Bus) -> None:
        """Prepare; :meth:`start` starts the thread, and the caller closes the bus."""
        super().__init__(bus, 'devices', self._serve, 'the simulation')
        # the devices; add them before :meth:`start`, and leave them to the thread then:
        # :meth:`call` gets at them
        self.host = DeviceHost(self._send, _log_defect)

    @property
    def bus_name(self) -> str:
        """Where the devices are, as `can_interface_name` writes it."""
        return self._bus.name

    def _serve(self) -> None:
        host, woken = self.host, time.monotonic()
        while not self.stopping:
            host.advance(time.monotonic())
            self.do_work()
            rest = time.monotonic()
            due = min(host.deadline, rest + IDLE_WAIT)
            frames = self.receive(max(0.0, due - rest))
            now = time.monotonic()
            first = frames[0].timestamp or now if frames else due
            stalled = (rest - woken) + max(0.0, now - max(rest, min(due, first)))
            woken = now
            for frame in _pass_over(frames, now) if now - first > STALL else frames:
                host.receive(frame, frame.timestamp or now)
            if stalled > STALL:
                host.postpone_watches(stalled)

    def _send(self, frame: Frame) -> None:
        try:
            self._bus.send(frame)
        except BusError as error:
            self.note_failure(error)


def _pass_over(frames: list[Frame], now: float) -> list[Frame]:
    """Return what devices see of frames that waited because they got no processor."""
    kept = newest_process_data(frames)
    syncs = sum(frame.can_id == CobId.SYNC for frame in frames)
    if len(kept) == len(frames):
        return frames
    logger.warning(
        'the simulated devices got no processor for %.2f s: %d SYNC and %d other frames of '
        'process data are passed over, as by the mailboxes of a CAN controller',
        now - (frames[0].timestamp or now),
        max(0, syncs - 1),
        len(frames) - len(kept) - max(0, syncs - 1),
    )
    return kept


def newest_process_data(frames: Sequence[Frame]) -> list[Frame]:
    """Return what the mailboxes of a CAN controller hold of frames that were not read in time.

    A device that stood still sees the newest set-point, and does not follow all those of the past.
    Of SDO and NMT, whose clients wait for their answers, all is kept.
    """
    newest = {frame.can_id: frame for frame in frames}
    return [
        frame
        for frame in frames
        if not _is_process_data(frame.can_id) or newest[frame.can_id] is frame
    ]


def _is_process_data(can_id: int) -> bool:
    heartbeat = 0 < can_id - CobId.HEARTBEAT <= NODE_ID_MAX
    return CobId.SYNC <= can_id < CobId.SDO_RESPONSE or heartbeat


def _log_defect(device: Device, error: Exception) -> None:
    logger.error('a defect in the simulated device %d', device.node_id, exc_info=error)

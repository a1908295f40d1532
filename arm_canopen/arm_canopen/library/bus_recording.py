# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last frames of a bus for a black box, written as a log of candump."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from heapq import heappushpop
from pathlib import Path
import time

from black_box import Pause
from canopen_core.can import (
    format_line,
    Frame,
    frame_bits,
    FrameRing,
    log_channel,
    PAYLOAD_MAX,
    RecordedFrame,
    wall_clock_offset,
)

from ..config.model import BusConfig

LOG = 'can.log'
DISORDER = 1024  # frames by which one may come before an older one, after a pause of the process


class BusRecording:
    """Keeps what is sent and received.

    There is room for the window on a bus that is full of frames of eight bytes; on one with more
    frames than fit on the real one, or shorter ones, it reaches back less far.
    """

    def __init__(self, config: BusConfig, bus_name: str, window: float) -> None:
        """The ``window`` is how far back it reaches in [s]."""
        self._config = config
        self._bus_name = bus_name
        self._window = window
        self.ring = FrameRing(int(window * config.master.bitrate / frame_bits(PAYLOAD_MAX)) + 1)

    def sending(self, send: Callable[[Frame], None]) -> Callable[[Frame], None]:
        """Return a function that sends a frame and keeps it; one that is refused is not kept."""
        record, now, sent = self.ring.record, time.monotonic, FrameRing.SENT

        def send_and_record(frame: Frame) -> None:
            stamp = now()  # before, as its answer may come before this returns
            send(frame)
            record(frame, stamp, sent)

        return send_and_record

    def receiving(self, take: Callable[[Frame], None]) -> Callable[[Frame], None]:
        """Return a function that takes a received frame and keeps it."""
        record = self.ring.record

        def take_and_record(frame: Frame) -> None:
            record(frame, frame.timestamp)
            take(frame)

        return take_and_record

    @property
    def about(self) -> str:
        """The bus, and how much of it is kept."""
        devices = ', '.join(f'{node.name} ({node.node_id})' for node in self._config.nodes)
        return (
            f'black box of the bus {self._bus_name}: the last {self._window:g} s, at most '
            f'{self.ring.capacity} frames, in {LOG}\n'
            f'bus.yml: {self._config.file}\ndevices: {devices}'
        )

    def save(self, folder: Path, pause: Pause) -> Path:
        """Write the frames of the window in the order of their times.

        ``pause`` is called after each small piece of work.

        Raises:
            OSError: The file cannot be written.
        """
        offset, begin = wall_clock_offset(), time.monotonic() - self._window
        channel = log_channel(self._bus_name)
        path = folder / LOG
        with path.open('w', encoding='ascii') as file:
            for frames in _sorted(self.ring.chunks()):
                file.write(
                    ''.join(
                        format_line(frame, frame.timestamp + offset, channel, sent=sent)
                        for frame, sent in frames
                        if frame.timestamp >= begin
                    )
                )
                pause()
        return path

    def usage(self, path: Path) -> str:
        """Return the commands that show the log."""
        config = self._config.file
        return (
            f'ros2 run canopen_tools candump --read {path} --bus-config {config}\n'
            f'ros2 run arm_canopen replay --ros-args -p log:={path} -p bus_config:={config}'
        )


def _sorted(chunks: Iterator[list[RecordedFrame]]) -> Iterator[list[RecordedFrame]]:
    """Put frames in the order of their times; those that were sent wait for no kernel."""
    heap: list[tuple[float, int, RecordedFrame]] = []
    number = 0
    for chunk in chunks:
        ready = []
        for recorded in chunk:
            number += 1
            entry = (recorded.frame.timestamp, number, recorded)
            if len(heap) < DISORDER:
                heap.append(entry)
                if len(heap) == DISORDER:
                    heap.sort()
            else:
                ready.append(heappushpop(heap, entry)[2])
        yield ready
    yield [recorded for _, _, recorded in sorted(heap)]

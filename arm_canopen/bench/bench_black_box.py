#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the black box costs: time for each frame, memory, and a cycle while it is written.

All figures are printed, none is judged. CPU time, so that others on this computer do not count.
"""

from __future__ import annotations

from collections.abc import Callable
import gc
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
import time

from arm_canopen import load_bus
from arm_canopen.can import Frame
from arm_canopen.can.frame_ring import RECORD_SIZE
from arm_canopen.can.load import BusLoad
from arm_canopen.library.bus_recording import BusRecording
from black_box import BlackBox, BlackBoxSettings

BUS = Path(__file__).parents[2] / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'
WINDOW = 60.0  # [s]
FRAME_RATE = 2900  # [1/s] of seven drives with two PDOs each way at 10 ms
PERIOD = 0.01  # [s] of the cycle
FRAMES = 200_000


def frame_time(take: Callable[[Frame], None]) -> float:
    """Return the CPU time for a frame in [us]."""
    frame = Frame(0x181, bytes(8), time.monotonic())
    begin = time.process_time()
    for _ in range(FRAMES):
        take(frame)
    return (time.process_time() - begin) / FRAMES * 1e6


def lateness(until: Callable[[], bool]) -> list[float]:
    """Run a cycle until something holds; return how late each one was in [ms], in order."""
    late: list[float] = []
    deadline = time.monotonic() + PERIOD
    while not until():
        time.sleep(max(0.0, deadline - time.monotonic()))
        late.append((time.monotonic() - deadline) * 1e3)
        deadline += PERIOD * (1 + late[-1] // (PERIOD * 1e3))
    return sorted(late)


def show_lateness(title: str, late: list[float]) -> None:
    """Print percentiles."""
    last = len(late) - 1
    middle, high = late[last // 2], late[last * 99 // 100]
    print(f'{title:34} late by {middle:.2f} / {high:.2f} ms (p50 / p99), {len(late)} cycles')


def main() -> None:
    """Print the figures."""
    sys.setswitchinterval(0.0005)  # [s] as the master has it
    recording = BusRecording(load_bus(BUS), 'vcan0', WINDOW)
    nothing = frame_time(lambda frame: None)
    kept = recording.receiving(lambda frame: None)
    load = BusLoad(1_000_000, 0.0)
    print(f'a frame, kept        {frame_time(kept) - nothing:6.2f} us')
    print(f'a frame, bus load    {frame_time(load.count) - nothing:6.2f} us (for comparison)')
    share = (frame_time(kept) - nothing) * 1e-6 * FRAME_RATE
    print(f'at {FRAME_RATE} frames/s      {share:6.2%} of a core')
    print(f'memory               {recording.ring.capacity * RECORD_SIZE / 1e6:6.1f} MB')

    now = time.monotonic()
    for number in range(int(WINDOW * FRAME_RATE)):
        frame = Frame(0x181, bytes(8))
        recording.ring.record(frame, now - WINDOW + number / FRAME_RATE)
    gc.freeze()
    end = time.monotonic() + 3.0
    show_lateness('cycle, nothing is written', lateness(lambda: time.monotonic() > end))
    with TemporaryDirectory() as folder:
        box = BlackBox('bench', recording, BlackBoxSettings(Path(folder), WINDOW, after=0.0))
        box.start()
        box.fault('', 'a fault of the benchmark')
        begin = time.monotonic()
        show_lateness('cycle, the black box is written', lateness(lambda: box.last is not None))
        took = time.monotonic() - begin
        size = sum(path.stat().st_size for path in Path(folder).rglob('*.log'))
        print(f'written in           {took:6.1f} s, {size / 1e6:.1f} MB')
        box.close()


if __name__ == '__main__':
    main()

#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the black box costs: time for each frame, memory, and a cycle while it is written.

All figures are printed, none is judged. CPU time, so that others on this computer do not count.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import sys
import time

from black_box_cost import cycle_beside

from arm_canopen import load_bus
from arm_canopen.library.bus_recording import BusRecording
from canopen_core.can import Frame
from canopen_core.can.frame_ring import RECORD_SIZE
from canopen_core.can.load import BusLoad

BUS = Path(__file__).parents[2] / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'
WINDOW = 60.0  # [s]
FRAME_RATE = 2900  # [1/s] of seven drives with two PDOs each way at 10 ms
FRAMES = 200_000


def frame_time(take: Callable[[Frame], None]) -> float:
    """Return the CPU time for a frame in [us]."""
    frame = Frame(0x181, bytes(8), time.monotonic())
    begin = time.process_time()
    for _ in range(FRAMES):
        take(frame)
    return (time.process_time() - begin) / FRAMES * 1e6


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
    for line in cycle_beside(recording, WINDOW):
        print(line)


if __name__ == '__main__':
    main()

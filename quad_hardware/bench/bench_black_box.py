#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the black box costs: time for each read and report, memory, and a loop while it writes.

All figures are printed, none is judged. CPU time, so that others on this computer do not count.
"""

from __future__ import annotations

from collections.abc import Callable
import sys
import time
import tracemalloc

from black_box_cost import cycle_beside

from quad_description import ImuSample, RobotState
from quad_hardware.link import LinkState
from quad_hardware.protocol import Feedback, V2
from quad_hardware.recording import FaultWatch, SerialMemory, StateEntered
from quad_hardware.recording.tap import TappedPort
from quad_hardware.report import Report

WINDOW = 60.0  # [s]
REPORT_RATE, COMMAND_RATE = 50, 50  # [1/s]
READS_PER_REPORT = 3  # in which a report of 260 bytes comes from an FTDI adapter
COMMAND_SIZE = 70  # [B] of a frame for twelve servos
CALLS = 200_000


class ReadyPort:
    """A port that always has the same bytes."""

    path, baud = '/dev/ttyAMA0', V2.baud

    def __init__(self) -> None:
        self.data = Feedback().frame().encode(V2)

    def fileno(self) -> int:
        """Return a descriptor that is none."""
        return -1

    def read(self) -> bytes:
        """Return the bytes."""
        return self.data

    def write(self, data: bytes) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


def cpu_time(call: Callable[[], object], count: int = CALLS) -> float:
    """Return the CPU time of a call [us]."""
    begin = time.process_time()
    for _ in range(count):
        call()
    return (time.process_time() - begin) / count * 1e6


def filled(window: float) -> SerialMemory:
    """Return a memory with a window of protocol v2, reports and commands."""
    memory, now = SerialMemory('/dev/ttyAMA0', window), time.monotonic()
    memory.event(StateEntered(now - window, LinkState.RUNNING, 'reports arrive'))
    report = Feedback().frame().encode(V2)
    part = len(report) // READS_PER_REPORT + 1
    for number in range(int(window * REPORT_RATE)):
        at = now - window + number / REPORT_RATE
        for begin in range(0, len(report), part):
            memory.transfer(at, bytes(bytearray(report[begin : begin + part])), False)
        memory.transfer(at + 0.01, bytes(COMMAND_SIZE), True)
    return memory


def show_cost() -> None:
    """Print the CPU time of what is done in the thread of the driver."""
    port = ReadyPort()
    tap = TappedPort(port, [SerialMemory(port.path, WINDOW / 60)])
    read = cpu_time(tap.read) - cpu_time(port.read)
    write = cpu_time(lambda: tap.write(b'0' * 70)) - cpu_time(lambda: port.write(b'0' * 70))
    watch = FaultWatch()
    report = Report(0.0, 0.0, (0.0, 0.0, 0.0), None, {}, {}, device_time=0.0)
    state = RobotState(None, ImuSample((0.0, 0.0, 0.0, 1.0), None, None), None)
    look = cpu_time(lambda: watch.look(report, state, ''), CALLS // 10)
    print(f'a read, kept          {read:6.2f} us')
    print(f'a write, kept         {write:6.2f} us')
    print(f'a report, for faults  {look:6.2f} us')
    share = 1e-6 * (REPORT_RATE * (READS_PER_REPORT * read + look) + COMMAND_RATE * write)
    print(f'at {REPORT_RATE} reports/s       {share:6.2%} of a core')


def main() -> None:
    """Print the figures."""
    sys.setswitchinterval(0.0005)  # [s] as hardware_node has it
    show_cost()
    tracemalloc.start()
    memory = filled(WINDOW)
    taken, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    of_line = memory.size / 1e6
    print(f'memory                {taken / 1e6:6.1f} MB for {of_line:.1f} MB of the line')
    for line in cycle_beside(memory, WINDOW):
        print(line)


if __name__ == '__main__':
    main()

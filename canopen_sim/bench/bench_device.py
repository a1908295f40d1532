#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What simulated drives cost, without bus and in virtual time.

Seven drives with the PDOs of the article's bus.yml: in each SYNC cycle every drive gets two RPDOs
and sends two TPDOs.
"""

from __future__ import annotations

import math
from pathlib import Path
from time import process_time

from canopen_core.can import Frame
from canopen_core.eds import load_eds
from canopen_core.standard import sdo
from canopen_sim import DeviceHost

EDS = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
NODE_IDS = range(2, 9)
CYCLES = 2000
PERIOD = 0.01  # [s]

ARTICLE: tuple[tuple[int, int, int, tuple[int, ...]], ...] = (
    (0x1800, 0x180, 1, (0x60410010, 0x60610008)),
    (0x1801, 0x280, 1, (0x60640020, 0x606C0020)),
    (0x1400, 0x200, 255, (0x60400010, 0x60600008)),
    (0x1401, 0x300, 255, (0x607A0020, 0x60FF0020)),
)
"""Communication record, base of the COB-ID, transmission type and mapping."""

NONE, VELOCITY, CYCLIC = 0, 3, 8


class Network:
    """Seven drives, and a master that sends what it is given."""

    def __init__(self) -> None:
        """Boot and configure them."""
        self.now = 1.0
        self.frames = 0
        self.host = DeviceHost(self._count)
        dictionary = load_eds(EDS).dictionary
        for node_id in NODE_IDS:
            self.host.add(node_id, dictionary)
        self.host.advance(self.now)
        for node_id in NODE_IDS:
            self._configure(node_id)
        self.receive(0, b'\x01\x00')

    def _count(self, _frame: Frame) -> None:
        self.frames += 1

    def receive(self, can_id: int, data: bytes) -> None:
        """Send a frame to the drives."""
        self.host.receive(Frame(can_id, data), self.now)

    def write(self, node_id: int, index: int, subindex: int, value: int, size: int) -> None:
        """Write an object by SDO."""
        data = (value % (1 << 8 * size)).to_bytes(size, 'little')
        self.receive(0x600 + node_id, sdo.DownloadRequest(index, subindex, data, size).encode())

    def _configure(self, node_id: int) -> None:
        for number in range(4):
            for record in (0x1400, 0x1800):
                self.write(node_id, record + number, 1, 1 << 31, 4)
        for record, base, transmission, mapping in ARTICLE:
            self.write(node_id, record, 2, transmission, 1)
            self.write(node_id, record + 0x200, 0, 0, 1)
            for subindex, word in enumerate(mapping, start=1):
                self.write(node_id, record + 0x200, subindex, word, 4)
            self.write(node_id, record + 0x200, 0, len(mapping), 1)
            self.write(node_id, record, 1, base + node_id, 4)
        self.write(node_id, 0x1017, 0, 1000, 2)

    def command(self, word: int, mode: int) -> None:
        """Send controlword and mode to all."""
        for node_id in NODE_IDS:
            self.receive(0x200 + node_id, bytes((word, 0, mode)))

    def cycle(self, word: int, mode: int, position: int, velocity: int) -> None:
        """Do one SYNC cycle: RPDOs to all, then SYNC, then timers."""
        first = bytes((word, 0, mode))
        second = position.to_bytes(4, 'little', signed=True)
        second += velocity.to_bytes(4, 'little', signed=True)
        for node_id in NODE_IDS:
            self.receive(0x200 + node_id, first)
            self.receive(0x300 + node_id, second)
        self.receive(0x080, b'')
        self.now += PERIOD
        if self.host.deadline <= self.now:
            self.host.advance(self.now)


def cycle_cost(mode: int, velocity: int, amplitude: float) -> tuple[float, float]:
    """Return [us] per cycle of seven drives, and the frames that they sent in each."""
    network = Network()
    for word in (0x06, 0x07, 0x0F):
        network.command(word if mode else 0, mode)
    network.frames = 0
    start = process_time()
    for number in range(CYCLES):
        position = round(amplitude * (1.0 - math.cos(0.01 * number)))
        network.cycle(0x0F if mode else 0, mode, position, velocity)
    return (process_time() - start) / CYCLES * 1e6, network.frames / CYCLES


def main() -> None:
    """Print the figures."""
    head = 'seven drives, one SYNC cycle (14 RPDOs and a SYNC in)'
    print(f'{head:<56}{"us":>8}{"frames out":>12}{"% at 10 ms":>13}')
    for title, mode, velocity, amplitude in (
        ('disabled', NONE, 0, 0.0),
        ('enabled, at rest', CYCLIC, 0, 0.0),
        ('moving, profile velocity', VELOCITY, 500, 0.0),
        ('moving, cyclic synchronous position', CYCLIC, 0, 2000.0),
    ):
        cost, frames = cycle_cost(mode, velocity, amplitude)
        print(f'  {title:<54}{cost:8.0f}{frames:12.1f}{cost / PERIOD / 1e4:13.2f}')


if __name__ == '__main__':
    main()

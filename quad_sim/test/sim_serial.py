# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated robot on a real pseudo-terminal inside the test's process."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
import threading
import time

import serial

from quad_hardware.protocol import Frame, Protocol, ROBOT_KINDS, StreamParser, V2
from quad_sim.options import build, parse_arguments, Simulation
from quad_sim.server import PseudoTerminal, Server

TEST_TIMEOUT = 10.0  # [s] until a test gives up


class Served:
    """A robot that lives, and the path of its port."""

    def __init__(self, simulation: Simulation, server: Server, path: Path) -> None:
        self.simulation, self.server, self.path = simulation, server, path

    def do(self, action: Callable[[], object]) -> object:
        """Have something done between two turns of the robot's loop."""
        return self.server.submit(action).result(TEST_TIMEOUT)


@contextmanager
def serve(link: Path, *arguments: str) -> Iterator[Served]:
    """Simulate a robot that the arguments of fake_xgo describe."""
    simulation = build(parse_arguments(['--link', str(link), *arguments]))
    with PseudoTerminal(link) as terminal:
        server = Server(simulation.plant, simulation.line, terminal)
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            yield Served(simulation, server, link)
        finally:
            server.stop()
            thread.join(TEST_TIMEOUT)
            server.close()


class Listener:
    """Collects the frames that a robot sends."""

    def __init__(self, path: Path, protocol: Protocol = V2) -> None:
        """Open the port at the protocol's speed."""
        self.protocol = protocol
        self.port = serial.Serial(str(path), protocol.baud, timeout=0.05)
        self.parser = StreamParser(protocol, ROBOT_KINDS)
        self.frames: list[Frame] = []
        self.times: list[float] = []

    def send(self, frame: Frame) -> None:
        """Send a frame."""
        self.port.write(frame.encode(self.protocol))

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Listen until something holds."""
        deadline = time.monotonic() + TEST_TIMEOUT
        while not condition():
            assert time.monotonic() < deadline, f'no {what}'
            for frame in self.parser.feed(self.port.read(max(self.port.in_waiting, 1))):
                self.frames.append(frame)
                self.times.append(time.monotonic())

    def count(self, number: int) -> list[Frame]:
        """Listen until that many more frames are there, and return them."""
        before = len(self.frames)
        self.until(lambda: len(self.frames) >= before + number, f'{number} frames')
        return self.frames[before:]

    def hush(self, duration: float) -> int:
        """Listen for a time; return how many frames came."""
        before, end = len(self.frames), time.monotonic() + duration
        self.until(lambda: time.monotonic() > end, 'end')
        return len(self.frames) - before

    def close(self) -> None:
        """Close the port."""
        self.port.close()

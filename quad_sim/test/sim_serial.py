# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated robots on serial lines, in virtual time or a pseudo-terminal; a client of v1."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
import struct
import threading
import time

import serial

from quad_hardware.calibration.wizard import LimpRobot
from quad_hardware.link.dialects import V1Dialect, V2Dialect
from quad_hardware.protocol import Frame, LEG_MOTORS, Protocol, ROBOT_KINDS, StreamParser, V1, V2
from quad_hardware.report import Report
from quad_sim.options import build, parse_arguments, Simulation
from quad_sim.server import PseudoTerminal, Server

TICK = 0.001  # [s]


class VirtualRobot:
    """The robot that the arguments of fake_xgo describe; nothing here waits."""

    def __init__(self, *arguments: str, protocol: Protocol = V2) -> None:
        """Build it and begin at time zero."""
        self.simulation = build(parse_arguments(list(arguments)))
        self.line = self.simulation.line
        self.protocol = protocol
        self.line.set_baud(protocol.baud)
        self.parser = StreamParser(protocol, ROBOT_KINDS)
        self.now = 0.0
        self.received = b''

    def send(self, frame: Frame) -> None:
        """Begin to send a frame."""
        self.line.receive(frame.encode(self.protocol), self.now)

    def run(self, duration: float) -> list[Frame]:
        """Advance the time; return the frames that arrived."""
        frames = []
        for _ in range(round(duration / TICK)):
            self.now += TICK
            if data := self.line.advance(self.now):
                self.received += data
                frames += self.parser.feed(data)
        return frames

    def ask(self, frame: Frame) -> list[Frame]:
        """Send a frame and return what comes within 20 ms."""
        self.send(frame)
        return self.run(0.02)


class V1Client:
    """A client of protocol v1 written from the public description of its bytes.

    It shares nothing with the product: no table, no codec, no parser. Its habits are those of the
    vendor's library: servos are written one frame at a time, an answer is
    taken without looking at its kind or address.
    """

    def __init__(self, *arguments: str) -> None:
        """Simulate the robot that the arguments of fake_xgo describe, without noise."""
        self.robot = VirtualRobot('--noise', 'none', *arguments, protocol=V1)

    def exchange(self, data: bytes) -> bytes:
        """Send bytes; return those that come within 20 ms."""
        self.robot.received = b''
        self.robot.line.receive(data, self.robot.now)
        self.robot.run(0.02)
        return self.robot.received

    def write(self, address: int, data: bytes) -> None:
        """Send a write."""
        length = 8 + len(data)
        check = 255 - (length + 0x00 + address + sum(data)) % 256
        frame = b'\x55\x00' + bytes([length, 0x00, address]) + data + bytes([check]) + b'\x00\xaa'
        assert self.exchange(frame) == b''

    def read(self, address: int, count: int) -> bytes:
        """Ask for bytes and return the data of the answer, empty without one."""
        check = 255 - (9 + 0x02 + address + count) % 256
        answer = self.exchange(bytes([0x55, 0x00, 9, 0x02, address, count, check, 0x00, 0xAA]))
        if answer:
            assert (answer[:2], answer[-2:], answer[2]) == (b'\x55\x00', b'\x00\xaa', len(answer))
            assert sum(answer[2:-2]) % 256 == 255
        return answer[5:-3]

    def imu(self) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]:
        """Read acceleration [m/s2], rate [deg/s] and attitude [deg]."""
        words = struct.unpack('<6h3f', self.read(0x65, 24))
        acceleration = tuple(word / 16384 * 9.8 for word in words[:3])
        return acceleration, tuple(word / 16.4 for word in words[3:6]), words[6:]

    def attitude(self) -> tuple[float, ...]:
        """Read roll, pitch and yaw one after the other [deg]."""
        parts = (self.read(code, 4) for code in (0x62, 0x63, 0x64))
        return tuple(float(struct.unpack('<f', part)[0]) for part in parts)


class Line(LimpRobot):
    """A robot on its serial line, bytes and all, in virtual time."""

    def __init__(self, *arguments: str, protocol: Protocol) -> None:
        self.robot = VirtualRobot(*arguments, protocol=protocol)
        self.dialect = (V1Dialect if protocol is V1 else V2Dialect)(0.0)
        self._arrived: list[Report] = []
        self._first: dict[int, float] = {}
        self.swung: set[int] = set()  # motors that were sent anywhere

    def now(self) -> float:
        """Return the virtual time [s]."""
        return self.robot.now

    def wait_until(self, moment: float) -> None:
        """Let the time pass."""
        while self.robot.now < moment:
            self._pass()

    def _pass(self) -> float:
        sent = -1.0
        now, commanding = self.robot.now, self.dialect.pending
        if data := self.dialect.step(now).send:
            self.robot.line.receive(data, now)
            if commanding and not self.dialect.pending:
                sent = now + self.dialect.protocol.wire_time(len(data))
        for frame in self.robot.run(TICK):
            if report := self.dialect.handle_frame(frame, self.robot.now):
                self._arrived.append(report)
        return sent

    def command(self, angles: Mapping[int, float]) -> float:
        """Send angles [deg]; return when they had left."""
        self.swung |= {m for m, a in angles.items() if a != self._first.setdefault(m, a)}
        self.dialect.command(angles)
        while (sent := self._pass()) < 0.0:
            pass
        return sent

    def rounded(self, motor: int, angle: float) -> float:
        """Return an angle as the line brings it [deg]."""
        span = self.dialect.spans.get(motor)
        return angle if span is None else span.decode(span.encode(angle))

    def reports(self) -> list[Report]:
        """Return the reports since."""
        reports, self._arrived = self._arrived, []
        return reports

    def angles(self) -> dict[int, float]:
        """Return the angles of now [deg]."""
        self.wait_until(self.robot.now + 0.1)
        found = self._arrived[-1].positions
        return {motor: found[motor] for motor in LEG_MOTORS}


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

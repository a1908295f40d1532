# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated robot on its serial line in virtual time: the test moves the clock."""

from __future__ import annotations

from collections.abc import Mapping

from quad_hardware.link.dialects import V1Dialect, V2Dialect
from quad_hardware.protocol import (
    Frame,
    LEG_MOTORS,
    Protocol,
    ROBOT_KINDS,
    StreamParser,
    V1,
    V2,
)
from quad_hardware.report import Report
from quad_sim.options import build, parse_arguments

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


class Line:
    """A robot on its serial line, bytes and all, in virtual time."""

    def __init__(self, *arguments: str, protocol: Protocol) -> None:
        self.robot = VirtualRobot(*arguments, protocol=protocol)
        self.dialect = (V1Dialect if protocol is V1 else V2Dialect)(0.0)
        self._reports: list[Report] = []
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
                self._reports.append(report)
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
        reports, self._reports = self._reports, []
        return reports

    def angles(self) -> dict[int, float]:
        """Return the angles of now [deg]."""
        self.wait_until(self.robot.now + 0.1)
        found = self._reports[-1].positions
        return {motor: found[motor] for motor in LEG_MOTORS}

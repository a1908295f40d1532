# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated robot on its serial line in virtual time: the test moves the clock."""

from __future__ import annotations

from quad_hardware.protocol import Frame, Protocol, ROBOT_KINDS, StreamParser, V2
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

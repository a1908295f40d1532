# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot as the log of its serial line shows it: the same frames, dialect and estimation."""

from __future__ import annotations

from dataclasses import replace
import math

from .exceptions import RecordingError
from .link import Dialect, LinkState, LinkStatus, make_dialect, QUIET_TIME
from .protocol import Frame, HOST_KINDS, LEG_MOTORS, PROTOCOLS, ROBOT_KINDS, StreamParser, V1
from .recording import Entry, Opened, StateEntered, Transfer
from .serial_robot import ObservedRobot, RobotSettings


class ReplayedRobot(ObservedRobot):
    """Takes what a serial log has; nothing is written to a port, for there is none.

    What a :class:`.SerialRobot` decides by looking at bytes is decided anew, by the same parser,
    dialect and estimation; states of the link are those of the log, which has no commands that
    were not sent. Times are those of the log [s].
    """

    def __init__(self, settings: RobotSettings) -> None:
        super().__init__(settings)
        self._status = LinkStatus(detail='the log begins')
        self._dialect: Dialect | None = None  # how the robot was talked to
        self._now = self._bytes_at = 0.0
        self._reported_at = -math.inf

    def status(self) -> LinkStatus:
        """Return how the link was."""
        age = self._now - self._reported_at
        if self._dialect is None:
            return replace(self._status, age=age)
        counters = self._received.counters, self._dialect.counters
        return replace(self._status, age=age, parser=counters[0], dialect=counters[1])

    def take(self, entry: Entry, now: float) -> None:
        """Process the next entry of the log.

        Raises:
            RecordingError: These bytes cannot be read.
        """
        self.advance(now)
        if isinstance(entry, Opened):
            self._open(entry)
        elif isinstance(entry, StateEntered):
            self._enter(entry.state, entry.detail)
        else:
            self._transfer(entry)

    def advance(self, now: float) -> None:
        """Advance the time: the rest of a frame may not come any more."""
        self._now = now
        if self._dialect is None or not self._received.pending:
            return
        if now - self._bytes_at > QUIET_TIME:
            self._handle(self._received.expire(), self._dialect)

    def restart(self) -> None:
        """Forget the robot, as the log begins again; time goes on."""
        self._begin()
        self._dialect = None
        self._enter(LinkState.CONNECTING, 'the log begins again')

    def _open(self, opened: Opened) -> None:
        protocol = next((each for each in PROTOCOLS if each.name == opened.protocol), None)
        if protocol is None:
            known = ', '.join(each.name for each in PROTOCOLS)
            raise RecordingError(
                f'the session was recorded in protocol {opened.protocol!r}, and only {known} can '
                'be replayed; what went through the vendor’s library is known to it alone'
            )
        if protocol is V1 and opened.model is None:
            raise RecordingError('the line `open` has no model, whose ranges scale protocol v1')
        self._dialect = make_dialect(opened.model, self._now)
        self._received = StreamParser(protocol, ROBOT_KINDS)
        self._sent = StreamParser(protocol, HOST_KINDS)
        status = self._status
        status.protocol, status.baud = opened.protocol, opened.baud
        status.firmware = opened.firmware
        status.connections += 1
        self._reported_at = self._now

    def _enter(self, state: LinkState, detail: str) -> None:
        self._status.state, self._status.detail = state, detail
        if state is not LinkState.RUNNING:
            self.latest = None
        self.on_change(state, detail)

    def _transfer(self, transfer: Transfer) -> None:
        if self._dialect is None:
            raise RecordingError(
                'the log has bytes before the line `open`, which has their protocol; keep that '
                'line when you cut a log'
            )
        if transfer.sent:
            for frame in self._sent.feed(transfer.data):
                self._command(self._dialect, frame)
            return
        self._bytes_at = self._now
        self._handle(self._received.feed(transfer.data), self._dialect)

    def _command(self, dialect: Dialect, frame: Frame) -> None:
        """Process a frame that was sent; targets of the legs show which feet stand."""
        angles = dialect.handle_sent(frame, self._now)
        if angles.keys() >= set(LEG_MOTORS):
            self._status.commands += 1
            positions = self._settings.joints.positions(angles)
            legs = self.names[: self._settings.joints.leg_count]
            self._estimator.command(self._now, [positions[name] for name in legs])

    def _handle(self, frames: list[Frame], dialect: Dialect) -> None:
        for frame in frames:
            report = dialect.handle_frame(frame, self._now)
            if report is None:
                continue
            if refusal := self._report(report):
                self._status.refused += 1
                self._status.refusal = refusal
            else:
                self._reported_at = self._now

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot as the log of its serial line shows it: the same frames, dialect and estimation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import Any

from quad_description import RobotState

from .estimation import Estimator, Health, OdometryState
from .exceptions import RecordingError
from .link import Dialect, DialectCounters, LinkState, LinkStatus, make_dialect, QUIET_TIME
from .protocol import (
    Frame,
    HOST_KINDS,
    LEG_MOTORS,
    ParserCounters,
    PROTOCOLS,
    ROBOT_KINDS,
    StreamParser,
    V1,
)
from .recording import Entry, Opened, StateEntered, Transfer
from .report import Report
from .serial_robot import RobotSettings


@dataclass(slots=True)
class _Conversation:
    """A robot that was found."""

    opened: Opened  # what it was found as
    dialect: Dialect[Any]  # how it was talked to
    robot: StreamParser  # finds frames in what it sent
    host: StreamParser  # finds frames in what was sent to it


class ReplayedRobot:
    """Takes what a serial log has; nothing is written to a port, for there is none.

    What a :class:`.SerialRobot` decides by looking at bytes is decided anew, by the same parser,
    dialect and estimation; states of the link are those of the log. Times are those of the log
    [s].
    """

    def __init__(
        self,
        settings: RobotSettings,
        *,
        on_state: Callable[[RobotState], None],
        on_change: Callable[[LinkState, str], None],
        on_refusal: Callable[[str], None],
    ) -> None:
        """Begin without a robot.

        Args:
            on_state: Takes each report as a state in SI units, without the position.
            on_change: Takes the state of the link when it changes, and its detail.
            on_refusal: Takes why a report cannot be.

        Raises:
            CommandError: The legs of the URDF cannot be read.
        """
        self.names = settings.joints.names  # joints in the order of the URDF
        self._settings = settings
        self._on_state, self._on_change = on_state, on_change
        self._on_refusal = on_refusal
        self._estimator = self._new_estimator()
        self._conversation: _Conversation | None = None
        self._latest: tuple[Report, RobotState] | None = None
        self._state, self._detail = LinkState.CONNECTING, 'the log begins'
        self._now = self._bytes_at = 0.0
        self._reported_at = -math.inf
        self._connections = self._commands = self._refused = 0

    @property
    def latest(self) -> tuple[Report, RobotState] | None:
        """The newest report and its state; None while the link does not run."""
        return self._latest

    def status(self) -> LinkStatus:
        """Return how the link was; commands that were not sent are in no log."""
        found = self._conversation
        return LinkStatus(
            state=self._state,
            detail=self._detail,
            protocol=found.opened.protocol if found else '',
            baud=found.opened.baud if found else 0,
            firmware=found.opened.firmware if found else '',
            connections=self._connections,
            age=self._now - self._reported_at,
            commands=self._commands,
            dropped=0,
            parser=found.robot.counters if found else ParserCounters(),
            dialect=found.dialect.counters if found else DialectCounters(),
            refused=self._refused,
        )

    def health(self) -> Health:
        """Return how the robot was, by its latest reports."""
        return self._estimator.health()

    def update_odometry(self, state: RobotState) -> OdometryState | None:
        """Return where the body was by a state, to be called once for each."""
        return self._estimator.update_odometry(state)

    def take(self, entry: Entry, now: float) -> None:
        """Take the next entry of the log.

        Raises:
            RecordingError: Nobody can read these bytes.
        """
        self.advance(now)
        if isinstance(entry, Opened):
            self._open(entry)
        elif isinstance(entry, StateEntered):
            self._enter(entry.state, entry.detail)
        else:
            self._transfer(entry)

    def advance(self, now: float) -> None:
        """Let time pass: the rest of a frame may not come any more."""
        self._now = now
        found = self._conversation
        if found is not None and found.robot.pending and now - self._bytes_at > QUIET_TIME:
            self._handle(found.robot.expire(), found.dialect)

    def restart(self) -> None:
        """Forget the robot, as the log begins again; time goes on."""
        self._estimator = self._new_estimator()
        self._conversation = None
        self._enter(LinkState.CONNECTING, 'the log begins again')

    def _new_estimator(self) -> Estimator:
        return Estimator(self._settings.urdf, self._settings.joints, self._settings.estimator)

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
        self._conversation = _Conversation(
            opened,
            make_dialect(opened.model, self._now),
            StreamParser(protocol, ROBOT_KINDS),
            StreamParser(protocol, HOST_KINDS),
        )
        self._connections += 1
        self._reported_at = self._now

    def _enter(self, state: LinkState, detail: str) -> None:
        self._state, self._detail = state, detail
        if state is not LinkState.RUNNING:
            self._latest = None
        self._on_change(state, detail)

    def _transfer(self, transfer: Transfer) -> None:
        found = self._conversation
        if found is None:
            raise RecordingError(
                'the log has bytes before the line `open`, which has their protocol; keep that '
                'line when you cut a log'
            )
        if transfer.sent:
            for frame in found.host.feed(transfer.data):
                self._command(found.dialect, frame)
            return
        self._bytes_at = self._now
        self._handle(found.robot.feed(transfer.data), found.dialect)

    def _command(self, dialect: Dialect[Any], frame: Frame) -> None:
        """Take a frame that was sent; targets of the legs show which feet stand."""
        angles = dialect.handle_sent(frame, self._now)
        if angles.keys() >= set(LEG_MOTORS):
            self._commands += 1
            positions = self._settings.joints.positions(angles)
            legs = self.names[: self._settings.joints.leg_count]
            self._estimator.command(self._now, [positions[name] for name in legs])

    def _handle(self, frames: list[Frame], dialect: Dialect[Any]) -> None:
        for frame in frames:
            report = dialect.handle_frame(frame, self._now)
            if report is not None:
                self._report(report)

    def _report(self, report: Report) -> None:
        state = self._estimator.update(report)
        if state is None:
            self._refused += 1
            self._on_refusal(self._estimator.refusal)
            return
        self._reported_at = self._now
        self._latest = report, state
        self._on_state(state)

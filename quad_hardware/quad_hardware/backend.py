# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Back ends for the robot on its serial port, or in a serial log; no ROS."""

from __future__ import annotations

from collections.abc import Sequence
import logging
import math
from pathlib import Path
import threading
import time

from quad_description import Backend, JointSample, movable_joints, RobotState

from .estimation import EstimatorSettings, ImuMounting
from .exceptions import CommandError, NoAnswerError, RecordingError
from .filters import JointRate
from .joints import JointMap, servo_of
from .link import Dialect, LinkOptions, LinkState, LinkStatus, make_dialect, QUIET_TIME, STALE_TIME
from .protocol import (
    ANGLE_SPANS,
    Frame,
    HOST_KINDS,
    LEG_MOTORS,
    Model,
    Protocol,
    PROTOCOLS,
    ROBOT_KINDS,
    StreamParser,
    V2,
)
from .recording import Entry, Opened, read_serial_log, StateEntered, Transfer
from .serial_robot import ObservedRobot, RobotSettings, SerialRobot


class ReplayedRobot(ObservedRobot):
    """Processes a serial log; has no port, so nothing is sent.

    It evaluates the bytes anew with the parser, dialect and estimation of :class:`.SerialRobot`;
    link states come from the log, which lacks commands that were not sent. Times are those of the
    log [s].
    """

    def __init__(self, settings: RobotSettings) -> None:
        super().__init__(settings)
        self._status = LinkStatus(detail='the log begins')
        self._dialect: Dialect | None = None  # how the robot was talked to
        self._now = self._bytes_at = 0.0
        self._reported_at = -math.inf

    def status(self) -> LinkStatus:
        """Return the link status at this time of the log."""
        return self._status.at(self._now - self._reported_at)

    def take(self, entry: Entry, now: float) -> None:
        """Process the next entry of the log.

        Raises:
            RecordingError: The bytes cannot be decoded.
        """
        self.advance(now)
        if isinstance(entry, Opened):
            self._open(entry)
        elif isinstance(entry, StateEntered):
            self._enter(entry.state, entry.detail)
        else:
            self._transfer(entry)

    def advance(self, now: float) -> None:
        """Advance the time; discard an incomplete frame after a time-out."""
        self._now = now
        if self._dialect is None or not self._received.pending:
            return
        if now - self._bytes_at > QUIET_TIME:
            self._handle(self._received.expire(), self._dialect)

    def restart(self) -> None:
        """Reset the robot, because the log restarts; time continues."""
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
        if protocol is not V2 and opened.model is None:
            raise RecordingError('the line `open` has no model, whose ranges scale the bytes')
        self._dialect = make_dialect(protocol, opened.model, self._now)
        self._received = StreamParser(protocol, ROBOT_KINDS)
        self._sent = StreamParser(protocol, HOST_KINDS)
        status = self._status
        status.protocol, status.baud = opened.protocol, opened.baud
        status.firmware = opened.firmware
        status.parser, status.dialect = self._received.counters, self._dialect.counters
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
        """Count a frame that moves all legs."""
        self._status.commands += dialect.handle_sent(frame, self._now).keys() >= set(LEG_MOTORS)

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


CONNECT_TIME = 10.0  # [s] in which the robot has to be found

_log = logging.getLogger(__name__)


def robot_at(
    port: str, urdf: str, protocols: Sequence[Protocol] = PROTOCOLS, *, imu_checked: bool = False
) -> SerialBackend:
    """Return the back end of a robot described by its URDF.

    Args:
        protocols: Protocols to try, in this order.
        imu_checked: The IMU mounting was checked against the URDF; true in simulation.

    Raises:
        CommandError: The legs of the URDF cannot be read.
    """
    link = LinkOptions(port, tuple(protocols))
    return SerialBackend(_settings_of(link, urdf, imu_checked=imu_checked))


def recorded_in(log: Path, urdf: str, *, imu_checked: bool = False) -> list[RobotState]:
    """Return the states in a serial log, in order.

    Args:
        log: Log of a black box, or of the parameter ``serial_log`` of hardware_node.
        imu_checked: See :func:`robot_at`.

    Raises:
        CommandError: The legs of the URDF cannot be read.
        RecordingError: The log is damaged, or contains no report.
        OSError: The log cannot be read.
    """
    states: list[RobotState] = []
    robot = ReplayedRobot(_settings_of(LinkOptions(str(log)), urdf, imu_checked=imu_checked))
    robot.on_state, robot.on_change, robot.on_refusal = states.append, _log_link, _log.warning
    for entry in read_serial_log(log):
        robot.take(entry, entry.time)
    if not states:
        raise RecordingError(f'{log} has no report of a robot')
    return states


class SerialBackend(Backend):
    """Commands and observes a robot on its serial port.

    A step ends with the next report of the robot. Without a step for 0.5 s while a leg is in the
    air, and at the end, the robot lies down (see :class:`.LossReaction`).
    """

    def __init__(self, settings: RobotSettings) -> None:
        """Set up the back end; :meth:`reset` opens the port.

        Raises:
            CommandError: The legs of the URDF cannot be read.
        """
        self._robot = SerialRobot(settings)
        self._robot.on_state, self._robot.on_change = self._take, self._change
        self._robot.on_refusal = self._robot.on_warning = _log.warning
        self.names, self.period = self._robot.names, 1.0 / settings.link.rate
        self._arrived = threading.Condition()
        self._state: RobotState | None = None
        self._count = 0  # of states
        self._running = False  # the link takes commands
        self._commanding = threading.RLock()
        self._commanded_at: float | None = None  # None: their end was dealt with
        self._started = False

    def reset(self) -> RobotState:
        """Wait for a report; do not move the robot.

        Raises:
            NoAnswerError: No robot reports within 10 s.
        """
        if not self._started:
            self._started = True
            self._robot.start()
        return self._next_state(CONNECT_TIME)

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets and wait for the next report.

        Raises:
            CommandError: The targets were not sent; the message has the reason.
            NoAnswerError: The robot was lost.
        """
        if targets is not None:
            with self._commanding:
                if not self._robot.command(targets):
                    raise CommandError(self._robot.counters.reason)
                self._commanded_at = time.monotonic()
        return self._next_state(STALE_TIME)

    def observe(self) -> RobotState:
        """Return the state of the newest report.

        Raises:
            NoAnswerError: There is no report.
        """
        with self._arrived:
            if self._state is None:
                raise NoAnswerError(self._robot.status().reason('no report has come yet'))
            return self._state

    def close(self) -> None:
        """Lay the robot down if a leg is in the air, and close the port."""
        with self._commanding:
            self._commanded_at = None
            self._robot.end(_log.error)

    def _next_state(self, timeout: float) -> RobotState:
        with self._arrived:
            seen = self._count
            arrived = self._arrived.wait_for(lambda: self._running and self._count > seen, timeout)
            if not arrived:
                raise NoAnswerError(self._robot.status().reason(f'no report for {timeout} s'))
            return self.observe()

    # -- in the thread of the driver

    def _take(self, state: RobotState) -> None:
        with self._arrived:
            self._state, self._count = state, self._count + 1
            self._arrived.notify_all()
        if self._commanding.acquire(blocking=False):  # who holds it commands, or ends
            try:
                self._watch_commands()
            finally:
                self._commanding.release()

    def _watch_commands(self) -> None:
        """Lay the robot down if its commands ended with a leg in the air."""
        if self._robot.goes_down:
            self._robot.go_down()
        elif self._commanded_at and time.monotonic() - self._commanded_at > self._robot.timeout:
            self._commanded_at = None
            if loss := self._robot.miss_commands():
                _log.error(loss)

    def _change(self, state: LinkState, detail: str) -> None:
        with self._arrived:
            self._running = state is LinkState.RUNNING
            if not self._running:
                self._state = None
            self._arrived.notify_all()
        _log_link(state, detail)


def _settings_of(link: LinkOptions, urdf: str, *, imu_checked: bool) -> RobotSettings:
    joints = JointMap(map(servo_of, movable_joints(urdf)))
    mounting = ImuMounting(checked=imu_checked, rates_checked=imu_checked)
    return RobotSettings(link, urdf, joints, estimator=EstimatorSettings(mounting=mounting))


def _log_link(state: LinkState, detail: str) -> None:
    _log.info('%s: %s', state.value, detail)


class JointBytes:
    """Joint positions rounded as in protocol v1, with estimated velocities.

    For simulations without a serial line.
    """

    def __init__(self, urdf: str, model: Model = Model.LITE) -> None:
        self._servos = [servo_of(joint) for joint in movable_joints(urdf)]
        self._spans = [ANGLE_SPANS[model][servo.motor] for servo in self._servos]
        self._positions = [  # [rad] of each byte, for each joint
            [servo.position(span.decode(byte)) for byte in range(256)]
            for servo, span in zip(self._servos, self._spans, strict=True)
        ]
        self.reset()

    def reset(self) -> None:
        """Clear the past positions."""
        self._rate = JointRate(EstimatorSettings().joint_velocity_cutoff)

    def rounded(self, positions: Sequence[float]) -> tuple[float, ...]:
        """Round positions in the order of the URDF [rad] to one byte each."""
        return tuple(
            positions_of[span.encode(servo.angle(position))]
            for servo, span, positions_of, position in zip(
                self._servos, self._spans, self._positions, positions, strict=True
            )
        )

    def read(self, positions: Sequence[float], time: float) -> JointSample:
        """Return the bridge's estimate for positions [rad] at a time [s]."""
        seen = self.rounded(positions)
        named = {servo.joint: each for servo, each in zip(self._servos, seen, strict=True)}
        rates = tuple(self._rate.update(time, named).values())
        return JointSample(seen, rates, time, velocity_error=self._rate.error)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps the conversation with a robot going in a thread of its own, whatever the cable does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
import os
import select
import threading
import time

from ..exceptions import LinkError
from ..protocol import (
    Model,
    model_of_firmware,
    NEW,
    ParserCounters,
    Protocol,
    PROTOCOLS,
    ROBOT_KINDS,
    StreamParser,
)
from .dialect import Dialect, DialectCounters
from .new_dialect import NewDialect
from .old_dialect import OldDialect
from .port import SerialPort
from .probe import connect, Connection
from .state import RobotState

STALE_TIME = 0.5  # [s] without a report, after which nothing is sent any more
PROBE_AGAIN = 3.0  # [s] without a report, after which the robot is looked for anew
RETRY_PERIOD = 0.5  # [s] between attempts to open a port
QUIET_TIME = 0.015  # [s] longer than a pause inside a frame, shorter than one between states


class LinkState(Enum):
    """What a driver is doing."""

    CONNECTING = 'connecting'  # no port, or nobody answers
    WAITING = 'waiting'  # a robot answered and has not reported yet
    RUNNING = 'running'
    STALE = 'stale'  # the port is open and no report came for STALE_TIME
    STOPPED = 'stopped'


@dataclass(frozen=True, slots=True)
class LinkStatus:
    """How a link is at one moment.

    Attributes:
        state: What the driver is doing.
        detail: In words; why, when it is not running.
        protocol: What the robot speaks; empty while there is none.
        baud: Speed of the line [bit/s].
        firmware: Version of the robot.
        connections: How often a robot was found.
        age: Since the last report [s]; infinite before the first.
        commands: Joint commands handed to the line.
        dropped: Joint commands that were not sent, because the link was not running.
        parser: What the parser saw in this connection.
        dialect: What the dialect saw in this connection.
    """

    state: LinkState
    detail: str
    protocol: str
    baud: int
    firmware: str
    connections: int
    age: float
    commands: int
    dropped: int
    parser: ParserCounters
    dialect: DialectCounters


@dataclass(frozen=True, slots=True)
class LinkOptions:
    """Where the robot is, and how to talk to it.

    Attributes:
        path: Device file.
        protocols: What to try, in this order.
        baud: Speed [bit/s]; 0 takes each protocol's own.
        model: Whose ranges scale bytes in the old protocol; None asks the firmware.
        rate: Reports a second [Hz].
    """

    path: str
    protocols: tuple[Protocol, ...] = PROTOCOLS
    baud: int = 0
    model: Model | None = None
    rate: int = 50


class Driver:
    """A robot on a serial port.

    ``on_state`` is called in the thread of the driver for each report, ``on_change`` when the
    state of the link changes; both must be quick. Nothing is sent to servos while no reports
    come: they hold their last target.
    """

    def __init__(
        self,
        options: LinkOptions,
        on_state: Callable[[RobotState], None],
        on_change: Callable[[LinkState, str], None],
    ) -> None:
        """Prepare; :meth:`start` begins."""
        self._options = options
        self._on_state = on_state
        self._on_change = on_change
        self._thread = threading.Thread(target=self._run, name='serial', daemon=True)
        self._stopping = threading.Event()
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._mailbox: Mapping[int, float] | None = None
        self._torque: bool | None = None
        self._state = LinkState.CONNECTING
        self._detail = 'not started'
        self._connection: Connection | None = None
        self._parser: StreamParser | None = None
        self._dialect: Dialect | None = None
        self._connections = 0
        self._commands = 0
        self._dropped = 0
        self._reported_at = -float('inf')

    def start(self) -> None:
        """Start the thread, which looks for the robot until it finds it."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread and close the port; servos hold their last target."""
        self._stopping.set()
        self._wake()
        if self._thread.is_alive():
            self._thread.join()
        for descriptor in (self._wake_read, self._wake_write):
            os.close(descriptor)

    def command(self, angles: Mapping[int, float]) -> bool:
        """Have servo angles sent at once; a newer command replaces one not sent yet.

        Args:
            angles: By motor id [deg]; all legs, and the arm where it is fitted.

        Returns:
            False when the link is not running, and nothing will be sent.
        """
        if self._state is not LinkState.RUNNING:
            self._dropped += 1
            return False
        self._mailbox = angles
        self._wake()
        return True

    def torque(self, *, on: bool) -> bool:
        """Have all servos hold their place, or let go: the robot drops then.

        Returns:
            False when the link is not running, and nothing will be sent.
        """
        if self._state is not LinkState.RUNNING:
            return False
        self._torque = on
        self._wake()
        return True

    def status(self) -> LinkStatus:
        """Return how the link is now."""
        connection, parser, dialect = self._connection, self._parser, self._dialect
        return LinkStatus(
            state=self._state,
            detail=self._detail,
            protocol=connection.protocol.name if connection else '',
            baud=connection.port.baud if connection else 0,
            firmware=connection.firmware if connection else '',
            connections=self._connections,
            age=time.monotonic() - self._reported_at,
            commands=self._commands,
            dropped=self._dropped,
            parser=parser.counters if parser else ParserCounters(),
            dialect=dialect.counters if dialect else DialectCounters(),
        )

    def _wake(self) -> None:
        with suppress(BlockingIOError):  # a full pipe wakes as well
            os.write(self._wake_write, b'\0')

    def _enter(self, state: LinkState, detail: str) -> None:
        if (state, detail) != (self._state, self._detail):
            self._state, self._detail = state, detail
            self._on_change(state, detail)

    def _run(self) -> None:
        while not self._stopping.is_set():
            try:
                connection = connect(
                    self._options.path, self._options.protocols, self._options.baud
                )
            except LinkError as error:
                self._enter(LinkState.CONNECTING, str(error))
                self._stopping.wait(RETRY_PERIOD)
                continue
            try:
                self._serve(connection)
            except LinkError as error:
                self._enter(LinkState.CONNECTING, str(error))
            finally:
                self._mailbox = None
                connection.port.close()
        self._enter(LinkState.STOPPED, 'stopped')

    def _serve(self, connection: Connection) -> None:
        now = time.monotonic()
        self._connection = connection
        self._parser = StreamParser(connection.protocol, ROBOT_KINDS)
        self._dialect = dialect = make_dialect(connection, self._options, now)
        self._connections += 1
        self._reported_at = now
        self._enter(
            LinkState.WAITING,
            f'{connection.firmware} on {connection.port.path} speaks the '
            f'{connection.protocol.name} protocol at {connection.port.baud} baud',
        )
        heard_at = now
        while not self._stopping.is_set():
            now = time.monotonic()
            silence = now - self._reported_at
            if silence > PROBE_AGAIN:
                raise LinkError(f'no report for {PROBE_AGAIN} s; looking for the robot again')
            if silence > STALE_TIME:
                self._fall_silent(dialect)
            self._post(dialect)
            step = dialect.step(now)
            if step.send:
                connection.port.write(step.send)
            patience = PROBE_AGAIN if silence > STALE_TIME else STALE_TIME
            timeout = min(step.wake, self._reported_at + patience) - now
            if self._parser.pending:
                timeout = min(timeout, QUIET_TIME)
            heard_at = self._listen(connection.port, max(timeout, 0.0), heard_at)

    def _fall_silent(self, dialect: Dialect) -> None:
        dialect.withdraw()
        self._mailbox = self._torque = None
        self._enter(
            LinkState.STALE,
            f'no report for {STALE_TIME} s: the servos hold their last target, nothing is sent',
        )

    def _post(self, dialect: Dialect) -> None:
        angles, self._mailbox = self._mailbox, None
        if angles is not None:
            dialect.command(angles)
            self._commands += 1
        on, self._torque = self._torque, None
        if on is not None:
            dialect.torque(on=on)

    def _listen(self, port: SerialPort, timeout: float, heard_at: float) -> float:
        """Wait for bytes or a command; return when bytes last came [s]."""
        parser, dialect = self._parser, self._dialect
        if parser is None or dialect is None:
            return heard_at
        line = port.fileno()
        readable, _, _ = select.select([line, self._wake_read], [], [], timeout)
        if self._wake_read in readable:
            os.read(self._wake_read, 512)
        data = port.read() if line in readable else b''
        now = time.monotonic()
        frames = parser.feed(data) if data else []
        if not data and parser.pending and now - heard_at > QUIET_TIME:
            frames = parser.expire()
        for frame in frames:
            report = dialect.hear(frame, now)
            if report is not None:
                self._reported_at = now
                self._enter(LinkState.RUNNING, 'reports arrive')
                self._on_state(report)
        return now if data else heard_at


def make_dialect(connection: Connection, options: LinkOptions, now: float) -> Dialect:
    """Return the dialect for a robot that answered.

    Raises:
        LinkError: Its firmware is that of a robot without legs.
    """
    if connection.protocol is NEW:
        return NewDialect(now, options.rate)
    model = options.model or model_of_firmware(connection.firmware)
    if model is None:
        raise LinkError(
            f'firmware {connection.firmware!r} is of no known quadruped (M mini, L lite, W or MW '
            'wheeled); name its ranges with the parameter model'
        )
    return OldDialect(now, model, options.rate)

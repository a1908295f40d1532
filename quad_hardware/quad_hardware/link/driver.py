# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps the conversation with a robot going in a thread of its own, whatever the cable does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
import logging
import os
import select
import threading
import time
from typing import Any

from ..exceptions import LinkError
from ..protocol import ParserCounters
from ..report import Report
from .dialect import Dialect, DialectCounters, LinkState, LinkStatus
from .port import latency_problem, latency_timer
from .session import LinkOptions, open_session, Session


@dataclass(frozen=True, slots=True)
class Orders:
    """What is to be sent."""

    # servo angles by motor id [deg]; None for no new ones
    angles: Mapping[int, float] | None = None
    torque: bool | None = None  # servos hold, or let go; None to leave it


_NONE = Orders()


class Mailbox:
    """Keeps the newest order of each kind until it is taken.

    It takes orders while it is open. An order that was accepted is taken, replaced by a newer one
    of its kind, or returned by :meth:`close`: it is never lost in silence.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._orders = _NONE
        self._open = False

    def open(self) -> None:
        """Accept orders from now on."""
        with self._lock:
            self._open = True

    def close(self) -> Orders:
        """Accept no more orders; return those that were not taken."""
        with self._lock:
            self._open = False
            orders, self._orders = self._orders, _NONE
            return orders

    def put_angles(self, angles: Mapping[int, float]) -> bool:
        """Leave servo angles by motor id [deg]; return whether they are accepted."""
        with self._lock:
            if self._open:
                self._orders = replace(self._orders, angles=angles)
            return self._open

    def put_torque(self, *, on: bool) -> bool:
        """Have the servos hold, or let go; return whether that is accepted."""
        with self._lock:
            if self._open:
                self._orders = replace(self._orders, torque=on)
            return self._open

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to be taken."""
        with self._lock:
            return self._orders == _NONE

    def take(self) -> Orders:
        """Return what is to be sent now."""
        with self._lock:
            orders, self._orders = self._orders, _NONE
            return orders


STALE_TIME = 0.5  # [s] without a report, after which nothing is sent any more
RECONNECT_TIMEOUT = 3.0  # [s] without a report, after which the robot is looked for anew
RETRY_PERIOD = 0.5  # [s] between attempts to open a port
QUIET_TIME = 0.03  # [s] longer than a pause inside a frame: the timer of an FTDI adapter is 16 ms

_log = logging.getLogger(__name__)


class Driver:
    """A robot on a serial port.

    ``on_state`` is called in the thread of the driver for each report and says why it cannot be,
    or nothing when it is taken; ``on_change`` when the state of the link changes. Both must be
    quick; when one of them fails, the conversation begins anew, and the link says so. Nothing is
    sent to servos while no report is taken: they hold their last target.

    ``command`` and ``torque`` are for one other thread.
    """

    def __init__(
        self,
        options: LinkOptions,
        on_state: Callable[[Report], str],
        on_change: Callable[[LinkState, str], None],
        tap: Callable[[Session], Session] = lambda session: session,
    ) -> None:
        """Prepare; :meth:`start` begins.

        Args:
            tap: Returns a session that was opened with a port that records what passes.
        """
        self._options = options
        self._on_state = on_state
        self._on_change = on_change
        self._tap = tap
        self._thread = threading.Thread(target=self._run, name='serial', daemon=True)
        self._begin: Callable[[], None] = lambda: None
        self._stopping = threading.Event()
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._mailbox = Mailbox()
        self._torque_unsent: bool | None = None  # taken from the mailbox, and not written yet
        self._released = False  # by the last change of torque that was accepted
        self._limp = False  # from the first byte of an order to let go to the last of one to hold
        self._state = LinkState.CONNECTING
        self._detail = 'not started'
        self._session: Session | None = None
        self._connections = 0
        self._latency: float | None = None
        self._commands = 0
        self._dropped = 0
        self._refused = 0
        self._refusal = ''
        self._received_at = self._reported_at = -float('inf')

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Start the thread, which looks for the robot until it finds it.

        Args:
            begin: Called first in the thread, which may want a priority.
        """
        self._begin = begin
        self._thread.start()

    def stop(self) -> None:
        """Send what was accepted, end the thread and close the port; servos hold their target."""
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
        accepted = self._mailbox.put_angles(angles)
        if accepted:
            self._wake()
        else:
            self._dropped += 1
        return accepted

    def torque(self, *, on: bool) -> bool:
        """Have all servos hold their place, or let go: the robot drops then.

        Returns:
            False when the link is not running or cannot do that, and nothing will be sent. True
            when it is sent with the next bytes; if the robot is lost before, the change of the
            link's state says that it was not.
        """
        session = self._session
        able = session is not None and session.dialect.can_release
        accepted = able and self._mailbox.put_torque(on=on)
        if accepted:
            self._released = not on
            self._wake()
        return accepted

    @property
    def limp(self) -> bool:
        """Whether the servos were let go: from that order on, until they are known to hold."""
        return self._released or self._limp

    def status(self) -> LinkStatus:
        """Return how the link is now."""
        session = self._session
        return LinkStatus(
            state=self._state,
            detail=self._detail,
            protocol=session.dialect.protocol.name if session else '',
            baud=session.port.baud if session else 0,
            firmware=session.firmware if session else '',
            connections=self._connections,
            age=time.monotonic() - self._reported_at,
            commands=self._commands,
            dropped=self._dropped,
            parser=session.parser.counters if session else ParserCounters(),
            dialect=session.dialect.counters if session else DialectCounters(),
            refused=self._refused,
            latency=self._latency,
        )

    def _wake(self) -> None:
        with suppress(BlockingIOError):  # a full pipe wakes as well
            os.write(self._wake_write, b'\0')

    def _enter(self, state: LinkState, detail: str) -> None:
        if state is LinkState.RUNNING:
            self._mailbox.open()
        elif self._mailbox.close().torque is not None or self._torque_unsent is not None:
            self._torque_unsent = None
            detail += '; a change of torque may not have been sent'
        if (state, detail) != (self._state, self._detail):
            self._state, self._detail = state, detail
            self._on_change(state, detail)

    def _run(self) -> None:
        self._begin()
        while not self._stopping.is_set():
            self._try_to_converse()
        self._enter(LinkState.STOPPED, 'stopped')

    def _try_to_converse(self) -> None:
        try:
            self._converse()
        except Exception as error:  # noqa: BLE001  whatever it is, the robot is looked for again
            self._fail(error)
            self._stopping.wait(RETRY_PERIOD)

    def _fail(self, error: Exception) -> None:
        _log.error('the conversation with the robot failed', exc_info=error)
        try:
            self._enter(
                LinkState.FAILED, f'internal error: {error!r}; looking for the robot again'
            )
        except Exception:  # noqa: BLE001  the state is set, whatever its observer does
            _log.exception('the failure could not be reported')

    def _converse(self) -> None:
        """Look for the robot once, and talk with it until it is lost."""
        try:
            session = open_session(self._options)
        except LinkError as error:
            self._enter(LinkState.CONNECTING, str(error))
            self._stopping.wait(RETRY_PERIOD)
            return
        try:
            self._serve(self._tap(session))
        except LinkError as error:
            self._enter(LinkState.CONNECTING, str(error))
        finally:
            session.port.close()

    def _serve(self, session: Session) -> None:
        now = bytes_at = self._received_at = self._reported_at = time.monotonic()
        dialect = session.dialect
        self._session = session
        self._connections += 1
        self._latency = latency_timer(session.port.path)
        found = (
            f'{session.firmware} on {session.port.path} speaks protocol '
            f'{dialect.protocol.name} at {session.port.baud} baud'
        )
        problem = latency_problem(session.port.path, self._latency)
        self._enter(LinkState.WAITING, '; '.join(filter(None, (found, problem))))
        while not self._stopping.is_set() or self._owes(dialect):
            now = time.monotonic()
            if now - self._received_at > RECONNECT_TIMEOUT:
                raise LinkError(f'no report for {RECONNECT_TIMEOUT} s; connecting again')
            if now - self._reported_at > STALE_TIME:
                self._fall_silent(dialect, now)
            self._post(dialect)
            step = dialect.step(now)
            if step.send:
                session.port.write(step.send)
            if self._torque_unsent is not None and not dialect.torque_pending:
                self._limp, self._torque_unsent = not self._torque_unsent, None
            timeout = min(step.wake, self._deadline(now)) - now
            if session.parser.pending:
                timeout = min(timeout, QUIET_TIME)
            bytes_at = self._listen(session, max(timeout, 0.0), bytes_at)

    def _owes(self, dialect: Dialect[Any]) -> bool:
        """Return whether an order was accepted that is still to be sent."""
        running = self._state is LinkState.RUNNING
        return running and (dialect.pending or not self._mailbox.is_empty)

    def _deadline(self, now: float) -> float:
        """Return when silence has lasted long enough to do something about it [s]."""
        ends = (self._reported_at + STALE_TIME, self._received_at + STALE_TIME)
        return min(
            (end for end in ends if end >= now), default=self._received_at + RECONNECT_TIMEOUT
        )

    def _fall_silent(self, dialect: Dialect[Any], now: float) -> None:
        refused = now - self._received_at <= STALE_TIME
        state = LinkState.REFUSED if refused else LinkState.STALE
        if state is not self._state:
            self._enter(state, self._silence(refused=refused))
        dialect.cancel_pending()  # only now: from here on no order is accepted

    def _silence(self, *, refused: bool) -> str:
        what = f'every report is refused, {self._refusal}' if refused else 'no report'
        return f'{what} for {STALE_TIME} s: the servos hold their last target, nothing is sent'

    def _post(self, dialect: Dialect[Any]) -> None:
        orders = self._mailbox.take()
        if orders.angles is not None:
            dialect.command(orders.angles)
            self._commands += 1
        if orders.torque is not None:
            dialect.torque(on=orders.torque)
            self._torque_unsent = orders.torque
            # half of it may leave before the line breaks
            self._limp = self._limp or not orders.torque

    def _listen(self, session: Session, timeout: float, bytes_at: float) -> float:
        """Wait for bytes or a command; return when bytes last came [s]."""
        port, parser = session.port, session.parser
        line = port.fileno()
        readable, _, _ = select.select([line, self._wake_read], [], [], timeout)
        if self._wake_read in readable:
            os.read(self._wake_read, 512)
        data = port.read() if line in readable else b''
        now = time.monotonic()
        frames = parser.feed(data) if data else []
        if not data and parser.pending and now - bytes_at > QUIET_TIME:
            frames = parser.expire()
        for frame in frames:
            report = session.dialect.handle_frame(frame, now)
            if report is not None:
                self._take(report, now)
        return now if data else bytes_at

    def _take(self, report: Report, now: float) -> None:
        self._received_at = now
        reason = self._on_state(report)
        if reason:
            self._refused += 1
            self._refusal = reason
            return
        self._reported_at = now
        # only now: whoever sends a command has a place of the robot to begin from
        self._enter(LinkState.RUNNING, 'reports arrive')

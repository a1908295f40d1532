# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Thread that runs the conversation with a robot and reconnects after a loss."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
import logging
import os
import select
import threading
import time

from ..exceptions import LinkError
from ..report import Report
from .dialect import Dialect, LinkState, LinkStatus
from .open import LinkOptions, open_session, Session
from .port import latency_problem, latency_timer

STALE_TIME = 0.5  # [s] without a report, after which nothing is sent any more
RECONNECT_TIMEOUT = 3.0  # [s] without a report, after which the robot is looked for anew
RETRY_PERIOD = 0.5  # [s] between attempts to open a port
QUIET_TIME = 0.03  # [s] longer than a pause inside a frame: the timer of an FTDI adapter is 16 ms

_log = logging.getLogger(__name__)


class Driver:
    """A robot on a serial port.

    The driver's thread calls ``on_state`` for each report, which returns why it is implausible, or
    an empty text to accept it; and ``on_change`` when the link state changes. Both must be quick;
    if one of them raises, the conversation restarts and the link status reports it. The driver
    sends nothing to servos until a report is accepted: they hold their last target.

    Call ``command`` and ``torque`` from one other thread. An accepted order is sent or replaced by
    a newer one of its kind; otherwise a change of the link state reports that it was not sent.
    """

    def __init__(
        self,
        options: LinkOptions,
        on_state: Callable[[Report], str],
        on_change: Callable[[LinkState, str], None],
        on_open: Callable[[Session], None] = lambda _: None,
    ) -> None:
        """Set up the driver; :meth:`start` begins. ``on_open`` gets each new session first."""
        self._options = options
        self._on_state = on_state
        self._on_change = on_change
        self._on_open = on_open
        self._thread = threading.Thread(target=self._run, name='serial', daemon=True)
        self._begin: Callable[[], None] = lambda: None
        self._stopping = threading.Event()
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._lock = threading.Lock()  # of the orders
        self._accepts = False  # orders
        self._angles: Mapping[int, float] | None = None  # ordered, by motor id [deg]
        self._torque: bool | None = None  # ordered
        self._torque_unsent: bool | None = None  # taken over, and not written yet
        self._released = False  # by the last change of torque that was accepted
        self._limp = False  # from the first byte of an order to let go to the last of one to hold
        # when the last order to let go was given to the line [s], None before
        self.released_at: float | None = None
        # when the last command had left, its bytes considered [s]
        self.commanded_at = -float('inf')
        self._status = LinkStatus(detail='not started')
        self._session: Session | None = None
        self._received_at = self._reported_at = -float('inf')

    def start(self, begin: Callable[[], None] = lambda: None) -> None:
        """Start the thread; it calls ``begin``, then looks for the robot until it is found."""
        self._begin = begin
        self._thread.start()

    def stop(self) -> None:
        """Send accepted orders, end the thread and close the port; servos hold their targets."""
        self._stopping.set()
        self._wake()
        if self._thread.is_alive():
            self._thread.join()
        for descriptor in (self._wake_read, self._wake_write):
            os.close(descriptor)

    def command(self, angles: Mapping[int, float]) -> bool:
        """Send servo angles at once; a newer command replaces one not sent yet.

        Args:
            angles: Angles by motor id [deg]: all legs, and the arm if fitted.

        Returns:
            False if the link is not running; then nothing is sent.
        """
        with self._lock:
            if accepted := self._accepts:
                self._angles = angles
        if accepted:
            self._wake()
        else:
            self._status.dropped += 1
        return accepted

    def torque(self, *, on: bool) -> bool:
        """Switch the torque of all servos; without it the robot drops.

        Returns:
            False if the link is not running or does not support it; then nothing is sent. True
            if it goes out with the next bytes; if the robot is lost before that, the change of the
            link state reports it.
        """
        session = self._session
        able = session is not None and session.dialect.can_release
        with self._lock:
            if accepted := able and self._accepts:
                self._torque, self.released_at = on, None
        if accepted:
            self._released = not on
            self._wake()
        return accepted

    @property
    def waits(self) -> bool:
        """Whether an accepted command has not been picked up by the thread yet."""
        return self._angles is not None

    @property
    def limp(self) -> bool:
        """Whether the servos are released, from the order until they are known to hold."""
        return self._released or self._limp

    def status(self) -> LinkStatus:
        """Return the present link status."""
        return self._status.at(time.monotonic() - self._reported_at)

    def _wake(self) -> None:
        with suppress(BlockingIOError):  # a full pipe wakes as well
            os.write(self._wake_write, b'\0')

    def _enter(self, state: LinkState, detail: str) -> None:
        with self._lock:
            self._accepts = state is LinkState.RUNNING
        if not self._accepts:
            _, torque = self._take_orders()
            if torque is not None or self._torque_unsent is not None:
                self._torque_unsent = None
                detail += '; a change of torque may not have been sent'
        status = self._status
        if (state, detail) != (status.state, status.detail):
            status.state, status.detail = state, detail
            self._on_change(state, detail)

    def _take_orders(self) -> tuple[Mapping[int, float] | None, bool | None]:
        with self._lock:
            orders, self._angles, self._torque = (self._angles, self._torque), None, None
            return orders

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
        """Search for the robot once, and run the session until it is lost."""
        try:
            session = open_session(self._options)
        except LinkError as error:
            self._enter(LinkState.CONNECTING, str(error))
            self._stopping.wait(RETRY_PERIOD)
            return
        try:
            self._on_open(session)
            self._serve(session)
        except LinkError as error:
            self._enter(LinkState.CONNECTING, str(error))
        finally:
            session.port.close()

    def _serve(self, session: Session) -> None:
        now = bytes_at = self._received_at = self._reported_at = time.monotonic()
        dialect, port, status = session.dialect, session.port, self._status
        self._session = session
        status.protocol, status.baud = dialect.protocol.name, port.baud
        status.firmware, status.latency = session.firmware, latency_timer(port.path)
        status.parser, status.dialect = session.parser.counters, dialect.counters
        status.connections += 1
        found = (
            f'{session.firmware} on {port.path} speaks protocol '
            f'{dialect.protocol.name} at {port.baud} baud'
        )
        problem = latency_problem(port.path, status.latency)
        self._enter(LinkState.WAITING, '; '.join(filter(None, (found, problem))))
        while not self._stopping.is_set() or self._owes(dialect):
            now = time.monotonic()
            if now - self._received_at > RECONNECT_TIMEOUT:
                raise LinkError(f'no report for {RECONNECT_TIMEOUT} s; connecting again')
            if now - self._reported_at > STALE_TIME:
                self._fall_silent(dialect, now)
            self._post(dialect)
            commanding = dialect.pending
            step = dialect.step(now)
            if step.send:
                port.write(step.send)
            if commanding and not dialect.pending:
                self.commanded_at = now + dialect.protocol.wire_time(len(step.send))
            if self._torque_unsent is not None and not dialect.torque_pending:
                self._limp, self._torque_unsent = not self._torque_unsent, None
                self.released_at = time.monotonic() if self._limp else None
            timeout = min(step.wake, self._deadline(now)) - now
            if session.parser.pending:
                timeout = min(timeout, QUIET_TIME)
            bytes_at = self._listen(session, max(timeout, 0.0), bytes_at)

    def _owes(self, dialect: Dialect) -> bool:
        """Return whether an accepted order has not been sent yet."""
        ordered = self._angles is not None or self._torque is not None
        return self._status.state is LinkState.RUNNING and (dialect.pending or ordered)

    def _deadline(self, now: float) -> float:
        """Return the time at which silence requires action [s]."""
        ends = (self._reported_at + STALE_TIME, self._received_at + STALE_TIME)
        return min(
            (end for end in ends if end >= now), default=self._received_at + RECONNECT_TIMEOUT
        )

    def _fall_silent(self, dialect: Dialect, now: float) -> None:
        state, what = LinkState.STALE, 'no report'
        if now - self._received_at <= STALE_TIME:
            state, what = LinkState.REFUSED, f'every report is refused, {self._status.refusal}'
        if state is not self._status.state:
            does = 'the servos hold their last target, nothing is sent'
            self._enter(state, f'{what} for {STALE_TIME} s: {does}')
        dialect.cancel_pending()  # only now: from here on no order is accepted

    def _post(self, dialect: Dialect) -> None:
        angles, torque = self._take_orders()
        if angles is not None:
            dialect.command(angles)
            self._status.commands += 1
        if torque is not None:
            dialect.torque(on=torque)
            self._torque_unsent = torque
            self._limp = self._limp or not torque  # half of it may leave before the line breaks

    def _listen(self, session: Session, timeout: float, bytes_at: float) -> float:
        """Wait for bytes or a command; return the time of the last bytes [s]."""
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
            self._status.refused += 1
            self._status.refusal = reason
            return
        self._reported_at = now
        # only now: a command has a place of the robot to begin from
        self._enter(LinkState.RUNNING, 'reports arrive')

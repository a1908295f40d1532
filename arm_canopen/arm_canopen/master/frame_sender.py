# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sending of the master's frames, and the state of its CAN controller."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TypeAlias

from canopen_core import BusError
from canopen_core.can import (
    controller_state,
    ControllerState,
    error_counters,
    error_text,
    Frame,
    is_unacknowledged,
)
from canopen_core.standard import CobId, nmt_addressee, nmt_frame, NmtCommand

from .events import Event, EventKind, Report, Severity
from .scheduler import Promise, Scheduler

Send: TypeAlias = Callable[[Frame], BusError | None]
"""Hands a frame to the bus; returns why the bus has not taken it, None when it has."""
SendNmt: TypeAlias = Callable[[NmtCommand, int], Promise[None]]
"""Sends a command to a node id, or to all with 0; the promise is resolved when it has left,
rejected with a BusError when the bus has not taken it."""
REPEAT_AFTER = 0.01  # [s] before a command that the bus refused is sent again
REFUSAL_TIMEOUT = 0.5  # [s] until a command that the bus refuses is given up


class BusSender:
    """Sends frames; reports a bus that refuses them once, until it works again."""

    def __init__(self, send: Callable[[Frame], None], report: Report) -> None:
        """``send`` may raise BusError."""
        self._send = send
        self._report = report
        self._failed = False

    def send(self, frame: Frame) -> BusError | None:
        """Send a frame; return the error if the bus refuses it, else None."""
        try:
            self._send(frame)
        except BusError as error:
            if not self._failed:
                self._failed = True
                self._report(Event(EventKind.BUS, Severity.ERROR, '', str(error)))
            return error
        if self._failed:
            self._failed = False
            self._report(Event(EventKind.BUS, Severity.INFO, '', 'the bus takes frames again'))
        return None


class PeriodicFrame:
    """A frame that is sent periodically; after a pause the schedule restarts.

    Missed frames are not sent later, so no bursts occur.
    """

    def __init__(self, can_id: int, period: float, data: Callable[[], bytes], send: Send) -> None:
        """Send ``data()`` with an identifier every ``period`` in [s]; 0 disables it."""
        self._can_id = can_id
        self._period = period
        self._data = data
        self._send = send
        self._next = 0.0

    def advance(self, now: float) -> None:
        """Send the frame if it is due."""
        if self._period <= 0.0 or now < self._next:
            return
        due = self._next + self._period
        self._next = due if due > now else now + self._period
        self._send(Frame(self._can_id, self._data()))


class NmtSender:
    """Sends NMT commands in order, at least the inhibit time (0x102A) apart.

    A command counts as sent when the bus has accepted its frame. A command whose promise is
    abandoned before is not sent.
    """

    def __init__(
        self,
        scheduler: Scheduler,
        send: Send,
        inhibit_time: float,
        on_sent: Callable[[NmtCommand, int], None],
    ) -> None:
        """``inhibit_time`` is the shortest time between two commands in [s], 0 for none.

        ``on_sent`` is called with each command and its node id when it is sent.
        """
        self._scheduler = scheduler
        self._send = send
        self._inhibit_time = inhibit_time
        self._on_sent = on_sent
        self._waiting: deque[tuple[NmtCommand, int, Promise[None]]] = deque()
        self._busy = False

    def send(self, command: NmtCommand, node_id: int) -> Promise[None]:
        """Queue a command to one device, or to all with id 0; done when it is sent."""
        sent: Promise[None] = Promise()
        self._waiting.append((command, node_id, sent))
        if not self._busy:
            self._scheduler.background(self._empty())
        return sent

    async def _empty(self) -> None:
        self._busy = True
        refused_since: float | None = None
        try:
            while self._waiting:
                command, node_id, sent = self._waiting.popleft()
                if sent.done:
                    continue  # withdrawn
                refusal = self._send(Frame(CobId.NMT, nmt_frame(command, node_id)))
                if refusal is None:
                    refused_since = None
                    self._on_sent(command, node_id)
                    sent.resolve(None)
                    if self._inhibit_time > 0.0:
                        await self._scheduler.timer(self._inhibit_time)
                    continue
                refused_since = refused_since or self._scheduler.now
                if self._scheduler.now - refused_since < REFUSAL_TIMEOUT:
                    self._waiting.appendleft((command, node_id, sent))
                    await self._scheduler.timer(REPEAT_AFTER)
                    continue
                whom = nmt_addressee(node_id)
                sent.reject(BusError(f'NMT {command.name} to {whom} was not sent: {refusal}'))
        finally:
            self._busy = False


_RESTART = (
    'it comes back by `ip link set CAN type can restart`, or by itself when the interface was set '
    'up with `restart-ms 100`'
)
_CABLE = 'look at cable, termination, bit rate and ground'
_REPORTS: dict[ControllerState, tuple[Severity, str]] = {
    ControllerState.ACTIVE: (Severity.INFO, 'the bus is free of errors again'),
    ControllerState.WARNING: (Severity.WARNING, f'frames are disturbed; {_CABLE}'),
    ControllerState.PASSIVE: (
        Severity.ERROR,
        f'many frames are disturbed, the next step is bus off; {_CABLE}',
    ),
    ControllerState.BUS_OFF: (
        Severity.ERROR,
        f'it has left the bus and sends nothing more; {_CABLE}; {_RESTART}',
    ),
}


class ControllerWatch:
    """Tracks the error state of the CAN controller and reports changes."""

    def __init__(self, report: Report) -> None:
        self.state = ControllerState.ACTIVE  # error active until a frame shows another state
        self.transmit_errors = 0  # transmit error counter, if the controller reports it
        self.receive_errors = 0  # receive error counter, likewise
        self.error_frames = 0  # number of error frames
        self.last_error = ''  # last error in words, empty before the first
        self._report = report
        self._alone = False

    def receive(self, frame: Frame) -> None:
        """Process an error frame."""
        self.error_frames += 1
        self.last_error = error_text(frame)
        counters = error_counters(frame)
        if counters is not None:
            self.transmit_errors, self.receive_errors = counters
        if is_unacknowledged(frame) and not self._alone:
            self._alone = True
            text = 'no device on the bus acknowledges frames: is any device powered and connected?'
            self._log(Severity.WARNING, text)
        state = controller_state(frame)
        if state is not None and state is not self.state:
            self.state = state
            self._alone = self._alone and state is not ControllerState.ACTIVE
            severity, text = _REPORTS[state]
            self._log(severity, f'CAN controller {state.value} ({self.last_error}): {text}')

    def receive_data(self) -> None:
        """Clear bus-off when data arrives: the controller restarted without an error frame."""
        self.state, self._alone = ControllerState.ACTIVE, False
        self._log(Severity.INFO, 'CAN controller receives frames again after bus off')

    def _log(self, severity: Severity, text: str) -> None:
        self._report(Event(EventKind.BUS, severity, '', text))

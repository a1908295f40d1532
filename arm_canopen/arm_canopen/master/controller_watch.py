# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The CAN controller of this computer, as its error frames show it."""

from __future__ import annotations

from canopen_core.can import (
    controller_state,
    ControllerState,
    error_counters,
    error_text,
    Frame,
    is_unacknowledged,
)

from .events import Event, EventKind, Report, Severity

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
    """Follows the error state of the controller, and reports changes."""

    def __init__(self, report: Report) -> None:
        self.state = ControllerState.ACTIVE  # its state, error active until a frame shows another
        self.transmit_errors = 0  # its transmit error counter, as far as it reports it
        self.receive_errors = 0  # its receive error counter
        self.error_frames = 0  # number of error frames
        self.last_error = ''  # the last one in words, empty before the first
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
        """End bus off: data has come, after a restart that no error frame has shown."""
        self.state, self._alone = ControllerState.ACTIVE, False
        self._log(Severity.INFO, 'CAN controller receives frames again after bus off')

    def _log(self, severity: Severity, text: str) -> None:
        self._report(Event(EventKind.BUS, severity, '', text))

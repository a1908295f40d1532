# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Supervision of a device: heartbeat or node guarding, EMCY messages, and its TPDOs."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sequence
import math

from canopen_core import CodecError
from canopen_core.can import Frame
from canopen_core.standard import CobId, Emergency, error_code_text, NmtState

from ..config.model import NodeConfig
from .events import EventKind, Severity
from .frame_sender import Send
from .process_image import ReceivedTpdo

TOGGLE = 0x80  # toggle bit of a node guarding response


def guarding_request(node_id: int) -> Frame:
    """Return the remote frame that requests the NMT state of a device."""
    return Frame(CobId.HEARTBEAT + node_id, is_remote=True)


class LifeSigns:
    """Error control (heartbeat or node guarding) of one device."""

    def __init__(self, config: NodeConfig, send: Send) -> None:
        """Supervision begins with :meth:`start`."""
        self.last = 0.0  # steady time of the last heartbeat or guarding response in [s]
        # the supervised device was started but never sent a life sign; it has to send one before
        # it is started again
        self.silent = False
        self.missed = 0  # number of consecutive missed life signs
        self._config = config
        self._send = send
        self._since = self._awaited_from = 0.0
        self._timeout = math.inf
        # of node guarding: when the next request is due, how many were not answered, and the
        # toggle bit of the last answer; the first one may have either
        self._due: float | None = None
        self._unanswered = 0
        self._toggle: int | None = None

    @property
    def consumer_time(self) -> float:
        """Time in [s] after which a life sign counts as missing."""
        config = self._config
        return config.heartbeat_timeout or config.guard_time * config.retry_factor

    def start(self, now: float) -> None:
        """Start supervision at a time in [s]; the first life sign is due from then on."""
        self.last = self._since = now
        self.silent = False
        self.missed = 0
        self._timeout = self._config.heartbeat_timeout or math.inf
        self._await_next(now)

    def stop(self) -> None:
        """Stop supervision."""
        self.missed = 0
        self._timeout = math.inf
        self._due = None

    def take(self, state: NmtState, frame: Frame, *, supervised: bool) -> bool:
        """Process a life sign; return whether its toggle bit (node guarding) is valid.

        The toggle bit is checked only if the device is ``supervised``, that is online.
        """
        if supervised and self._config.uses_node_guarding and state is not NmtState.BOOT_UP:
            toggle = frame.data[0] & TOGGLE
            if toggle == self._toggle:
                return False
            self._toggle, self._unanswered = toggle, 0
        self.last = frame.timestamp
        self.missed = 0
        return True

    def overdue(self, now: float) -> str:
        """Return which life sign is overdue at a time in [s], in words; empty if none.

        The time-out of an overdue sign starts again. A guarding request that is due is sent.
        """
        config = self._config
        if now - max(self.last, self._awaited_from) > self._timeout:
            self._miss(now)
            return f'heartbeat lost: none within its consumer time of {self._timeout * 1000:g} ms'
        if self._due is None or now < self._due:
            return ''
        if self._unanswered >= config.retry_factor:
            self._miss(now)
            return (
                f'lost: no answer to node guarding {config.retry_factor} times in a row, each '
                f'{config.guard_time * 1000:g} ms apart'
            )
        self._unanswered += 1
        due = self._due + config.guard_time
        self._due = due if due > now else now + config.guard_time
        self._send(guarding_request(config.node_id))
        return ''

    def _miss(self, now: float) -> None:
        self.silent = self.last <= self._since
        self.missed += 1
        self._await_next(now)

    def _await_next(self, now: float) -> None:
        self._awaited_from = now
        if self._config.uses_node_guarding:
            self._due, self._unanswered, self._toggle = now, 0, None


HISTORY = 16  # number of EMCYs kept
REPEAT_PERIOD = 10.0  # [s] in which repeated EMCYs are only counted
REPORTS_MAX = 8  # EMCYs of any kind reported in that time
NAMED_MAX = 3  # codes named in a summary


class EmergencyLog:
    """Reports each EMCY in words, and keeps the last ones.

    Repeated or alternating EMCYs count as a flood. It is reported once in :data:`REPEAT_PERIOD`,
    with the number of messages, until none arrives for that long.
    """

    def __init__(self, report: Callable[[EventKind, Severity, str], None]) -> None:
        # the last EMCYs, newest last, with the steady time of each in [s]; each EMCY of a flood is
        # stored once
        self.history: deque[tuple[float, Emergency]] = deque(maxlen=HISTORY)
        # last EMCY that is not an error reset; None after the device reported no errors
        self.last: Emergency | None = None
        self._report = report
        self._came: dict[str, float] = {}
        self._newest = ''
        self._reported: deque[float] = deque(maxlen=REPORTS_MAX)
        self._repeats: Counter[str] = Counter()
        self._counted_since = 0.0
        self._counted_at = -REPEAT_PERIOD

    def since(self, begin: float) -> Emergency | None:
        """Return the last EMCY if it arrived after a steady time in [s] and is no reset."""
        if self.last is None or self.history[-1][0] < begin or self.history[-1][1].is_reset:
            return None
        return self.last

    def restarted(self) -> None:
        """Clear the current EMCY, because the device restarted."""
        self.last = None
        self._came.clear()
        self._newest = ''

    def receive(self, frame: Frame) -> None:
        """Store an EMCY message."""
        try:
            emergency = Emergency.decode(frame.data)
        except CodecError as error:
            text = f'odd EMCY: {error}'
            self._report_or_count(Severity.WARNING, text, 'odd', frame.timestamp)
            return
        now = frame.timestamp
        for entry in list(self.history):
            if entry[1] == emergency and now - entry[0] < REPEAT_PERIOD:
                self.history.remove(entry)
        self.history.append((now, emergency))
        if not emergency.is_reset:
            self.last = emergency
        else:  # the error register shows remaining errors
            self.last = self.last or emergency if emergency.register else None
        severity = Severity.INFO if emergency.is_reset else Severity.ERROR
        code = error_code_text(emergency.code)
        self._report_or_count(severity, f'EMCY: {emergency}', code, now)

    def look(self, now: float) -> None:
        """Report the number of EMCYs that were only counted, if due."""
        counted = now - self._counted_since
        if not self._repeats or counted < REPEAT_PERIOD:
            return
        repeats, self._repeats = self._repeats, Counter()
        named = ', '.join(f'{count} x {name}' for name, count in repeats.most_common(NAMED_MAX))
        others = ', and others' if len(repeats) > NAMED_MAX else ''
        text = f'EMCY: {repeats.total()} more in {counted:.0f} s ({named}{others})'
        self._report(EventKind.EMERGENCY, Severity.WARNING, text)

    def _report_or_count(self, severity: Severity, text: str, name: str, now: float) -> None:
        newest, self._newest = self._newest, text
        came_before = now - self._came.get(name, -math.inf) < REPEAT_PERIOD
        self._came[name] = now
        flooded = now - self._counted_at < REPEAT_PERIOD
        full = len(self._reported) == REPORTS_MAX and now - self._reported[0] < REPEAT_PERIOD
        if not full and not (came_before and (flooded or text == newest)):
            self._reported.append(now)
            self._report(EventKind.EMERGENCY, severity, text)
            return
        if not self._repeats:
            self._counted_since = now
        self._repeats[name] += 1
        self._counted_at = now


class PdoWatch:
    """Counts missed TPDOs, and reports once when TPDOs stop."""

    def __init__(
        self,
        inputs: Sequence[ReceivedTpdo],
        report: Callable[[EventKind, Severity, str], None],
    ) -> None:
        self.missed = 0  # TPDOs that did not answer a SYNC
        self._report = report
        self._inputs = inputs
        self._every_sync = [entry for entry in inputs if entry.every_sync]
        self._synchronous = {entry.config.number for entry in inputs if entry.synchronous}
        self._stopped: set[int] = set()
        self._may_get_lost = ''  # TPDO numbers reported at the last boot
        for entry in inputs:
            entry.on_short = self._report_short

    @property
    def last(self) -> float:
        """Steady time of the last TPDO in [s]; 0 before the first."""
        return max((entry.timestamp for entry in self._inputs), default=0.0)

    def stop(self) -> None:
        """Stop the supervision, because the device is lost."""
        self._stopped.clear()

    def warn_of_losses(self) -> None:
        """Report TPDOs of a drive whose loss goes unnoticed, unless already reported."""
        numbers = ', '.join(
            str(entry.config.number) for entry in self._inputs if entry.loss_unnoticed
        )
        before, self._may_get_lost = self._may_get_lost, numbers
        if numbers and numbers != before:
            self._warn(
                f'TPDO {numbers}: its loss goes unnoticed, and the drive is led by what '
                'it sent before. Write transmission: 1 (with SYNC), or 255 and event_timer: 100 '
                'where the device has it'
            )

    def expect(self) -> None:
        """Expect the TPDOs that answer each SYNC; call it before a SYNC is sent."""
        for entry in self._every_sync:
            entry.expect()

    def excuse(self, late: float) -> None:
        """Extend the deadline of synchronous TPDOs by ``late`` in [s], as SYNC was delayed."""
        for entry in self._inputs:
            if entry.synchronous:
                entry.excused += late

    def count_missed(self) -> None:
        """Count the TPDOs that did not answer the last SYNC."""
        self.missed += sum(entry.awaited for entry in self._every_sync)

    def look(self, now: float) -> None:
        """Report the TPDOs that have stopped, at a steady time in [s]."""
        stopped = [
            entry for entry in self._inputs if entry.values is not None and entry.stale(now)
        ]
        if not stopped and not self._stopped:
            return
        numbers = {entry.config.number for entry in stopped}
        before, self._stopped = self._stopped, numbers
        if self._synchronous and self._synchronous <= numbers:
            if not self._synchronous <= before:
                longest = max(entry.stale_after for entry in stopped if entry.synchronous)
                self._warn(
                    f'has not answered SYNC for {longest * 1000:g} ms; targets are refused until '
                    'it does. Check its power and its cable'
                )
            numbers = numbers - self._synchronous
        for entry in stopped:
            if entry.config.number in numbers - before:
                self._warn(
                    f'TPDO {entry.config.number} (0x{entry.config.cob_id:03X}) has stopped: none '
                    f'for {entry.stale_after * 1000:g} ms; targets are refused until it comes '
                    'again'
                )

    def _report_short(self, entry: ReceivedTpdo, length: int) -> None:
        if entry.length_errors == 1:
            self._warn(
                f'TPDO {entry.config.number} (0x{entry.config.cob_id:03X}) has {length} bytes, '
                f'its mapping {entry.codec.size}; it is not used. Does the device have another '
                'mapping than bus.yml, or does somebody else send with this identifier?'
            )

    def _warn(self, text: str) -> None:
        self._report(EventKind.PDO, Severity.WARNING, text)

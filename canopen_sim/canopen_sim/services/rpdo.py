# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Receive PDOs of a device (CiA 301, 7.2.2 and 7.5.2.35)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from canopen_core.can import Frame
from canopen_core.standard import (
    AccessType,
    DataType,
    Index,
    ObjectEntry,
    SYNCHRONOUS_MAX,
)

from ..objects.object_store import make_variable, ObjectStore, Variable
from ..timed import NEVER
from .pdo_channel import channel_numbers, PdoChannel, PdoEngine, TRANSMISSION_EVENT

LENGTH_ERROR = 0x8210  # EMCY: PDO not processed due to length error
TIMEOUT_ERROR = 0x8250  # EMCY: RPDO timeout
Handler = Callable[[Frame, float], None]
ErrorReport = Callable[[int, bool, float, object], None]


class Rpdo(PdoChannel):
    """One receive PDO: writes what it carries into the object dictionary."""

    transmission_types = frozenset((*range(SYNCHRONOUS_MAX + 1), *TRANSMISSION_EVENT))

    def __init__(
        self,
        store: ObjectStore,
        number: int,
        changed: Callable[[PdoChannel, float], None],
        report: ErrorReport,
        too_late: Callable[[float], bool],
    ) -> None:
        """Bind the records of an RPDO; see :class:`RpdoEngine`."""
        self.deadline = NEVER  # steady time in [s] at which the next one is overdue
        self._short = self._late = False
        self._report = report
        self._too_late = too_late
        self._held: bytes | None = None
        self._listeners: tuple[Callable[[float], None], ...] = ()
        super().__init__(store, number, (Index.RPDO_COMMUNICATION, Index.RPDO_MAPPING), changed)

    def configure(self) -> None:
        """Read the parameter objects."""
        super().configure()
        self.reset()
        listeners = [v.listener for v in self.variables if v.listener is not None]
        self._listeners = tuple(dict.fromkeys(listeners))  # each once

    def reset(self) -> None:
        """Forget what was received and waits for SYNC."""
        self.deadline = NEVER
        self._held = None
        self._short = self._late = False

    def receive(self, frame: Frame, now: float) -> None:
        """Receive a PDO: into the dictionary at once, or at the next SYNC."""
        short = len(frame.data) < self.codec.size
        if short is not self._short:
            self._short = short
            self._report(LENGTH_ERROR, short, now, self)
        if short:
            return
        if self.event_time:
            self.deadline = now + self.event_time
            if self._late:
                self._late = False
                self._report(TIMEOUT_ERROR, False, now, self)
        if self.transmission <= SYNCHRONOUS_MAX:
            if not self._too_late(now):  # discarded otherwise (CiA 301, 7.5.2.8)
                self._held = frame.data
        else:
            self._write_objects(frame.data)
            self.notify_listeners(now)

    def store_held(self) -> bool:
        """Put what came since the last SYNC into the dictionary; return whether there was any."""
        if self._held is None:
            return False
        data, self._held = self._held, None
        self._write_objects(data)
        return True

    def notify_listeners(self, now: float) -> None:
        """Call the listeners of the objects of this PDO: they were written."""
        for listener in self._listeners:
            listener(now)

    def advance(self, now: float) -> None:
        """Report that the PDO stayed away."""
        if now >= self.deadline:
            self.deadline = NEVER
            self._late = True
            self._report(TIMEOUT_ERROR, True, now, self)

    def _write_objects(self, data: bytes) -> None:
        for variable, value in zip(self.variables, self.codec.unpack(data), strict=True):
            variable.value = value

    @staticmethod
    def _is_mappable(entry: ObjectEntry) -> bool:
        return entry.rpdo_mappable

    def _find(self, index: int, subindex: int) -> Variable:
        dummy = DUMMIES.get(index)
        if dummy is not None and subindex == 0:
            return make_variable(dummy)
        return super()._find(index, subindex)


DUMMIES: dict[int, ObjectEntry] = {
    data_type: ObjectEntry(
        data_type,
        0,
        f'Dummy {data_type.name}',
        data_type,
        access=AccessType.WRITE_ONLY,
        pdo_mappable=True,
    )
    for data_type in (
        DataType.BOOLEAN,
        DataType.INTEGER8,
        DataType.INTEGER16,
        DataType.INTEGER32,
        DataType.UNSIGNED8,
        DataType.UNSIGNED16,
        DataType.UNSIGNED32,
    )
}
"""Data types that may stand in the mapping of an RPDO for bytes to be skipped (CiA 301, 7.4.7)."""


def _chained(receivers: Sequence[Handler], finished: Callable[[float], None]) -> Handler:
    def handle(frame: Frame, now: float) -> None:
        for receive in receivers:
            receive(frame, now)
        finished(now)

    return handle


class RpdoEngine(PdoEngine[Rpdo]):
    """All receive PDOs of a device."""

    def __init__(
        self,
        store: ObjectStore,
        changed: Callable[[], None],
        report: ErrorReport,
        too_late: Callable[[float], bool],
    ) -> None:
        """Bind every RPDO of a dictionary.

        ``changed`` is called when a client changed one of them, ``report`` with a code, whether
        that error is there, the time, and a PDO. ``too_late`` returns whether the synchronous
        window is over at a time.
        """
        super().__init__(changed)
        self._report = report
        self.channels = [
            Rpdo(store, number, self._channel_changed, report, too_late)
            for number in channel_numbers(store, Index.RPDO_COMMUNICATION)
        ]

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which the first of them is overdue."""
        return min((rpdo.deadline for rpdo in self.active), default=NEVER)

    def start(self) -> None:
        """Receive from now on."""
        self._running = True
        self._select()

    def stop(self, now: float) -> None:
        """Receive no more; errors of reception are over."""
        for rpdo in self.active:
            rpdo.reset()
        for rpdo in self.channels:
            for code in (LENGTH_ERROR, TIMEOUT_ERROR):
                self._report(code, False, now, rpdo)
        self._running = False
        self._select()

    def sync(self, now: float) -> None:
        """Put the synchronous ones into the dictionary.

        Every value is stored before any listener is called: what one SYNC makes valid belongs
        together, such as a controlword in one PDO and its target in another.
        """
        for rpdo in [rpdo for rpdo in self.active if rpdo.store_held()]:
            rpdo.notify_listeners(now)

    def postpone(self, stalled: float) -> None:
        """Postpone time-outs by a time in [s] in which nothing was received."""
        for rpdo in self.active:
            rpdo.deadline += stalled

    def advance(self, now: float) -> None:
        """Report those that are overdue."""
        for rpdo in self.active:
            rpdo.advance(now)

    def handlers(self, finished: Callable[[float], None]) -> dict[int, Handler]:
        """Return what takes the frames of each identifier; several PDOs may share one.

        ``finished`` is called with the time when the objects have their new values.
        """
        receivers: dict[int, list[Handler]] = {}
        for rpdo in self.active:
            receivers.setdefault(rpdo.can_id, []).append(rpdo.receive)
        return {can_id: _chained(chain, finished) for can_id, chain in receivers.items()}

    def _channel_changed(self, _channel: PdoChannel, _now: float) -> None:
        self._select()
        self._changed()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDOs that a device receives and sends (CiA 301, 7.2.2, 7.5.2.35 and 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from canopen_core.can import Frame
from canopen_core.standard import AccessType, DataType, Index, ObjectEntry, SYNCHRONOUS_MAX

from .object_store import make_variable, NEVER, ObjectStore, Variable
from .pdo_channel import channel_numbers, PdoChannel, PdoEngine, TRANSMISSION_EVENT

LENGTH_ERROR = 0x8210  # EMCY: PDO not processed due to length error
TIMEOUT_ERROR = 0x8250  # EMCY: RPDO timeout
Handler = Callable[[Frame, float], None]
ErrorReport = Callable[[int, bool, float, object], None]


class Rpdo(PdoChannel):
    """One receive PDO: writes its values into the object dictionary."""

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
        """Discard received data that waits for SYNC."""
        self.deadline = NEVER
        self._held = None
        self._short = self._late = False

    def receive(self, frame: Frame, now: float) -> None:
        """Receive a PDO; write it to the dictionary at once, or at the next SYNC."""
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
        """Store data received since the last SYNC in the dictionary; return if there was any."""
        if self._held is None:
            return False
        data, self._held = self._held, None
        self._write_objects(data)
        return True

    def notify_listeners(self, now: float) -> None:
        """Call the listeners of the objects that this PDO has written."""
        for listener in self._listeners:
            listener(now)

    def advance(self, now: float) -> None:
        """Report that the PDO is overdue."""
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
"""Data types that an RPDO may map as dummies, for bytes to skip (CiA 301, 7.4.7)."""


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

        ``changed`` is called when a client has changed an RPDO, ``report`` with an error code,
        whether that error is present, the time, and the PDO. ``too_late`` returns whether the
        synchronous window has closed at a time.
        """
        super().__init__(changed)
        self._report = report
        self.channels = [
            Rpdo(store, number, self._channel_changed, report, too_late)
            for number in channel_numbers(store, Index.RPDO_COMMUNICATION)
        ]

    @property
    def deadline(self) -> float:
        """Steady time in [s] at which the next RPDO becomes overdue."""
        return min((rpdo.deadline for rpdo in self.active), default=NEVER)

    def start(self) -> None:
        """Start receiving."""
        self._running = True
        self._select()

    def stop(self, now: float) -> None:
        """Stop receiving, and clear reception errors."""
        for rpdo in self.active:
            rpdo.reset()
        for rpdo in self.channels:
            for code in (LENGTH_ERROR, TIMEOUT_ERROR):
                self._report(code, False, now, rpdo)
        self._running = False
        self._select()

    def sync(self, now: float) -> None:
        """Write the data of synchronous RPDOs to the dictionary.

        All values are stored before any listener is called, because values of one SYNC belong
        together, such as a controlword in one PDO and its target in another.
        """
        for rpdo in [rpdo for rpdo in self.active if rpdo.store_held()]:
            rpdo.notify_listeners(now)

    def postpone(self, stalled: float) -> None:
        """Postpone time-outs by a time in [s] in which nothing was received."""
        for rpdo in self.active:
            rpdo.deadline += stalled

    def advance(self, now: float) -> None:
        """Report overdue RPDOs."""
        for rpdo in self.active:
            rpdo.advance(now)

    def handlers(self, finished: Callable[[float], None]) -> dict[int, Handler]:
        """Map each identifier to its handler; several PDOs may share an identifier.

        ``finished`` is called with the time after the objects have their new values.
        """
        receivers: dict[int, list[Handler]] = {}
        for rpdo in self.active:
            receivers.setdefault(rpdo.can_id, []).append(rpdo.receive)
        return {can_id: _chained(chain, finished) for can_id, chain in receivers.items()}

    def _channel_changed(self, _channel: PdoChannel, _now: float) -> None:
        self._select()
        self._changed()


ACYCLIC = 0  # sent at a SYNC when something changed
RTR_SYNC = 252  # sampled at SYNC, sent on a remote frame
RTR_EVENT = 253  # sampled and sent on a remote frame


class Tpdo(PdoChannel):
    """One transmit PDO."""

    transmission_types = frozenset(
        (
            *range(SYNCHRONOUS_MAX + 1),
            RTR_SYNC,
            RTR_EVENT,
            *TRANSMISSION_EVENT,
        )
    )

    def __init__(
        self,
        store: ObjectStore,
        number: int,
        changed: Callable[[PdoChannel, float], None],
        send: Callable[[Frame], None],
    ) -> None:
        """Bind the records of a TPDO; see :class:`TpdoEngine`."""
        self.deadline = NEVER  # steady time in [s] at which it is to be sent
        self._send = send
        self._sent: bytes | None = None
        self._sampled: bytes | None = None
        self._free_time = 0.0  # end of the inhibit time
        self._countdown = 0
        super().__init__(store, number, (Index.TPDO_COMMUNICATION, Index.TPDO_MAPPING), changed)

    def start(self, now: float) -> None:
        """Start as on entering Operational: an event-driven PDO is sent once."""
        self._sent = self._sampled = None
        self._free_time = now
        self._countdown = 0 if self.sync_start else self.transmission
        self.deadline = now if self.is_event_driven else NEVER

    def pack(self) -> bytes:
        """Return the payload for the present values."""
        return self.codec.pack([variable.value for variable in self.variables])

    def sync(self, counter: int, now: float) -> None:
        """Send if the PDO is due at this SYNC; counter is 0 if SYNC has none."""
        if self.transmission == ACYCLIC:
            payload = self.pack()
            if payload != self._sent:
                self._transmit(payload, now)
        elif self.transmission == RTR_SYNC:
            self._sampled = self.pack()
        elif self._is_turn(counter):
            self._transmit(self.pack(), now)

    def _is_turn(self, counter: int) -> bool:
        if self._countdown == 0:  # waits for its start value
            if counter and counter != self.sync_start:
                return False
            self._countdown = 1
        self._countdown -= 1
        if self._countdown:
            return False
        self._countdown = self.transmission
        return True

    def poll(self, now: float) -> None:
        """Send as soon as permitted if a value has changed since the last transmission."""
        if self.deadline > self._free_time and self.pack() != self._sent:
            self.deadline = self._free_time
            self.advance(now)

    def advance(self, now: float) -> None:
        """Send if the event timer has elapsed, or the inhibit time of a pending change."""
        if now >= self.deadline:
            self._transmit(self.pack(), now)

    def request(self, now: float) -> None:
        """Respond to a remote frame, if COB-ID and transmission type allow it."""
        if not self.rtr_allowed:
            return
        if self.transmission == RTR_SYNC:
            if self._sampled is not None:
                self._transmit(self._sampled, now)
        elif self.transmission > RTR_SYNC:
            self._transmit(self.pack(), now)

    @staticmethod
    def _is_mappable(entry: ObjectEntry) -> bool:
        return entry.tpdo_mappable

    def _transmit(self, payload: bytes, now: float) -> None:
        self._sent = payload
        if self.is_event_driven:
            self._free_time = now + self.inhibit_time
            timer = now + self.event_time if self.event_time else NEVER
            self.deadline = max(timer, self._free_time)
        self._send(Frame(self.can_id, payload))


class TpdoEngine(PdoEngine[Tpdo]):
    """All transmit PDOs of a device."""

    def __init__(
        self,
        store: ObjectStore,
        changed: Callable[[], None],
        send: Callable[[Frame], None],
    ) -> None:
        """Bind every TPDO of a dictionary; ``changed`` is called when a client has changed one."""
        super().__init__(changed)
        self.deadline = NEVER  # steady time in [s] at which one of them is to be sent
        self._synchronous: list[Tpdo] = []
        self._event_driven: list[Tpdo] = []
        self.channels = [
            Tpdo(store, number, self._channel_changed, send)
            for number in channel_numbers(store, Index.TPDO_COMMUNICATION)
        ]

    def start(self, now: float) -> None:
        """Start sending."""
        self._running = True
        self._select()
        for tpdo in self.active:
            tpdo.start(now)
        self.advance(now)

    def stop(self) -> None:
        """Stop sending."""
        self._running = False
        self._select()
        self.deadline = NEVER

    def _select(self) -> None:
        super()._select()
        self.active = [tpdo for tpdo in self.active if tpdo.variables]
        self._synchronous = [
            tpdo for tpdo in self.active if tpdo.is_synchronous or tpdo.transmission == RTR_SYNC
        ]
        self._event_driven = [tpdo for tpdo in self.active if tpdo.is_event_driven]

    def _channel_changed(self, channel: PdoChannel, now: float) -> None:
        self._select()
        if isinstance(channel, Tpdo) and channel in self.active:
            channel.start(now)
            self.advance(now)
        self._changed()

    def sync(self, counter: int, now: float) -> None:
        """Send the TPDOs that are due at this SYNC."""
        for tpdo in self._synchronous:
            tpdo.sync(counter, now)

    def poll(self, now: float) -> None:
        """Send the event-driven TPDOs whose values have changed."""
        if self._event_driven:
            for tpdo in self._event_driven:
                tpdo.poll(now)
            self._update_deadline()

    def advance(self, now: float) -> None:
        """Send the TPDOs that are due."""
        for tpdo in self._event_driven:
            tpdo.advance(now)
        self._update_deadline()

    def request(self, can_id: int, now: float) -> None:
        """Answer a remote frame."""
        for tpdo in self.active:
            if tpdo.can_id == can_id:
                tpdo.request(now)

    def _update_deadline(self) -> None:
        self.deadline = min((tpdo.deadline for tpdo in self._event_driven), default=NEVER)

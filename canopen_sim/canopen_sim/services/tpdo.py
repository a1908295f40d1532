# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Transmit PDOs of a device (CiA 301, 7.2.2 and 7.5.2.37)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.can import Frame
from canopen_core.standard import Index, ObjectEntry, SYNCHRONOUS_MAX

from ..objects.object_store import ObjectStore
from ..timed import NEVER
from .pdo_channel import channel_numbers, PdoChannel, PdoEngine, TRANSMISSION_EVENT

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
        """Begin as on entering Operational: an event-driven PDO is sent once."""
        self._sent = self._sampled = None
        self._free_time = now
        self._countdown = 0 if self.sync_start else self.transmission
        self.deadline = now if self.is_event_driven else NEVER

    def pack(self) -> bytes:
        """Return the payload for the present values."""
        return self.codec.pack([variable.value for variable in self.variables])

    def sync(self, counter: int, now: float) -> None:
        """Send if this SYNC is its turn; the counter is 0 without one."""
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
        """Send as soon as allowed if a value changed since the last transmission."""
        if self.deadline > self._free_time and self.pack() != self._sent:
            self.deadline = self._free_time
            self.advance(now)

    def advance(self, now: float) -> None:
        """Send if the event timer or the inhibit time is over."""
        if now >= self.deadline:
            self._transmit(self.pack(), now)

    def request(self, now: float) -> None:
        """Answer a remote frame, where COB-ID and type allow it."""
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
        """Bind every TPDO of a dictionary; ``changed`` is called when a client changed one."""
        super().__init__(changed)
        self.deadline = NEVER  # steady time in [s] at which one of them is to be sent
        self._synchronous: list[Tpdo] = []
        self._event_driven: list[Tpdo] = []
        self.channels = [
            Tpdo(store, number, self._channel_changed, send)
            for number in channel_numbers(store, Index.TPDO_COMMUNICATION)
        ]

    def start(self, now: float) -> None:
        """Send from now on."""
        self._running = True
        self._select()
        for tpdo in self.active:
            tpdo.start(now)
        self.advance(now)

    def stop(self) -> None:
        """Send no more."""
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
        """Send those whose turn this SYNC is."""
        for tpdo in self._synchronous:
            tpdo.sync(counter, now)

    def poll(self, now: float) -> None:
        """Send the event-driven ones whose values changed."""
        if self._event_driven:
            for tpdo in self._event_driven:
                tpdo.poll(now)
            self._update_deadline()

    def advance(self, now: float) -> None:
        """Send those that are due."""
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

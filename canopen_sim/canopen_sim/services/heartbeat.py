# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Heartbeat producer and consumer of a device (CiA 301, 7.2.8.2.2, 7.5.2.17 and 7.5.2.18)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from arm_canopen.can import Frame
from arm_canopen.standard import (
    AbortCode,
    CobId,
    ConsumerHeartbeatTime,
    Index,
    NmtState,
    parse_heartbeat,
)
from arm_canopen.standard.datatypes import Value

from ..objects.object_store import Integer, ObjectStore, refusal
from ..timed import NEVER

MILLISECOND = 0.001  # [s]
GOLDEN_RATIO = 0.618034  # its multiples, less their whole part, are spread most evenly


class HeartbeatProducer:
    """Sends the NMT state at the period of 0x1017.

    The devices of a network are often configured in the same instant. So that their heartbeats
    do not crowd, the first one after a start is early by a part of the period that depends on
    the node id; all others keep the period.

    Attributes:
        node_id: Id of the device.
        deadline: Steady time in [s] of the next heartbeat.
    """

    def __init__(
        self,
        node_id: int,
        store: ObjectStore,
        state: Callable[[], NmtState],
        send: Callable[[Frame], None],
    ) -> None:
        """Bind 0x1017.

        Args:
            node_id: Id of the device.
            store: Its objects.
            state: Answers the NMT state.
            send: Takes the frames.
        """
        self.deadline = NEVER
        self._period = store.integer(Index.PRODUCER_HEARTBEAT)  # [ms]
        self._period.listener = self.start
        self.node_id = node_id
        self._state = state
        self._send = send

    def start(self, now: float) -> None:
        """Begin a new series of heartbeats, or none when the period is 0."""
        period = self._period.value * MILLISECOND
        phase = self.node_id * GOLDEN_RATIO % 1.0
        self.deadline = now + period * (1.0 - phase) if period else NEVER

    def stop(self) -> None:
        """Fall silent until :meth:`start`."""
        self.deadline = NEVER

    def advance(self, now: float) -> None:
        """Send a heartbeat when it is due."""
        if now < self.deadline:
            return
        self._send(Frame(CobId.HEARTBEAT + self.node_id, bytes((self._state(),))))
        period = self._period.value * MILLISECOND
        self.deadline += period
        if self.deadline <= now:  # a process that stood still does not catch up in a burst
            self.deadline = now + period


class HeartbeatConsumer:
    """Watches the devices that 0x1016 names; a watch begins with the first heartbeat.

    Attributes:
        deadline: Steady time in [s] at which the next heartbeat counts as lost.
        missing: Ids of the devices whose heartbeat stayed away.
    """

    def __init__(
        self,
        store: ObjectStore,
        lost: Callable[[int, float], None],
        returned: Callable[[int, float], None],
        changed: Callable[[], None],
    ) -> None:
        """Bind 0x1016.

        Args:
            store: Objects of the device.
            lost: Called with the node id and the time when a heartbeat stayed away.
            returned: Called with the node id and the time when a lost one is there again.
            changed: Called when other frames are of interest from now on.
        """
        self.deadline = NEVER
        self._lost = lost
        self._returned = returned
        self._changed = changed
        self._periods: dict[int, float] = {}  # [s] by node id
        self._deadlines: dict[int, float] = {}  # of those that have sent one
        self.missing: set[int] = set()
        self._entries = [
            store.integer(entry.index, entry.subindex)
            for entry in store.dictionary.subindices(Index.CONSUMER_HEARTBEAT)
            if entry.subindex > 0
        ]
        for variable in self._entries:
            variable.check = partial(self._check, variable)
            variable.listener = self._reconfigure

    @property
    def can_ids(self) -> list[int]:
        """Identifiers of the heartbeats that it wants to receive."""
        return [CobId.HEARTBEAT + node_id for node_id in self._periods]

    def reset(self) -> None:
        """Watch the nodes of 0x1016, from the next heartbeats on."""
        entries = (_consumer(variable.value) for variable in self._entries)
        self._periods = {node_id: period for node_id, period in entries if period}
        self._deadlines.clear()
        self.missing.clear()
        self.deadline = NEVER
        self._changed()

    def receive(self, frame: Frame, now: float) -> None:
        """Take a heartbeat."""
        node_id = frame.can_id - CobId.HEARTBEAT
        period = self._periods.get(node_id)
        if period is None or parse_heartbeat(frame.data) is None:
            return
        self._deadlines[node_id] = now + period
        self.deadline = min(self._deadlines.values())
        if node_id in self.missing:
            self.missing.discard(node_id)
            self._returned(node_id, now)

    def postpone(self, stalled: float) -> None:
        """Leave out a time in [s] in which nothing was received."""
        for node_id in self._deadlines:
            self._deadlines[node_id] += stalled
        self.deadline += stalled

    def advance(self, now: float) -> None:
        """Report the heartbeats that stayed away."""
        if now < self.deadline:
            return
        late = [node_id for node_id, deadline in self._deadlines.items() if deadline <= now]
        for node_id in late:
            del self._deadlines[node_id]
            self.missing.add(node_id)
        self.deadline = min(self._deadlines.values(), default=NEVER)
        for node_id in late:
            self._lost(node_id, now)

    def _reconfigure(self, _now: float) -> None:
        self.reset()

    def _check(self, variable: Integer, value: Value) -> None:
        node_id, period = _consumer(int(value)) if isinstance(value, int) else (0, 0.0)
        others = (_consumer(other.value) for other in self._entries if other is not variable)
        # one device cannot have two consumer times (CiA 301, 7.5.2.17)
        if period and any(node_id == other and time for other, time in others):
            raise refusal(AbortCode.PARAMETER_INCOMPATIBLE, variable.entry)


def _consumer(word: int) -> tuple[int, float]:
    """Return node id and time in [s] of an entry of 0x1016; time 0 when it is not used."""
    entry = ConsumerHeartbeatTime.parse(word)
    return entry.node_id, entry.time_ms * MILLISECOND if entry.used else 0.0

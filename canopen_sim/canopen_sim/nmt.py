# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT state machine and error control of a device (CiA 301, 7.2.8 and 7.3.2)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from canopen_core.can import Frame
from canopen_core.standard import (
    AbortCode,
    ALL_NODES,
    CobId,
    COMMANDED_STATES,
    ConsumerHeartbeatTime,
    Index,
    NmtCommand,
    NmtState,
    parse_heartbeat,
    parse_nmt,
    RESETS,
    Value,
)

from .messages import EmcyProducer
from .object_store import Integer, NEVER, ObjectStore, refusal


class NmtSlave:
    """NMT state of one device; it executes commands for its id and for all."""

    def __init__(
        self,
        node_id: int,
        reset: Callable[[NmtCommand, float], None],
        changed: Callable[[NmtState, float], None],
        boot_time: float,
    ) -> None:
        """Start switched off; the first :meth:`advance` starts Initialisation (duration in [s]).

        ``reset`` restores the defaults of the whole device or of its communication; ``changed``
        is called with the previous state after each change of state, also after boot-up.
        """
        self.state = NmtState.BOOT_UP  # BOOT_UP stands for Initialisation
        self.deadline = 0.0  # when Initialisation ends, as steady time in [s]
        self.node_id = node_id
        self._reset = reset
        self._changed = changed
        self._boot_time = boot_time
        self._powered = False

    def receive(self, frame: Frame, now: float) -> None:
        """Execute a command; unknown ones are ignored."""
        parsed = parse_nmt(frame.data)
        if parsed is None or parsed[1] not in (ALL_NODES, self.node_id):
            return
        command, _ = parsed
        if command in RESETS:
            self._initialise(command, now)
        elif self.state is not NmtState.BOOT_UP:
            self.enter(COMMANDED_STATES[command], now)

    def enter(self, state: NmtState, now: float) -> None:
        """Enter a state, unless it is the present one."""
        if state is self.state:
            return
        previous, self.state = self.state, state
        self._changed(previous, now)

    def advance(self, now: float) -> None:
        """Start Initialisation after power-on; end it when its time has passed."""
        if not self._powered:
            self._powered = True
            self._initialise(NmtCommand.RESET_NODE, now)
        if now >= self.deadline:
            self.deadline = NEVER
            self.enter(NmtState.PRE_OPERATIONAL, now)

    def switch_off(self) -> None:
        """Lose the power; the next :meth:`advance` starts Initialisation again."""
        self.state = NmtState.BOOT_UP
        self.deadline = 0.0
        self._powered = False

    def _initialise(self, command: NmtCommand, now: float) -> None:
        self.state = NmtState.BOOT_UP
        self._reset(command, now)
        self.deadline = now + self._boot_time
        if self._boot_time <= 0.0:
            self.advance(now)


MILLISECOND = 0.001  # [s]
GOLDEN_RATIO = 0.618034  # its multiples, less their whole part, are spread most evenly
TOGGLE = 0x80
HEARTBEAT_ERROR = 0x8130  # EMCY: life guard error or heartbeat error
ERROR_STATES: dict[int, NmtState] = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}
"""State after a communication error in Operational, by 0x1029:01; 1 changes nothing."""


class ErrorControl:
    """Error control of one device.

    The producer sends the NMT state at the period of 0x1017. Devices of a network are often
    configured at the same instant; to spread their heartbeats, the first one after a start is
    early by a part of the period that depends on the node id.

    The consumer monitors the devices in 0x1016, each from its first heartbeat on. Node guarding
    answers remote frames of the master; life guarding starts with the first request. A device
    that sends heartbeats is not guarded, and a device without 0x100C cannot be.
    """

    def __init__(
        self,
        store: ObjectStore,
        nmt: NmtSlave,
        errors: EmcyProducer,
        *,
        lost: Callable[[float], None],
        send: Callable[[Frame], None],
        subscribe: Callable[[], None],
    ) -> None:
        """Bind 0x100C, 0x100D, 0x1016, 0x1017 and 0x1029.

        ``lost`` is called with the time of a loss, on which the axes stop as 0x6007 selects, and
        ``subscribe`` when the identifiers to receive have changed.
        """
        self.node_id = nmt.node_id  # id of the device
        self._nmt = nmt
        self._errors = errors
        self._lost = lost
        self._send = send
        self._subscribe = subscribe
        self._behaviour = store.integer(Index.ERROR_BEHAVIOUR, 1)
        self._next_heartbeat = NEVER
        self._period = store.integer(Index.PRODUCER_HEARTBEAT)  # [ms]
        self._period.listener = self.start
        self._periods: dict[int, float] = {}  # [s] of those watched, by node id
        self._watched: dict[int, float] = {}  # when the next heartbeat counts as lost
        self._first_loss = NEVER
        self._consumers = [
            store.integer(entry.index, entry.subindex)
            for entry in store.dictionary.subindices(Index.CONSUMER_HEARTBEAT)
            if entry.subindex > 0
        ]
        for variable in self._consumers:
            variable.check = partial(self._check_consumer, variable)
            variable.listener = lambda _now: self._watch()
        self._toggle = False
        self._life_end = NEVER
        self._has_guarding = (Index.GUARD_TIME, 0) in store
        self._guard_time = store.integer(Index.GUARD_TIME)  # [ms]
        self._factor = store.integer(Index.LIFE_TIME_FACTOR)
        self._guard_time.listener = self._factor.listener = self._change_life_time

    @property
    def deadline(self) -> float:
        """Steady time in [s] to send the next heartbeat, or to report a missing one."""
        return min(self._next_heartbeat, self._first_loss, self._life_end)

    @property
    def can_ids(self) -> list[int]:
        """Identifiers of the monitored heartbeats."""
        return [CobId.HEARTBEAT + node_id for node_id in self._periods]

    def reset(self) -> None:
        """Restart, as after a reset of the communication: the toggle bit is 0."""
        self._toggle = False
        self._life_end = NEVER
        self._watch()

    def start(self, now: float) -> None:
        """Start sending heartbeats, unless the period is 0."""
        period = self._period.value * MILLISECOND
        phase = self.node_id * GOLDEN_RATIO % 1.0
        self._next_heartbeat = now + period * (1.0 - phase) if period else NEVER

    def stop(self) -> None:
        """Stop sending heartbeats until :meth:`start`."""
        self._next_heartbeat = NEVER

    def receive(self, frame: Frame, now: float) -> None:
        """Process a heartbeat of another device."""
        node_id = frame.can_id - CobId.HEARTBEAT
        period = self._periods.get(node_id)
        if period is None or parse_heartbeat(frame.data) is None:
            return
        self._watched[node_id] = now + period
        self._first_loss = min(self._watched.values())
        self._errors.clear(HEARTBEAT_ERROR, now, node_id)

    def guard(self, now: float) -> None:
        """Answer a remote frame for the state of this device."""
        state = self._nmt.state
        if state is NmtState.BOOT_UP or self._period.value or not self._has_guarding:
            return
        word = state | (TOGGLE if self._toggle else 0)
        self._toggle = not self._toggle
        self._send(Frame(CobId.HEARTBEAT + self.node_id, bytes((word,))))
        self._life_end = now + self._life_time
        self._errors.clear(HEARTBEAT_ERROR, now, self)

    def advance(self, now: float) -> None:
        """Send a heartbeat if it is due; report missing ones."""
        if now >= self._next_heartbeat:
            self._send(Frame(CobId.HEARTBEAT + self.node_id, bytes((self._nmt.state,))))
            period = self._period.value * MILLISECOND
            self._next_heartbeat += period
            if self._next_heartbeat <= now:  # a process that stood still does not catch up
                self._next_heartbeat = now + period
        if now >= self._first_loss:
            late = [node_id for node_id, due in self._watched.items() if due <= now]
            for node_id in late:
                del self._watched[node_id]
            self._first_loss = min(self._watched.values(), default=NEVER)
            for node_id in late:
                self._lose(now, node_id, node_id)
        if now >= self._life_end:
            self._life_end = NEVER
            self._lose(now, self)

    def postpone(self, stalled: float) -> None:
        """Postpone time-outs by a time in [s] in which nothing was received."""
        for node_id in self._watched:
            self._watched[node_id] += stalled
        self._first_loss += stalled
        self._life_end += stalled

    @property
    def _life_time(self) -> float:
        """Life guarding time-out in [s]; NEVER if life guarding is off."""
        return self._guard_time.value * self._factor.value * MILLISECOND or NEVER

    def _change_life_time(self, now: float) -> None:
        if self._life_end != NEVER:  # it is being guarded
            self._life_end = now + self._life_time

    def _watch(self) -> None:
        """Monitor the nodes in 0x1016, each from its next heartbeat on."""
        entries = (_consumer(variable.value) for variable in self._consumers)
        self._periods = {node_id: period for node_id, period in entries if period}
        self._watched.clear()
        self._first_loss = NEVER
        self._subscribe()

    def _lose(self, now: float, source: object, node_id: int = 0) -> None:
        """React to a communication error as 0x1029:01 and 0x6007 of the drive select."""
        vendor = bytes((node_id, 0, 0, 0, 0))
        self._errors.report(HEARTBEAT_ERROR, now, source, vendor)
        self._lost(now)
        target = ERROR_STATES.get(self._behaviour.value)
        if target is not None and self._nmt.state is NmtState.OPERATIONAL:
            self._nmt.enter(target, now)

    def _check_consumer(self, variable: Integer, value: Value) -> None:
        node_id, period = _consumer(int(value)) if isinstance(value, int) else (0, 0.0)
        others = (_consumer(other.value) for other in self._consumers if other is not variable)
        # one device cannot have two consumer times (CiA 301, 7.5.2.17)
        if period and any(node_id == other and time for other, time in others):
            raise refusal(AbortCode.PARAMETER_INCOMPATIBLE, variable.entry)


def _consumer(word: int) -> tuple[int, float]:
    """Return node id and time in [s] of an entry of 0x1016; time 0 when it is not used."""
    entry = ConsumerHeartbeatTime.parse(word)
    return entry.node_id, entry.time_ms * MILLISECOND if entry.used else 0.0

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whom a device watches, and what it does when it misses one (CiA 301, 7.5.2.33)."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from typing import Protocol

from arm_canopen.can import Frame
from arm_canopen.standard import Index, NmtState

from ..objects.object_store import ObjectStore
from .emcy_producer import EmcyProducer
from .heartbeat import HeartbeatConsumer
from .nmt_slave import NmtSlave
from .node_guarding import GuardedNode

HEARTBEAT_ERROR = 0x8130  # EMCY: life guard error or heartbeat error
ERROR_STATES: dict[int, NmtState] = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}
"""Where a communication error leads from Operational, by 0x1029:01; 1 leads nowhere."""


class Axis(Protocol):
    """What stops when a connection is lost."""

    @property
    def faults(self) -> Container[int]:
        """Its error codes that are latched."""

    def connection_lost(self, now: float) -> None:
        """Stop as 0x6007 says."""


class ErrorControl:
    """Heartbeat consumer and life guarding of one device, with what follows from a loss.

    Attributes:
        consumer: Watches the devices that 0x1016 names.
        guarding: Answers who guards this device, and notices their end.
    """

    def __init__(
        self,
        store: ObjectStore,
        nmt: NmtSlave,
        errors: EmcyProducer,
        drives: Sequence[Axis],
        *,
        send: Callable[[Frame], None],
        subscribe: Callable[[], None],
    ) -> None:
        """Bind 0x1016, 0x100C, 0x100D and 0x1029.

        Args:
            store: Objects of the device.
            nmt: Its NMT state.
            errors: Takes its errors.
            drives: Its axes, which stop as 0x6007 selects.
            send: Takes the frames.
            subscribe: Called when other identifiers are listened to.
        """
        self._nmt = nmt
        self._errors = errors
        self._drives = drives
        self._behaviour = store.integer(Index.ERROR_BEHAVIOUR, 1)
        self.consumer = HeartbeatConsumer(
            store, self._heartbeat_lost, self._heartbeat_back, subscribe
        )
        self.guarding = GuardedNode(
            nmt.node_id, store, lambda: nmt.state, send, self._guarding_changed
        )

    def reset(self) -> None:
        """Watch no node before its next heartbeat."""
        self.consumer.reset()
        self.guarding.reset()

    def postpone(self, stalled: float) -> None:
        """Leave out a time in [s] in which nothing was received."""
        self.consumer.postpone(stalled)
        self.guarding.postpone(stalled)

    def _heartbeat_lost(self, node_id: int, now: float) -> None:
        self._lose(now, node_id)

    def _heartbeat_back(self, _node_id: int, now: float) -> None:
        self._regain(now)

    def _guarding_changed(self, lost: bool, now: float) -> None:
        if lost:
            self._lose(now)
        else:
            self._regain(now)

    def _lose(self, now: float, node_id: int = 0) -> None:
        """React to a communication error as 0x1029:01 and 0x6007 of the drive select."""
        self._errors.report(HEARTBEAT_ERROR, now, bytes((node_id, 0, 0, 0, 0)))
        for drive in self._drives:
            drive.connection_lost(now)
        target = ERROR_STATES.get(self._behaviour.value)
        if target is not None and self._nmt.state is NmtState.OPERATIONAL:
            self._nmt.enter(target, now)

    def _regain(self, now: float) -> None:
        latched = any(HEARTBEAT_ERROR in drive.faults for drive in self._drives)
        if not (latched or self.consumer.missing or self.guarding.lost):
            self._errors.clear(HEARTBEAT_ERROR, now)

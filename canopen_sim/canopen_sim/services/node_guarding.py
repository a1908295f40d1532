# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Node guarding as the guarded device sees it, and life guarding (CiA 301, 7.2.8.2.2.2)."""

from __future__ import annotations

from collections.abc import Callable

from arm_canopen.can import Frame
from arm_canopen.standard import CobId, Index, NmtState

from ..objects.object_store import ObjectStore
from ..timed import NEVER

MILLISECOND = 0.001  # [s]
TOGGLE = 0x80


class GuardedNode:
    """Answers the remote frames of a master that guards this device, and notices their end.

    Life guarding begins with the first request. A device that sends heartbeats is not guarded,
    and one without 0x100C cannot be.

    Attributes:
        node_id: Id of the device.
        deadline: Steady time in [s] at which the life time is over.
        lost: The requests stayed away for the life time.
    """

    def __init__(
        self,
        node_id: int,
        store: ObjectStore,
        state: Callable[[], NmtState],
        send: Callable[[Frame], None],
        changed: Callable[[bool, float], None],
    ) -> None:
        """Bind 0x100C and 0x100D.

        Args:
            node_id: Id of the device.
            store: Its objects.
            state: Answers the NMT state.
            send: Takes the frames.
            changed: Called with whether the master is lost, and the time.
        """
        self.node_id = node_id
        self.deadline = NEVER
        self.lost = False
        self._exists = (Index.GUARD_TIME, 0) in store
        self._guard_time = store.integer(Index.GUARD_TIME)  # [ms]
        self._factor = store.integer(Index.LIFE_TIME_FACTOR)
        self._heartbeat = store.integer(Index.PRODUCER_HEARTBEAT)  # [ms]
        self._guard_time.listener = self._factor.listener = self._reconfigure
        self._state = state
        self._send = send
        self._changed = changed
        self._toggle = False

    @property
    def life_time(self) -> float:
        """How long requests may stay away in [s]; 0 when nobody watches."""
        return self._guard_time.value * self._factor.value * MILLISECOND

    def reset(self) -> None:
        """Begin anew, as after a reset of the communication: the toggle bit is 0."""
        self._toggle = False
        self.deadline = NEVER
        self.lost = False

    def request(self, now: float) -> None:
        """Answer a remote frame for the state of this device."""
        state = self._state()
        if state is NmtState.BOOT_UP or self._heartbeat.value or not self._exists:
            return
        word = state | (TOGGLE if self._toggle else 0)
        self._toggle = not self._toggle
        self._send(Frame(CobId.HEARTBEAT + self.node_id, bytes((word,))))
        self.deadline = now + self.life_time if self.life_time else NEVER
        if self.lost:
            self.lost = False
            self._changed(False, now)

    def advance(self, now: float) -> None:
        """Notice that the requests stayed away."""
        if now >= self.deadline:
            self.deadline = NEVER
            self.lost = True
            self._changed(True, now)

    def postpone(self, stalled: float) -> None:
        """Leave out a time in [s] in which nothing was received."""
        self.deadline += stalled

    def _reconfigure(self, now: float) -> None:
        if self.deadline != NEVER:  # it is being guarded
            self.deadline = now + self.life_time if self.life_time else NEVER

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT state machine of a device (CiA 301, 7.3.2)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.can import Frame
from canopen_core.standard import (
    ALL_NODES,
    COMMANDED_STATES,
    NmtCommand,
    NmtState,
    parse_nmt,
    RESETS,
)

from ..timed import NEVER


class NmtSlave:
    """NMT state of one device; it executes commands for its id and for all."""

    def __init__(
        self,
        node_id: int,
        reset: Callable[[NmtCommand, float], None],
        changed: Callable[[NmtState, float], None],
        boot_time: float,
    ) -> None:
        """Begin switched off; the first :meth:`advance` starts Initialisation, of a time in [s].

        ``reset`` returns to the defaults of the whole device or of its communication; ``changed``
        is called with the previous state when another was entered, also after boot-up.
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
        """Go to a state; nothing happens when it is the present one."""
        if state is self.state:
            return
        previous, self.state = self.state, state
        self._changed(previous, now)

    def advance(self, now: float) -> None:
        """Begin Initialisation after power-on; end it when its time is over."""
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

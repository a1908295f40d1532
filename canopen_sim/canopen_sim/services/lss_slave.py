# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Layer setting services as the device sees them: its node id and bit rate (CiA 305)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.can import Frame
from canopen_core.standard import (
    ADDRESS_BITS,
    BIT_RATES,
    decode_lss,
    fast_scan,
    FastScan,
    Index,
    lss_bytes,
    lss_number,
    LSS_RESPONSE,
    LssCommand,
    LssMessage,
    LssState,
    NODE_ID_MAX,
    NODE_ID_MIN,
    STANDARD_TABLE,
    UNCONFIGURED,
    WHOLE_NUMBER,
)

from ..objects.object_store import ObjectStore
from ..objects.parameter_storage import ParameterMemory


class LssSlave:
    """The LSS of one device."""

    def __init__(
        self,
        node_id: int,
        store: ObjectStore,
        memory: ParameterMemory,
        send: Callable[[Frame], None],
        apply: Callable[[float], None],
    ) -> None:
        """Begin in the waiting state.

        ``apply`` is called with the time when a device without node id has got one.
        """
        self.state = LssState.WAITING  # whether it takes configuration commands
        self.node_id = node_id
        self.pending_id = node_id  # node id that takes effect with the next initialisation
        self._store = store
        self._memory = memory
        self._send = send
        self._apply = apply
        self._timing: int | None = None
        self._matched: dict[int, bool] = {}
        self._scan_position = 0

    def reset(self) -> None:
        """Begin anew, as after a reset."""
        self.state = LssState.WAITING
        self._matched.clear()
        self._scan_position = 0

    def receive(self, frame: Frame, now: float) -> None:
        """Process a request; those without meaning are ignored."""
        message = decode_lss(frame.data)
        if message is None:
            return
        command, number = message.command, message.number
        if command == LssCommand.SWITCH_GLOBAL:
            self._switch(message.byte, now)
        elif LssCommand.SELECT_VENDOR <= command <= LssCommand.SELECT_SERIAL:
            self._select(command - LssCommand.SELECT_VENDOR, number)
        elif LssCommand.IDENTIFY_VENDOR <= command <= LssCommand.IDENTIFY_SERIAL_HIGH:
            self._identify(command, number)
        elif command == LssCommand.IDENTIFY_UNCONFIGURED:
            if self.node_id == UNCONFIGURED:
                self._answer(lss_bytes(LssCommand.UNCONFIGURED_IDENTIFIED))
        elif command == LssCommand.FAST_SCAN:
            self._scan(fast_scan(message))
        elif self.state is LssState.CONFIGURATION:
            self._configure(message)

    def _configure(self, message: LssMessage) -> None:
        command, value = message.command, message.byte
        if command == LssCommand.CONFIGURE_NODE_ID:
            valid = NODE_ID_MIN <= value <= NODE_ID_MAX or value == UNCONFIGURED
            if valid:
                self.pending_id = value
            self._answer(lss_bytes(command, not valid))
        elif command == LssCommand.CONFIGURE_BIT_TIMING:
            rate = message.parameters[1]
            valid = value == STANDARD_TABLE and rate in BIT_RATES
            if valid:
                self._timing = rate
            self._answer(lss_bytes(command, not valid))
        elif command == LssCommand.STORE:
            self._memory.node_id = self.pending_id
            if self._timing is not None:
                self._memory.bit_timing = self._timing
            self._memory.commit()
            self._answer(lss_bytes(command))
        elif command == LssCommand.INQUIRE_NODE_ID:
            self._answer(lss_bytes(command, self.node_id))
        elif LssCommand.INQUIRE_VENDOR <= command <= LssCommand.INQUIRE_SERIAL:
            number = self._number(command - LssCommand.INQUIRE_VENDOR)
            self._answer(lss_number(command, number))

    def _switch(self, mode: int, now: float) -> None:
        if mode == LssState.CONFIGURATION:
            self.state = LssState.CONFIGURATION
        elif mode == LssState.WAITING:
            was, self.state = self.state, LssState.WAITING
            leaves = was is LssState.CONFIGURATION and self.node_id == UNCONFIGURED
            if leaves and self.pending_id != UNCONFIGURED:
                self._apply(now)

    def _select(self, part: int, number: int) -> None:
        if self.state is LssState.CONFIGURATION:
            return
        if part == 0:
            self._matched.clear()
        self._matched[part] = self._number(part) == number
        if part == 3 and [self._matched.get(k) for k in range(4)] == [True] * 4:
            self._matched.clear()
            self.state = LssState.CONFIGURATION
            self._answer(lss_bytes(LssCommand.SELECTED))

    def _identify(self, command: int, number: int) -> None:
        tests = {
            LssCommand.IDENTIFY_VENDOR: self._number(0) == number,
            LssCommand.IDENTIFY_PRODUCT: self._number(1) == number,
            LssCommand.IDENTIFY_REVISION_LOW: self._number(2) >= number,
            LssCommand.IDENTIFY_REVISION_HIGH: self._number(2) <= number,
            LssCommand.IDENTIFY_SERIAL_LOW: self._number(3) >= number,
            LssCommand.IDENTIFY_SERIAL_HIGH: self._number(3) <= number,
        }
        if command == LssCommand.IDENTIFY_VENDOR:
            self._matched.clear()
        self._matched[command] = tests[LssCommand(command)]
        if command == LssCommand.IDENTIFY_SERIAL_HIGH:
            found = all(self._matched.get(key, False) for key in tests)
            self._matched.clear()
            if found:
                self._answer(lss_bytes(LssCommand.IDENTIFIED))

    def _scan(self, step: FastScan) -> None:
        """Process a step of fast scan; only devices without a node id join (CiA 305, 6.6)."""
        if self.node_id != UNCONFIGURED or self.state is LssState.CONFIGURATION:
            return
        if step.bit == WHOLE_NUMBER:
            self._scan_position = 0
            self._answer(lss_bytes(LssCommand.IDENTIFIED))
            return
        parts = range(4)
        if step.bit >= ADDRESS_BITS or step.part not in parts or step.following not in parts:
            return
        other = step.part != self._scan_position
        if other or (step.number ^ self._number(step.part)) >> step.bit:
            return
        if step.bit == 0:
            self._scan_position = step.following
            if step.following < step.part:
                self.state = LssState.CONFIGURATION
        self._answer(lss_bytes(LssCommand.IDENTIFIED))

    def _number(self, part: int) -> int:
        """Return vendor, product, revision or serial number, as clients read it."""
        address = (int(Index.IDENTITY), part + 1)
        shown = self._store.overlay.get(address)
        if shown is not None:
            return int.from_bytes(shown, 'little')
        return self._store.integer(*address).value

    def _answer(self, message: LssMessage) -> None:
        self._send(Frame(LSS_RESPONSE, message.encode()))

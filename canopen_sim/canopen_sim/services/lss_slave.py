# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Layer setting services as the device sees them: its node id and bit rate (CiA 305)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.can import Frame
from canopen_core.standard import Index, lss, NODE_ID_MAX, NODE_ID_MIN, UNCONFIGURED

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
        self.state = lss.State.WAITING  # whether it takes configuration commands
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
        self.state = lss.State.WAITING
        self._matched.clear()
        self._scan_position = 0

    def receive(self, frame: Frame, now: float) -> None:
        """Process a request; those without meaning are ignored."""
        message = lss.decode(frame.data)
        if message is None:
            return
        command, number = message.command, message.number
        if command == lss.Command.SWITCH_GLOBAL:
            self._switch(message.byte, now)
        elif lss.Command.SELECT_VENDOR <= command <= lss.Command.SELECT_SERIAL:
            self._select(command - lss.Command.SELECT_VENDOR, number)
        elif lss.Command.IDENTIFY_VENDOR <= command <= lss.Command.IDENTIFY_SERIAL_HIGH:
            self._identify(command, number)
        elif command == lss.Command.IDENTIFY_UNCONFIGURED:
            if self.node_id == UNCONFIGURED:
                self._answer(lss.with_bytes(lss.Command.UNCONFIGURED_IDENTIFIED))
        elif command == lss.Command.FAST_SCAN:
            self._scan(lss.fast_scan(message))
        elif self.state is lss.State.CONFIGURATION:
            self._configure(message)

    def _configure(self, message: lss.Message) -> None:
        command, value = message.command, message.byte
        if command == lss.Command.CONFIGURE_NODE_ID:
            valid = NODE_ID_MIN <= value <= NODE_ID_MAX or value == UNCONFIGURED
            if valid:
                self.pending_id = value
            self._answer(lss.with_bytes(command, not valid))
        elif command == lss.Command.CONFIGURE_BIT_TIMING:
            rate = message.parameters[1]
            valid = value == lss.STANDARD_TABLE and rate in lss.BIT_RATES
            if valid:
                self._timing = rate
            self._answer(lss.with_bytes(command, not valid))
        elif command == lss.Command.STORE:
            self._memory.node_id = self.pending_id
            if self._timing is not None:
                self._memory.bit_timing = self._timing
            self._memory.commit()
            self._answer(lss.with_bytes(command))
        elif command == lss.Command.INQUIRE_NODE_ID:
            self._answer(lss.with_bytes(command, self.node_id))
        elif lss.Command.INQUIRE_VENDOR <= command <= lss.Command.INQUIRE_SERIAL:
            number = self._number(command - lss.Command.INQUIRE_VENDOR)
            self._answer(lss.with_number(command, number))

    def _switch(self, mode: int, now: float) -> None:
        if mode == lss.State.CONFIGURATION:
            self.state = lss.State.CONFIGURATION
        elif mode == lss.State.WAITING:
            was, self.state = self.state, lss.State.WAITING
            leaves = was is lss.State.CONFIGURATION and self.node_id == UNCONFIGURED
            if leaves and self.pending_id != UNCONFIGURED:
                self._apply(now)

    def _select(self, part: int, number: int) -> None:
        if self.state is lss.State.CONFIGURATION:
            return
        if part == 0:
            self._matched.clear()
        self._matched[part] = self._number(part) == number
        if part == 3 and [self._matched.get(k) for k in range(4)] == [True] * 4:
            self._matched.clear()
            self.state = lss.State.CONFIGURATION
            self._answer(lss.with_bytes(lss.Command.SELECTED))

    def _identify(self, command: int, number: int) -> None:
        tests = {
            lss.Command.IDENTIFY_VENDOR: self._number(0) == number,
            lss.Command.IDENTIFY_PRODUCT: self._number(1) == number,
            lss.Command.IDENTIFY_REVISION_LOW: self._number(2) >= number,
            lss.Command.IDENTIFY_REVISION_HIGH: self._number(2) <= number,
            lss.Command.IDENTIFY_SERIAL_LOW: self._number(3) >= number,
            lss.Command.IDENTIFY_SERIAL_HIGH: self._number(3) <= number,
        }
        if command == lss.Command.IDENTIFY_VENDOR:
            self._matched.clear()
        self._matched[command] = tests[lss.Command(command)]
        if command == lss.Command.IDENTIFY_SERIAL_HIGH:
            found = all(self._matched.get(key, False) for key in tests)
            self._matched.clear()
            if found:
                self._answer(lss.with_bytes(lss.Command.IDENTIFIED))

    def _scan(self, step: lss.FastScan) -> None:
        """Process a step of fast scan; only devices without a node id join (CiA 305, 6.6)."""
        if self.node_id != UNCONFIGURED or self.state is lss.State.CONFIGURATION:
            return
        if step.bit == lss.WHOLE_NUMBER:
            self._scan_position = 0
            self._answer(lss.with_bytes(lss.Command.IDENTIFIED))
            return
        parts = range(4)
        if step.bit >= lss.ADDRESS_BITS or step.part not in parts or step.following not in parts:
            return
        other = step.part != self._scan_position
        if other or (step.number ^ self._number(step.part)) >> step.bit:
            return
        if step.bit == 0:
            self._scan_position = step.following
            if step.following < step.part:
                self.state = lss.State.CONFIGURATION
        self._answer(lss.with_bytes(lss.Command.IDENTIFIED))

    def _number(self, part: int) -> int:
        """Return vendor, product, revision or serial number, as clients read it."""
        address = (int(Index.IDENTITY), part + 1)
        shown = self._store.overlay.get(address)
        if shown is not None:
            return int.from_bytes(shown, 'little')
        return self._store.integer(*address).value

    def _answer(self, message: lss.Message) -> None:
        self._send(Frame(lss.RESPONSE, message.encode()))

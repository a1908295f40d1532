# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Layer setting services as the device sees them: its node id and bit rate (CiA 305)."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, IntEnum
import struct

from ..can.frame import Frame
from ..standard.cob_id import NODE_ID_MAX, NODE_ID_MIN
from ..standard.objects import Index
from .object_store import ObjectStore
from .parameter_memory import ParameterMemory

LSS_REQUEST = 0x7E5
LSS_RESPONSE = 0x7E4
FRAME_BYTES = 8  # [byte]
UNCONFIGURED = 255  # the node id of a device that has none
WHOLE_NUMBER = 0x80  # BitCheck of fast scan: all devices answer, and begin anew
BIT_TIMINGS = frozenset({0, 1, 2, 3, 4, 6, 7, 8})
"""Indices of 1000, 800, 500, 250, 125, 50, 20 and 10 kbit/s in the standard table."""


class Command(IntEnum):
    """Command specifiers (CiA 305, 6)."""

    SWITCH_GLOBAL = 0x04
    CONFIGURE_NODE_ID = 0x11
    CONFIGURE_BIT_TIMING = 0x13
    ACTIVATE_BIT_TIMING = 0x15
    STORE = 0x17
    SELECT_VENDOR = 0x40
    SELECT_PRODUCT = 0x41
    SELECT_REVISION = 0x42
    SELECT_SERIAL = 0x43
    SELECTED = 0x44
    IDENTIFY_VENDOR = 0x46
    IDENTIFY_PRODUCT = 0x47
    IDENTIFY_REVISION_LOW = 0x48
    IDENTIFY_REVISION_HIGH = 0x49
    IDENTIFY_SERIAL_LOW = 0x4A
    IDENTIFY_SERIAL_HIGH = 0x4B
    IDENTIFY_UNCONFIGURED = 0x4C
    IDENTIFIED = 0x4F
    UNCONFIGURED_IDENTIFIED = 0x50
    FAST_SCAN = 0x51
    INQUIRE_VENDOR = 0x5A
    INQUIRE_PRODUCT = 0x5B
    INQUIRE_REVISION = 0x5C
    INQUIRE_SERIAL = 0x5D
    INQUIRE_NODE_ID = 0x5E


class LssState(Enum):
    """Whether a device takes configuration commands."""

    WAITING = 0
    CONFIGURATION = 1


class LssSlave:
    """The LSS of one device.

    Attributes:
        state: Whether it takes configuration commands.
        pending_id: Node id that takes effect with the next initialisation.
    """

    def __init__(
        self,
        node_id: int,
        store: ObjectStore,
        memory: ParameterMemory,
        send: Callable[[Frame], None],
        apply: Callable[[float], None],
    ) -> None:
        """Begin in the waiting state.

        Args:
            node_id: Present node id, 255 for none.
            store: Objects of the device, for its identity.
            memory: What lasts without power.
            send: Takes the frames.
            apply: Told the time when a device without node id has got one.
        """
        self.state = LssState.WAITING
        self.node_id = node_id
        self.pending_id = node_id
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
        """Take a request; what makes no sense is ignored."""
        data = frame.data
        if len(data) != FRAME_BYTES:
            return
        command, word = data[0], int(struct.unpack_from('<I', data, 1)[0])
        if command == Command.SWITCH_GLOBAL:
            self._switch(data[1], now)
        elif Command.SELECT_VENDOR <= command <= Command.SELECT_SERIAL:
            self._select(command - Command.SELECT_VENDOR, word)
        elif Command.IDENTIFY_VENDOR <= command <= Command.IDENTIFY_SERIAL_HIGH:
            self._identify(command, word)
        elif command == Command.IDENTIFY_UNCONFIGURED:
            if self.node_id == UNCONFIGURED:
                self._answer(Command.UNCONFIGURED_IDENTIFIED)
        elif command == Command.FAST_SCAN:
            self._scan(word, *data[5:8])
        elif self.state is LssState.CONFIGURATION:
            self._configure(command, data)

    def _configure(self, command: int, data: bytes) -> None:
        if command == Command.CONFIGURE_NODE_ID:
            valid = NODE_ID_MIN <= data[1] <= NODE_ID_MAX or data[1] == UNCONFIGURED
            if valid:
                self.pending_id = data[1]
            self._answer(command, bytes((not valid, 0)))
        elif command == Command.CONFIGURE_BIT_TIMING:
            valid = data[1] == 0 and data[2] in BIT_TIMINGS
            if valid:
                self._timing = data[2]
            self._answer(command, bytes((not valid, 0)))
        elif command == Command.STORE:
            self._memory.node_id = self.pending_id
            if self._timing is not None:
                self._memory.bit_timing = self._timing
            self._memory.commit()
            self._answer(command, bytes(2))
        elif command == Command.INQUIRE_NODE_ID:
            self._answer(command, bytes((self.node_id,)))
        elif Command.INQUIRE_VENDOR <= command <= Command.INQUIRE_SERIAL:
            number = self._number(command - Command.INQUIRE_VENDOR)
            self._answer(command, struct.pack('<I', number))

    def _switch(self, mode: int, now: float) -> None:
        if mode == LssState.CONFIGURATION.value:
            self.state = LssState.CONFIGURATION
        elif mode == LssState.WAITING.value:
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
            self._answer(Command.SELECTED)

    def _identify(self, command: int, number: int) -> None:
        tests = {
            Command.IDENTIFY_VENDOR: self._number(0) == number,
            Command.IDENTIFY_PRODUCT: self._number(1) == number,
            Command.IDENTIFY_REVISION_LOW: self._number(2) >= number,
            Command.IDENTIFY_REVISION_HIGH: self._number(2) <= number,
            Command.IDENTIFY_SERIAL_LOW: self._number(3) >= number,
            Command.IDENTIFY_SERIAL_HIGH: self._number(3) <= number,
        }
        if command == Command.IDENTIFY_VENDOR:
            self._matched.clear()
        self._matched[command] = tests[Command(command)]
        if command == Command.IDENTIFY_SERIAL_HIGH:
            found = all(self._matched.get(key, False) for key in tests)
            self._matched.clear()
            if found:
                self._answer(Command.IDENTIFIED)

    def _scan(self, number: int, bit: int, part: int, following: int) -> None:
        """Take a step of fast scan, which only devices without a node id join (CiA 305, 6.6)."""
        if self.node_id != UNCONFIGURED or self.state is LssState.CONFIGURATION:
            return
        if bit == WHOLE_NUMBER:
            self._scan_position = 0
            self._answer(Command.IDENTIFIED)
            return
        if bit > 31 or part > 3 or following > 3 or part != self._scan_position:
            return
        if (number ^ self._number(part)) >> bit:
            return
        if bit == 0:
            self._scan_position = following
            if following < part:
                self.state = LssState.CONFIGURATION
        self._answer(Command.IDENTIFIED)

    def _number(self, part: int) -> int:
        """Return vendor, product, revision or serial number, as clients read it."""
        address = (int(Index.IDENTITY), part + 1)
        shown = self._store.overlay.get(address)
        if shown is not None:
            return int.from_bytes(shown, 'little')
        return self._store.integer(*address).value

    def _answer(self, command: int, data: bytes = b'') -> None:
        self._send(Frame(LSS_RESPONSE, (bytes((command,)) + data).ljust(FRAME_BYTES, b'\0')))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device that boots as a test wants it to: it answers, refuses, lies or keeps silent.

It knows nothing of the package's device and codecs; its SDO server is written from the byte tables
of CiA 301, 7.2.4.3.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from drive_samples import drive_dictionary

from canopen_core.can import Frame
from canopen_core.standard import byte_length, NmtState

NO_OBJECT = 0x0602_0000
TOGGLE_BIT = 0x0503_0000
OF_WRITES = (0x0601_0002, 0x0609_0030, 0x0609_0031, 0x0609_0032)
"""Abort codes that only a download gets: read-only, and values out of range."""
COMMAND_SPECIFIER = 0x0504_0001


@dataclass
class SdoByteServer:
    """Answers requests of 8 bytes from values of bytes."""

    # the objects by index and sub-index; what is written is kept there
    values: dict[tuple[int, int], bytes] = field(default_factory=dict)
    announces_size: bool = True  # initiate responses of uploads carry the length
    expedites: bool = True  # uploads of up to 4 bytes fit into the initiate response
    # abort codes by index and sub-index
    refuses: dict[tuple[int, int], int] = field(default_factory=dict)
    _address: tuple[int, int] = (0, 0)
    _rest: bytes = b''
    _received: bytearray = field(default_factory=bytearray)
    _toggle: int = 0

    def answer(self, request: bytes) -> bytes | None:
        """Return the answer to a frame of a client; None to an abort."""
        assert len(request) == 8
        specifier = request[0] >> 5
        if specifier in (1, 2, 5, 6):
            self._address = (request[1] | request[2] << 8, request[3])
            self._toggle = 0
            code = self.refuses.get(self._address)
            if code is not None and (specifier in (1, 6) or code not in OF_WRITES):
                return self._abort(code)
        if specifier == 1:
            return self._initiate_download(request)
        if specifier == 2:
            return self._initiate_upload()
        if specifier == 0:
            return self._download_segment(request)
        if specifier == 3:
            return self._upload_segment(request)
        return None if specifier == 4 else self._abort(COMMAND_SPECIFIER)

    def _multiplexer(self) -> bytes:
        index, subindex = self._address
        return bytes((index & 0xFF, index >> 8, subindex))

    def _abort(self, code: int) -> bytes:
        return b'\x80' + self._multiplexer() + code.to_bytes(4, 'little')

    def _initiate_download(self, request: bytes) -> bytes:
        self._received = bytearray()
        if request[0] & 2:
            count = 4 - (request[0] >> 2 & 3) if request[0] & 1 else 4
            self.values[self._address] = request[4 : 4 + count]
        return b'\x60' + self._multiplexer() + bytes(4)

    def _download_segment(self, request: bytes) -> bytes:
        if (request[0] >> 4 & 1) != self._toggle:
            return self._abort(TOGGLE_BIT)
        self._received += request[1 : 8 - (request[0] >> 1 & 7)]
        if request[0] & 1:
            self.values[self._address] = bytes(self._received)
        answer = bytes((0x20 | self._toggle << 4,)) + bytes(7)
        self._toggle ^= 1
        return answer

    def _initiate_upload(self) -> bytes:
        if self._address not in self.values:
            return self._abort(NO_OBJECT)
        value = self.values[self._address]
        if self.expedites and 1 <= len(value) <= 4:
            command = 0x43 | (4 - len(value)) << 2 if self.announces_size else 0x42
            return bytes((command,)) + self._multiplexer() + value.ljust(4, b'\0')
        self._rest = value
        size = len(value).to_bytes(4, 'little') if self.announces_size else bytes(4)
        return bytes((0x41 if self.announces_size else 0x40,)) + self._multiplexer() + size

    def _upload_segment(self, request: bytes) -> bytes:
        if (request[0] >> 4 & 1) != self._toggle:
            return self._abort(TOGGLE_BIT)
        part, self._rest = self._rest[:7], self._rest[7:]
        last = not self._rest
        answer = bytes((self._toggle << 4 | (7 - len(part)) << 1 | last,)) + part.ljust(7, b'\0')
        self._toggle ^= 1
        return answer


START, STOP, PRE_OPERATIONAL, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82
STATES = {
    START: NmtState.OPERATIONAL,
    STOP: NmtState.STOPPED,
    PRE_OPERATIONAL: NmtState.PRE_OPERATIONAL,
}
MILLISECOND = 0.001  # [s]


def object_bytes(values: Mapping[tuple[int, int], int]) -> dict[tuple[int, int], bytes]:
    """Return the objects of a drive as their types have them; unknown ones have four bytes."""
    dictionary = drive_dictionary()
    sizes = {entry.address: byte_length(entry.data_type) for entry in dictionary}
    return {
        place: value.to_bytes(sizes.get(place) or 4, 'little') for place, value in values.items()
    }


@dataclass
class ScriptedDevice:
    """A device; it has every object that is written, and those of ``values``."""

    node_id: int  # its node id
    send: Callable[[Frame], None]  # takes its frames
    values: dict[tuple[int, int], bytes] = field(default_factory=dict)  # its objects
    # abort codes by index and sub-index
    refuses: dict[tuple[int, int], int] = field(default_factory=dict)
    announces: bool = True  # it sends a boot-up message after a reset
    answers: bool = True  # it answers SDOs
    beats: bool = True  # it sends heartbeats when 0x1017 says so
    answer_time: float = 0.0005  # how long it thinks about an SDO in [s]
    state: NmtState = NmtState.PRE_OPERATIONAL  # its NMT state
    commands: list[int] = field(default_factory=list)  # NMT commands that it got
    # what was written by expedited downloads, as index, sub-index and number
    writes: list[tuple[int, int, int]] = field(default_factory=list)
    # called with each SDO request before it is answered
    on_request: Callable[[bytes], None] = lambda request: None
    guarded: bool = False  # it answers node guarding
    deaf_to_reset: bool = False  # it misses the resets
    # time in Operational before it falls back by itself in [s]
    relapses_after: float | None = None
    last_words: bytes = b''  # EMCY that it sends then
    _relapse_due: float | None = None
    _toggle: int = 0
    _answers_due: list[tuple[float, bytes]] = field(default_factory=list)
    _beat_due: float | None = None

    def __post_init__(self) -> None:
        """Make the server."""
        self._server = SdoByteServer(values=self.values, refuses=self.refuses)

    def restart(self, now: float) -> None:
        """Start anew, as after a reset or a power cut."""
        self.state, self._toggle = NmtState.PRE_OPERATIONAL, 0
        self._answers_due.clear()
        self._beat_due = None
        self.writes.clear()
        if self.announces:
            self.send(Frame(0x700 + self.node_id, b'\0'))

    def receive(self, frame: Frame, now: float) -> None:
        """Execute NMT commands and answer SDO requests."""
        if frame.can_id == 0x000 and frame.data[1] in (0, self.node_id):
            self.commands.append(frame.data[0])
            if frame.data[0] in STATES:
                self.state = STATES[frame.data[0]]
                if frame.data[0] == START and self.relapses_after is not None:
                    self._relapse_due = now + self.relapses_after
            elif not self.deaf_to_reset:
                self.restart(now)
        elif frame.can_id == 0x700 + self.node_id and frame.is_remote:
            if self.guarded:
                self.send(Frame(frame.can_id, bytes((self._toggle | self.state,))))
                self._toggle ^= 0x80
        elif frame.can_id == 0x600 + self.node_id and self.answers:
            self.on_request(frame.data)
            self._note_write(frame.data, now)
            answer = self._server.answer(frame.data)
            if answer is not None:
                self._answers_due.append((now + self.answer_time, answer))

    def advance(self, now: float) -> None:
        """Answer, and beat."""
        while self._answers_due and self._answers_due[0][0] <= now:
            self.send(Frame(0x580 + self.node_id, self._answers_due.pop(0)[1]))
        if self._beat_due is not None and self._beat_due <= now:
            self._beat_due = now + self._period
            self.send(Frame(0x700 + self.node_id, bytes((self.state,))))

        if self._relapse_due is not None and self._relapse_due <= now:
            self._relapse_due = None
            self.state = NmtState.PRE_OPERATIONAL
            if self.last_words:
                self.send(Frame(0x80 + self.node_id, self.last_words))

    def next_deadline(self) -> float | None:
        """Return when it wants to act in [s]."""
        dues = [*(due for due, _ in self._answers_due[:1]), self._beat_due, self._relapse_due]
        return min((due for due in dues if due is not None), default=None)

    @property
    def _period(self) -> float:
        return int.from_bytes(self.values.get((0x1017, 0), b''), 'little') * MILLISECOND

    def _note_write(self, request: bytes, now: float) -> None:
        if request[0] >> 5 != 1 or not request[0] & 2:
            return
        index, subindex = int.from_bytes(request[1:3], 'little'), request[3]
        if (index, subindex) in self.refuses:
            return
        size = 4 - (request[0] >> 2 & 3)
        value = int.from_bytes(request[4 : 4 + size], 'little')
        self.writes.append((index, subindex, value))
        if (index, subindex) == (0x1017, 0):
            self._beat_due = now + value * MILLISECOND if value and self.beats else None

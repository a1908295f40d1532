# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated device on a bench: the tests are its bus, its master and its clock."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from drive_samples import drive_dictionary, DRIVE_EDS
import pytest

from arm_canopen import DriveState
from canopen_core.can import Frame
from canopen_core.standard import (
    drive_state,
    nmt_frame,
    NmtCommand,
    NmtState,
    ObjectDictionary,
    sdo,
)
from canopen_sim import Device, Drive, Fault, FaultInjection
from canopen_sim.object_store import ParameterMemory

EDS = DRIVE_EDS
NODE_ID = 5

SHUTDOWN, SWITCH_ON, ENABLE = 0x06, 0x07, 0x0F
QUICK_STOP, DISABLE_VOLTAGE, FAULT_RESET = 0x02, 0x00, 0x80


class RefusedError(Exception):
    """The device aborted an SDO."""

    def __init__(self, code: int) -> None:
        super().__init__(f'0x{code:08X}')
        self.code = code


class Rig:
    """One device in virtual time; every frame that it sent is kept."""

    def __init__(
        self,
        dictionary: ObjectDictionary | None = None,
        *,
        node_id: int = NODE_ID,
        boot_time: float = 0.0,
        memory: ParameterMemory | None = None,
        rate_units: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        self.now = 100.0  # virtual time in [s]
        self.node_id = node_id
        self.sent: list[tuple[float, Frame]] = []  # frames of the device with the time of each
        self.device = Device(
            node_id,
            drive_dictionary() if dictionary is None else dictionary,
            self._sent,
            boot_time=boot_time,
            memory=memory,
            rate_units={0: rate_units},
        )
        self.device.advance(self.now)

    def _sent(self, frame: Frame) -> None:
        self.sent.append((self.now, frame))

    @property
    def drive(self) -> Drive:
        """The axis."""
        assert self.device.drive is not None
        return self.device.drive

    @property
    def position(self) -> float:
        """Where the motor is now in [inc]; the drive itself may have looked some time ago."""
        self.drive.advance(self.now)
        return self.drive.position

    @property
    def velocity(self) -> float:
        """How fast the motor turns now in [inc/s]."""
        self.drive.advance(self.now)
        return self.drive.velocity

    def send(self, can_id: int, data: bytes = b'') -> None:
        """Send a frame to the device."""
        self.device.receive(Frame(can_id, data), self.now)

    def run(self, duration: float) -> None:
        """Advance the time, from deadline to deadline."""
        end = self.now + duration
        for _ in range(1_000_000):
            deadline = self.device.next_deadline()
            if deadline is None or deadline > end:
                break
            self.now = max(self.now, deadline)
            self.device.advance(self.now)
        self.now = end

    def cycles(self, count: int, period: float = 0.01) -> None:
        """Send SYNCs at a period."""
        for _ in range(count):
            self.run(period)
            self.sync()

    def sync(self) -> None:
        """Send a SYNC."""
        self.send(0x080)

    def inject(self, fault: Fault, **settings: object) -> None:
        """Begin a fault now."""
        injection = FaultInjection(fault, **settings)  # type: ignore[arg-type]
        self.device.faults.inject(injection, self.now)

    def cure(self, fault: Fault | None = None) -> None:
        """End a fault, or all."""
        self.device.faults.end(self.now, fault)

    def nmt(self, command: NmtCommand, node_id: int | None = None) -> None:
        """Send an NMT command, to the device unless another id is given."""
        self.send(0, nmt_frame(command, self.node_id if node_id is None else node_id))

    def take(self, can_id: int | None = None) -> list[bytes]:
        """Return what the device sent since the last time, of one identifier or of all."""
        frames = [frame for _, frame in self.sent]
        self.sent.clear()
        return [frame.data for frame in frames if can_id is None or frame.can_id == can_id]

    def times(self, can_id: int) -> list[float]:
        """Return when the device sent frames of an identifier, without forgetting them."""
        return [time for time, frame in self.sent if frame.can_id == can_id]

    def raw_sdo(self, request: bytes) -> bytes | None:
        """Send an SDO frame and return the answer."""
        before = len(self.sent)
        self.send(0x600 + self.node_id, request)
        answers = [f for _, f in self.sent[before:] if f.can_id == 0x580 + self.node_id]
        self.sent = self.sent[:before] + [
            item for item in self.sent[before:] if item[1] not in answers
        ]
        return answers[0].data if answers else None

    def sdo(self, request: bytes) -> sdo.Response:
        """Send an SDO frame and return the decoded answer; an abort raises RefusedError."""
        answer = self.raw_sdo(request)
        assert answer is not None, 'no SDO answer'
        response = sdo.decode_response(answer)
        if isinstance(response, sdo.Abort):
            raise RefusedError(response.code)
        return response

    def write(self, index: int, subindex: int, data: bytes) -> None:
        """Write an object, expedited or segmented."""
        if 1 <= len(data) <= 4:
            request = sdo.DownloadRequest(index, subindex, data, len(data))
            assert isinstance(self.sdo(request.encode()), sdo.DownloadResponse)
            return
        self.sdo(sdo.DownloadRequest(index, subindex, None, len(data)).encode())
        toggle = False
        for start in range(0, max(1, len(data)), 7):
            part = data[start : start + 7]
            segment = sdo.Segment(toggle, part, start + 7 >= len(data))
            assert self.sdo(segment.encode()) == sdo.DownloadSegmentResponse(toggle)
            toggle = not toggle

    def read(self, index: int, subindex: int = 0) -> bytes:
        """Read an object, expedited or segmented."""
        response = self.sdo(sdo.UploadRequest(index, subindex).encode())
        assert isinstance(response, sdo.UploadResponse)
        if response.data is not None:
            return response.data
        data, toggle, last = b'', False, False
        while not last:
            segment = self.sdo(sdo.UploadSegmentRequest(toggle).encode())
            assert isinstance(segment, sdo.Segment)
            data, last, toggle = data + segment.data, segment.last, not toggle
        return data

    def put(self, index: int, value: int, subindex: int = 0) -> None:
        """Write a number in the size that the object has."""
        size = self.device.store.find(index, subindex).size
        assert size is not None
        self.write(index, subindex, (value % (1 << 8 * size)).to_bytes(size, 'little'))

    def refused(self, index: int, value: int, subindex: int = 0) -> int:
        """Write a number; return the code with which the device refuses it, 0 for none."""
        try:
            self.put(index, value, subindex)
        except RefusedError as error:
            return error.code
        return 0

    def get(self, index: int, subindex: int = 0) -> int:
        """Read a number; signed when the object is."""
        signed = self.device.store.find(index, subindex).entry.data_type.name.startswith('INT')
        return int.from_bytes(self.read(index, subindex), 'little', signed=signed)

    @property
    def nmt_state(self) -> NmtState:
        """State of the device."""
        return self.device.nmt_state

    @property
    def statusword(self) -> int:
        """Statusword, read by SDO."""
        return self.get(0x6041)

    @property
    def state(self) -> DriveState:
        """State that the statusword shows."""
        return drive_state(self.statusword)

    def command(self, *words: int) -> None:
        """Write controlwords, one after another."""
        for word in words:
            self.put(0x6040, word)

    def enable(self, mode: int = 0) -> None:
        """Select a mode and enable operation."""
        self.put(0x6060, mode)
        self.command(SHUTDOWN, SWITCH_ON, ENABLE)
        assert self.state is DriveState.OPERATION_ENABLED


def moving(
    mode: int = 3, objects: Mapping[int, int] = MappingProxyType({}), speed: int = 500
) -> Rig:
    """Return an Operational drive that moves at a speed in [inc/s], in mode 1, 3, 7 or 8."""
    rig = Rig()
    rig.nmt(NmtCommand.START)
    for index, value in objects.items():
        rig.put(index, value)
    rig.put(0x6081, speed)
    rig.put(0x60FF, speed)
    rig.put(0x60C2, 250, 1)
    rig.put(0x60C2, -2, 2)  # a line of 2.5 s
    rig.enable(mode)
    rig.put(0x607A, 5 * speed // 2)
    rig.command(ENABLE | 0x10)
    rig.put(0x60C1, 5 * speed // 2, 1)
    rig.run(0.5)
    assert rig.velocity == pytest.approx(speed, abs=5)
    return rig


def still(rig: Rig) -> bool:
    """Return whether the motor stands, and goes on standing."""
    rig.run(1.0)
    position = rig.position
    rig.run(5.0)
    return rig.position == position

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""EMCY, stored parameters, TIME and the synchronous window of a simulated device."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone
import logging
from pathlib import Path
import struct

from device_rig import NODE_ID, RefusedError, Rig
from drive_samples import drive_dictionary, with_defaults
import pytest

from canopen_core.standard import AbortCode, COB_ID_INVALID, Emergency, NmtCommand
from canopen_sim import Fault
from canopen_sim.object_store import LOAD, ParameterMemory, SAVE

EMCY = 0x080 + NODE_ID


def emergencies(rig: Rig, can_id: int = EMCY) -> list[tuple[int, int]]:
    """Return code and register of the messages since the last time."""
    return [(e.code, e.register) for e in map(Emergency.decode, rig.take(can_id))]


@pytest.fixture
def rig() -> Rig:
    """A device in Operational."""
    rig = Rig()
    rig.nmt(NmtCommand.START)
    rig.take()
    return rig


REGISTER = {
    0x1000: 0x01, 0x2310: 0x03, 0x3210: 0x05, 0x4310: 0x09, 0x8130: 0x11, 0x8210: 0x11,
    0x8611: 0x21, 0x7305: 0x01, 0xFF01: 0x81,
}  # fmt: skip
"""Bits of 0x1001 by error code."""


@pytest.mark.parametrize(('code', 'register'), REGISTER.items())
def test_error_and_its_end(rig: Rig, code: int, register: int) -> None:
    """Once with its code and the bit of its class in 0x1001; its end has code 0."""
    rig.drive.raise_fault(code)
    rig.drive.raise_fault(code)
    assert emergencies(rig) == [(code, register)]
    assert (rig.get(0x1001), rig.get(0x603F), rig.get(0x1003)) == (register, code, 1)
    rig.drive.raise_fault(0x4311)  # the register has the bits of all, a reset clears one by one
    assert emergencies(rig) == [(0x4311, register | 0x09)]
    rig.command(0x80)
    assert emergencies(rig) == [(0, 0x09 if code < 0x4311 else register), (0, 0)]
    assert (rig.get(0x1001), rig.get(0x603F)) == (0, 0)


def test_history_has_the_newest_first(rig: Rig) -> None:
    """0x1003 keeps the last eight errors; resets are none, writing 0 erases it, not the error."""
    codes = [0xFF00 + number for number in range(10)]
    for number, code in enumerate(codes, start=1):
        rig.drive.raise_fault(code)
        assert rig.get(0x1003) == min(number, 8)
        rig.command(0x00, 0x80)
    assert [rig.get(0x1003, sub) for sub in range(1, 9)] == codes[:1:-1]
    rig.drive.raise_fault(0x2310)
    rig.put(0x1003, 0)
    assert (rig.get(0x1003), rig.get(0x1001)) == (0, 0x03)
    with pytest.raises(RefusedError):
        rig.read(0x1003, 1)


def test_messages_wait(rig: Rig) -> None:
    """They wait while Stopped (CiA 301, table 46), and for the time of 0x1015; none is lost."""
    rig.nmt(NmtCommand.STOP)
    rig.drive.raise_fault(0x2310)
    rig.run(1.0)
    assert rig.take() == []
    rig.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    assert emergencies(rig) == [(0x2310, 0x03)]
    rig.run(1.0)
    rig.put(0x1015, 500)  # [100 us]
    start = rig.now
    for code in (0xFF01, 0xFF02, 0xFF03):
        rig.drive.raise_fault(code, rig.now)
    rig.run(1.0)
    assert rig.times(EMCY) == pytest.approx([start, start + 0.05, start + 0.1])
    assert [code for code, _ in emergencies(rig)] == [0xFF01, 0xFF02, 0xFF03]


def test_other_identifier(rig: Rig) -> None:
    """The COB-ID is changed by switching it off first; then it counts."""
    rig.put(0x1014, 0x80000000 | EMCY)
    rig.drive.raise_fault(0xFF01)
    assert rig.take() == []
    rig.put(0x1014, 0x0FF)
    rig.drive.raise_fault(0xFF02)
    assert emergencies(rig, 0x0FF) == [(0xFF02, 0x81)]


@pytest.mark.parametrize(
    ('command', 'reported'),
    [(NmtCommand.RESET_COMMUNICATION, [(0x2310, 0x03)]), (NmtCommand.RESET_NODE, [])],
)
def test_a_fault_over_a_reset(
    rig: Rig, command: NmtCommand, reported: list[tuple[int, int]]
) -> None:
    """One that lasts is reported again; after a reset of the node there is none."""
    rig.drive.raise_fault(0x2310)
    rig.take()
    rig.nmt(command)
    assert emergencies(rig) == reported
    assert rig.get(0x1001) == (0x03 if reported else 0)


SIGNATURES = {0x1010: SAVE, 0x1011: LOAD}


class StoringRig(Rig):
    """A drive that stores parameters."""

    def __init__(self, memory: ParameterMemory | None = None) -> None:
        super().__init__(memory=memory)
        self.take()

    def order(self, index: int, group: int = 1) -> None:
        """Order it to store (0x1010) or restore (0x1011)."""
        self.put(index, SIGNATURES[index], group)

    def power_cycle(self) -> None:
        """Cut the power, and give it back."""
        self.inject(Fault.REBOOT)
        self.run(0.01)

    @property
    def values(self) -> tuple[int, int]:
        """Acceleration and heartbeat time."""
        return self.get(0x6083), self.get(0x1017)


DEFAULTS = 10_000, 0


def storing_rig() -> StoringRig:
    """Return a drive with another acceleration and heartbeat time than the EDS has."""
    rig = StoringRig()
    rig.put(0x6083, 4711)
    rig.put(0x1017, 250)
    return rig


def test_what_is_stored_is_kept() -> None:
    """It survives power cuts and resets until it is restored; 0x1010 shows the abilities."""
    for orders, reset, kept in (
        ((), None, False),
        ((0x1010,), None, True),
        ((0x1010,), NmtCommand.RESET_NODE, True),
        ((0x1010, 0x1011), None, False),
    ):
        storing = storing_rig()
        for index in orders:
            for value in (0, 1, SAVE if index == 0x1011 else LOAD):  # not by mistake
                assert storing.refused(index, value, 1) == AbortCode.DATA_TRANSFER
            storing.order(index)
        storing.put(0x6083, 1)
        if reset is None:
            storing.power_cycle()
        else:
            storing.nmt(reset)
        assert storing.values == ((4711, 250) if kept else DEFAULTS), (orders, reset)
        assert storing.get(0x1010, 1) == 1


def test_groups() -> None:
    """Communication and application parameters are stored and restored by themselves."""
    storing = storing_rig()
    storing.order(0x1010, 3)
    storing.power_cycle()
    assert storing.values == (4711, DEFAULTS[1])
    storing.put(0x1017, 250)
    storing.order(0x1010, 2)
    storing.order(0x1011, 3)
    assert storing.values == (4711, 250)  # effective after the reset only
    storing.power_cycle()
    assert storing.values == (DEFAULTS[0], 250)


def test_commands_are_not_stored_and_pdos_are() -> None:
    """Controlword, mode and target are 0 after a power cut; a stored PDO is sent at once."""
    storing = storing_rig()
    storing.put(0x1800, COB_ID_INVALID | 0x1FE, 1)
    storing.put(0x1800, 0x40000000 | 0x1FE, 1)
    storing.put(0x1800, 1, 2)
    storing.enable(1)
    storing.put(0x607A, 50_000)
    storing.order(0x1010)
    storing.power_cycle()
    assert (storing.get(0x6040), storing.get(0x6060), storing.get(0x607A)) == (0, 0, 0)
    storing.nmt(NmtCommand.START)
    storing.take()
    storing.sync()
    assert len(storing.take(0x1FE)) == 1
    storing.run(2.0)
    assert storing.get(0x6064) == 0


def test_verify_configuration() -> None:
    """0x1020 is stored with what it stands for, and erased when something else is stored."""
    storing = storing_rig()
    storing.put(0x1020, 14_000, 1)
    storing.put(0x1020, 3_600_000, 2)
    storing.order(0x1010)
    storing.power_cycle()
    assert (storing.get(0x1020, 1), storing.get(0x1020, 2)) == (14_000, 3_600_000)
    storing.order(0x1010)
    assert storing.get(0x1020, 1) == 14_000
    storing.put(0x6083, 1)
    storing.order(0x1010, 3)
    storing.power_cycle()
    assert (storing.get(0x1020, 1), storing.get(0x1020, 2)) == (0, 0)


def test_file_outlives_the_process(tmp_path: Path) -> None:
    """Another device with the same file begins with what the first one has stored."""
    path = tmp_path / 'deep' / 'node_5.json'
    first = StoringRig(ParameterMemory(path))
    first.put(0x6083, 4711)
    assert not path.exists()
    first.order(0x1010)
    assert StoringRig(ParameterMemory(path)).get(0x6083) == 4711
    assert [file.name for file in path.parent.iterdir()] == ['node_5.json']


@pytest.mark.parametrize(
    'text', ['', 'null', '[]', '{}', '{"version": 2}', '{"version": 1, "values": []}',
             '{"version": 1, "values": {"x": "00"}}'],
)  # fmt: skip
def test_damaged_file(tmp_path: Path, text: str, caplog: pytest.LogCaptureFixture) -> None:
    """A file that is damaged is reported, and the defaults count."""
    path = tmp_path / 'node_5.json'
    path.write_text(text, encoding='utf-8')
    with caplog.at_level(logging.ERROR):
        storing = StoringRig(ParameterMemory(path))
    assert storing.values == DEFAULTS
    assert str(path) in caplog.text


def test_values_of_another_dictionary() -> None:
    """Stored values that do not fit the objects are ignored."""
    memory = ParameterMemory()
    memory.values = {
        (0x6083, 0): b'\x01',
        (0x5FFE, 0): b'\x01',
        (0x1000, 0): bytes(4),
        (0x6084, 0): b'\x39\x30\x00\x00',
    }
    storing = StoringRig(memory)
    found = [storing.get(index) for index in (0x6083, 0x1000, 0x6084)]
    assert found == [DEFAULTS[0], 0x20192, 12345]


NOON = datetime(2026, 11, 21, 12, 0, 0, 500_000, tzinfo=timezone.utc)
MESSAGE = struct.pack('<IH', 43_200_500, 15_665)
"""TIME at noon (CiA 301): milliseconds of the day, days since 1984."""


@pytest.fixture
def timed() -> Rig:
    """A drive that takes TIME."""
    return Rig(with_defaults(drive_dictionary(), {(0x1012, 0): 0x8000_0100}))


def test_time_goes_on_from_the_message(timed: Rig) -> None:
    """The device knows the time from the first message on, and forgets it with a reset."""
    clock = timed.device.clock
    timed.send(0x100, bytes(5))
    timed.send(0x101, MESSAGE)
    assert clock.at(timed.now) is None  # of another length, and of another identifier
    timed.send(0x100, MESSAGE)
    timed.run(2.5)
    time = clock.at(timed.now)
    assert time is not None
    assert abs(time - NOON - timedelta(seconds=2.5)) < timedelta(milliseconds=1)
    timed.nmt(NmtCommand.RESET_NODE)
    assert timed.refused(0x1012, 0x8000_0181) == AbortCode.VALUE_RANGE  # changed while in use
    timed.put(0x1012, 0x0000_0100)
    timed.send(0x100, MESSAGE)
    assert clock.at(timed.now) is None
    timed.put(0x1012, 0x8000_0181)
    timed.send(0x181, MESSAGE)
    assert clock.at(timed.now) == NOON


def test_synchronous_window(timed: Rig) -> None:
    """A synchronous RPDO that comes after the window is discarded; without one it counts."""
    timed.put(0x1007, 2000)  # [us]
    timed.put(0x1400, 1, 2)
    timed.nmt(NmtCommand.START)
    timed.sync()
    timed.run(0.001)
    timed.send(0x200 + NODE_ID, b'\x06\x00')
    timed.sync()
    assert timed.get(0x6040) == 6
    timed.run(0.003)
    timed.send(0x200 + NODE_ID, b'\x00\x00')
    timed.sync()
    assert timed.get(0x6040) == 6
    timed.put(0x1007, 0)
    timed.run(0.003)
    timed.send(0x200 + NODE_ID, b'\x00\x00')
    timed.sync()
    assert timed.get(0x6040) == 0

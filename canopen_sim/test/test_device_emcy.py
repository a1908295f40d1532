# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""EMCY messages, error register and error history of a simulated device."""

from __future__ import annotations

from device_rig import NODE_ID, RefusedError, Rig
import pytest

from canopen_core.standard import Emergency, NmtCommand

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


@pytest.mark.parametrize(
    ('code', 'register'),
    [
        (0x1000, 0x01),
        (0x2310, 0x03),
        (0x3210, 0x05),
        (0x4310, 0x09),
        (0x8130, 0x11),
        (0x8210, 0x11),
        (0x8611, 0x21),
        (0x7305, 0x01),
        (0xFF01, 0x81),
    ],
)
def test_error_and_its_end(rig: Rig, code: int, register: int) -> None:
    """Once with its code and the bit of its class in 0x1001; its end has code 0."""
    rig.drive.raise_fault(code)
    rig.drive.raise_fault(code)
    assert emergencies(rig) == [(code, register)]
    assert (rig.get(0x1001), rig.get(0x603F), rig.get(0x1003)) == (register, code, 1)
    rig.command(0x80)
    assert emergencies(rig) == [(0, 0)]
    assert (rig.get(0x1001), rig.get(0x603F)) == (0, 0)


def test_register_shows_all_errors(rig: Rig) -> None:
    """With several errors the register has the bits of all; the reset clears them one by one."""
    rig.drive.raise_fault(0x2310)
    rig.drive.raise_fault(0x4310)
    assert emergencies(rig) == [(0x2310, 0x03), (0x4310, 0x0B)]
    rig.command(0x80)
    assert emergencies(rig) == [(0, 0x09), (0, 0)]


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


def test_inhibit_time(rig: Rig) -> None:
    """Messages keep the distance of 0x1015, and none is lost."""
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


def test_nothing_is_sent_in_stopped(rig: Rig) -> None:
    """EMCY waits while the device is Stopped, and is sent afterwards (CiA 301, table 46)."""
    rig.nmt(NmtCommand.STOP)
    rig.drive.raise_fault(0x2310)
    rig.run(1.0)
    assert rig.take() == []
    rig.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    assert emergencies(rig) == [(0x2310, 0x03)]


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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A simulated device that is guarded by remote frames, and watches whether they come."""

from __future__ import annotations

from device_rig import drive_dictionary, NODE_ID, Rig
import pytest

from arm_canopen import DriveState
from arm_canopen.can import Frame
from arm_canopen.standard import DataType, NmtCommand, NmtState, ObjectDictionary, ObjectEntry
from canopen_sim import Fault, FaultInjection

GUARD = 0x700 + NODE_ID
EMCY = 0x080 + NODE_ID


def guarded_dictionary(error_behaviour: int | None = None) -> ObjectDictionary:
    """Return the simulated drive's dictionary with 0x100C and 0x100D for certain."""
    entries = [entry for entry in drive_dictionary() if entry.index not in (0x100C, 0x100D)]
    entries += [
        ObjectEntry(0x100C, 0, 'Guard time', DataType.UNSIGNED16, default=0),
        ObjectEntry(0x100D, 0, 'Life time factor', DataType.UNSIGNED8, default=0),
    ]
    dictionary = ObjectDictionary(entries)
    if error_behaviour is None:
        return dictionary
    return ObjectDictionary(
        [*dictionary, ObjectEntry(0x1029, 1, 'Communication error', DataType.UNSIGNED8,
                                  default=error_behaviour)]
    )  # fmt: skip


def guard(rig: Rig) -> list[int]:
    """Request the state and return the answers."""
    rig.take()
    rig.device.receive(Frame(GUARD, is_remote=True), rig.now)
    return [data[0] for data in rig.take(GUARD)]


@pytest.fixture
def rig() -> Rig:
    """A drive in Pre-operational with a life time of 0.3 s."""
    rig = Rig(guarded_dictionary())
    rig.put(0x100C, 100)
    rig.put(0x100D, 3)
    return rig


def test_toggle_bit_alternates_from_0(rig: Rig) -> None:
    """Each answer has the state and the other toggle bit; a reset begins with 0 again."""
    assert [guard(rig) for _ in range(3)] == [[0x7F], [0xFF], [0x7F]]
    rig.nmt(NmtCommand.START)
    assert guard(rig) == [0x85]
    rig.nmt(NmtCommand.STOP)
    assert guard(rig) == [0x04]
    rig.nmt(NmtCommand.RESET_COMMUNICATION)
    assert guard(rig) == [0x7F]


def test_one_that_sends_heartbeats_is_not_guarded(rig: Rig) -> None:
    """With 0x1017 set the remote frame gets no answer (one of the two protocols only)."""
    rig.put(0x1017, 100)
    assert guard(rig) == []
    rig.put(0x1017, 0)
    assert guard(rig) == [0x7F]


@pytest.mark.parametrize(
    ('behaviour', 'state'),
    [
        (0, NmtState.PRE_OPERATIONAL),
        (1, NmtState.OPERATIONAL),
        (2, NmtState.STOPPED),
    ],
)
def test_life_guarding(behaviour: int, state: NmtState) -> None:
    """Requests that stay away for the life time are an error, handled as 0x1029 says."""
    rig = Rig(guarded_dictionary(behaviour))
    rig.put(0x100C, 100)
    rig.put(0x100D, 3)
    rig.nmt(NmtCommand.START)
    rig.run(5.0)
    assert rig.times(EMCY) == []  # nobody guards it yet
    for _ in range(5):
        guard(rig)
        rig.run(0.29)
    assert rig.times(EMCY) == []
    start = rig.now - 0.29
    rig.run(1.0)
    assert rig.nmt_state == state
    if state is not NmtState.STOPPED:
        assert rig.times(EMCY) == pytest.approx([start + 0.3])
        assert guard(rig)[0] & 0x7F == state
        assert rig.get(0x1001) == 0


def test_enabled_drive_stops_when_its_master_is_gone(rig: Rig) -> None:
    """The drive faults (0x6007 = 1), as when a heartbeat is lost."""
    rig.nmt(NmtCommand.START)
    rig.enable(3)
    guard(rig)
    rig.run(1.0)
    assert rig.state is DriveState.FAULT
    assert rig.get(0x603F) == 0x8130


def test_device_without_the_object_is_silent() -> None:
    """A dictionary without 0x100C knows no guarding."""
    entries = [entry for entry in drive_dictionary() if entry.index not in (0x100C, 0x100D)]
    assert guard(Rig(ObjectDictionary(entries))) == []


def test_heartbeat_fault_silences_guarding_too(rig: Rig) -> None:
    """A device that is to send no heartbeat does not answer its guard either."""
    rig.device.faults.inject(FaultInjection(Fault.HEARTBEAT_STOP, duration=1.0), rig.now)
    assert guard(rig) == []
    rig.run(1.1)
    assert len(guard(rig)) == 1

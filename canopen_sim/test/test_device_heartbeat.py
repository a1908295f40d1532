# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Heartbeats that a simulated device sends, and those that it watches."""

from __future__ import annotations

from itertools import pairwise

from device_rig import NODE_ID, RefusedError, Rig
import pytest

from arm_canopen import DriveState
from arm_canopen.standard import AbortCode, NmtCommand, NmtState

OWN = 0x700 + NODE_ID
EMCY = 0x080 + NODE_ID
MASTER = 1
LOST = bytes.fromhex('30 81 11 01 00 00 00 00')
GONE = bytes(8)


def beat(rig: Rig, node_id: int = MASTER, state: int = 5) -> None:
    """Send a heartbeat of another device."""
    rig.send(0x700 + node_id, bytes((state,)))


def watch(rig: Rig, milliseconds: int, node_id: int = MASTER, subindex: int = 1) -> None:
    """Let the device watch another one."""
    rig.put(0x1016, node_id << 16 | milliseconds, subindex)


@pytest.fixture
def rig() -> Rig:
    """A device in Pre-operational."""
    rig = Rig()
    rig.take()
    return rig


def test_period_is_kept(rig: Rig) -> None:
    """Heartbeats come at exactly the period of 0x1017, the first within one period."""
    start = rig.now
    rig.put(0x1017, 200)
    rig.run(10.0)
    times = rig.times(OWN)
    assert 0.0 < times[0] - start <= 0.2
    steps = [later - earlier for earlier, later in pairwise(times)]
    assert steps == pytest.approx([0.2] * len(steps))
    assert len(times) in (49, 50)


def test_heartbeats_of_devices_are_spread() -> None:
    """Seven devices that are configured at once do not beat at once."""
    rigs = [Rig(node_id=node_id) for node_id in range(2, 9)]
    for rig in rigs:
        rig.put(0x1017, 1000)
        rig.run(1.0)
    firsts = sorted(rig.times(0x700 + rig.node_id)[-1] for rig in rigs)
    gaps = [later - earlier for earlier, later in pairwise(firsts)]
    assert min(gaps) > 0.05


def test_heartbeat_carries_the_nmt_state(rig: Rig) -> None:
    """Each heartbeat has the state at its time, in every state."""
    rig.put(0x1017, 100)
    for command, state in (
        (NmtCommand.START, NmtState.OPERATIONAL),
        (NmtCommand.STOP, NmtState.STOPPED),
        (NmtCommand.ENTER_PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL),
    ):
        rig.nmt(command)
        rig.run(0.1)
        assert rig.take(OWN)[-1] == bytes((state,))


def test_period_zero_ends_it(rig: Rig) -> None:
    """Writing 0 to 0x1017 ends the heartbeats."""
    rig.put(0x1017, 100)
    rig.run(1.0)
    rig.put(0x1017, 0)
    rig.take()
    rig.run(10.0)
    assert rig.take() == []


def test_no_burst_after_a_standstill(rig: Rig) -> None:
    """A process that could not run for a while sends one heartbeat, not all that it missed."""
    rig.put(0x1017, 100)
    rig.now += 10.0
    rig.device.advance(rig.now)
    assert len(rig.take(OWN)) == 1


def test_watch_begins_with_the_first_heartbeat(rig: Rig) -> None:
    """A device that never sent a heartbeat is not lost."""
    watch(rig, 300)
    rig.run(10.0)
    assert rig.take() == []


def test_loss_is_reported_once(rig: Rig) -> None:
    """A lost heartbeat is one EMCY 0x8130; its return is an error reset."""
    watch(rig, 300)
    for _ in range(5):
        beat(rig)
        rig.run(0.29)
    assert rig.take() == []
    rig.run(5.0)
    assert rig.take(EMCY) == [LOST]
    assert rig.get(0x1001) == 0x11
    assert rig.get(0x1003, 1) == 0x8130
    beat(rig)
    assert rig.take(EMCY) == [GONE]
    assert rig.get(0x1001) == 0


def test_loss_is_noticed_on_time(rig: Rig) -> None:
    """The reaction comes when the consumer time is over, neither earlier nor later."""
    watch(rig, 300)
    beat(rig)
    start = rig.now
    rig.run(1.0)
    assert rig.times(EMCY) == pytest.approx([start + 0.3])


@pytest.mark.parametrize(
    ('behaviour', 'state'),
    [(0, NmtState.PRE_OPERATIONAL), (1, NmtState.OPERATIONAL), (2, NmtState.STOPPED)],
)
def test_error_behaviour(rig: Rig, behaviour: int, state: NmtState) -> None:
    """0x1029 says where an Operational device goes when the heartbeat is lost."""
    rig.put(0x1029, behaviour, 1)
    watch(rig, 300)
    rig.nmt(NmtCommand.START)
    beat(rig)
    rig.run(1.0)
    assert rig.nmt_state is state


def test_error_behaviour_spares_pre_operational(rig: Rig) -> None:
    """0x1029 concerns Operational devices only."""
    rig.put(0x1029, 2, 1)
    watch(rig, 300)
    beat(rig)
    rig.run(1.0)
    assert rig.nmt_state is NmtState.PRE_OPERATIONAL


@pytest.mark.parametrize(
    ('option', 'state', 'code'),
    [
        (0, DriveState.OPERATION_ENABLED, 0),
        (1, DriveState.FAULT, 0x8130),
        (2, DriveState.SWITCH_ON_DISABLED, 0),
        (3, DriveState.SWITCH_ON_DISABLED, 0),
    ],
)
def test_drive_stops_without_its_master(
    rig: Rig, option: int, state: DriveState, code: int
) -> None:
    """A moving drive whose master is lost does what 0x6007 says; by default it is a fault."""
    if option != 1:
        rig.put(0x6007, option)
    watch(rig, 300)
    rig.put(0x60FF, 500)
    rig.enable(3)
    beat(rig)
    rig.run(1.0)
    assert rig.state is state
    assert rig.get(0x603F) == code
    assert (rig.get(0x606C) == 0) is (option != 0)


def test_fault_of_a_lost_master_is_latched(rig: Rig) -> None:
    """The master's return does not clear the fault; a fault reset does."""
    watch(rig, 300)
    rig.enable(8)
    beat(rig)
    rig.run(1.0)
    beat(rig)
    states = [rig.state]
    rig.take()
    rig.command(0x80)
    assert rig.take(EMCY) == [GONE]
    states.append(rig.state)
    assert states == [DriveState.FAULT, DriveState.SWITCH_ON_DISABLED]


def test_disabled_drive_has_no_fault_from_a_lost_master(rig: Rig) -> None:
    """A drive without torque needs no reaction."""
    watch(rig, 300)
    beat(rig)
    rig.run(1.0)
    assert rig.state is DriveState.SWITCH_ON_DISABLED


def test_two_watches_of_one_device_are_refused(rig: Rig) -> None:
    """One device cannot have two consumer times (CiA 301, 7.5.2.17)."""
    watch(rig, 300)
    with pytest.raises(RefusedError) as refused:
        watch(rig, 500, subindex=2)
    assert refused.value.code == AbortCode.PARAMETER_INCOMPATIBLE
    watch(rig, 500, subindex=1)
    watch(rig, 500, node_id=2, subindex=2)


def test_several_devices_are_watched(rig: Rig) -> None:
    """The error lasts until the last lost device is back."""
    watch(rig, 300, node_id=1, subindex=1)
    watch(rig, 600, node_id=2, subindex=2)
    beat(rig, 1)
    beat(rig, 2)
    rig.run(2.0)
    assert len(rig.take(EMCY)) == 1
    beat(rig, 1)
    assert rig.take(EMCY) == []
    beat(rig, 2)
    assert rig.take(EMCY) == [GONE]


@pytest.mark.parametrize('entry', [0x0000_012C, 0x0080_012C, 0x0001_0000])
def test_entries_that_name_nobody(rig: Rig, entry: int) -> None:
    """Node id 0, one beyond 127 or time 0 switch an entry off."""
    rig.put(0x1016, entry, 1)
    beat(rig, entry >> 16 & 0x7F)
    rig.run(5.0)
    assert rig.take() == []


@pytest.mark.parametrize('data', [b'', b'\x05\x05', b'\x01'])
def test_what_is_no_heartbeat_keeps_nobody_alive(rig: Rig, data: bytes) -> None:
    """Frames of the wrong length or with an unknown state do not count."""
    watch(rig, 300)
    beat(rig)
    for _ in range(5):
        rig.run(0.1)
        rig.send(0x700 + MASTER, data)
    assert rig.take(EMCY) == [LOST]

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT states of a simulated device, their services, heartbeats both ways, guarding."""

from __future__ import annotations

from itertools import pairwise

from device_rig import NODE_ID, Rig
from drive_samples import drive_dictionary, with_defaults
import pytest

from arm_canopen import DriveState
from canopen_core.can import Frame
from canopen_core.standard import AbortCode, NmtCommand, NmtState, ObjectDictionary
from canopen_sim import Fault

PRE, OP, STOP = NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED
START = NmtCommand.START
BOOT_UP = [b'\x00']

PATHS = {PRE: [], OP: [START], STOP: [NmtCommand.STOP]}
LEADS = {
    START: OP,
    NmtCommand.STOP: STOP,
    NmtCommand.ENTER_PRE_OPERATIONAL: PRE,
    NmtCommand.RESET_NODE: PRE,
    NmtCommand.RESET_COMMUNICATION: PRE,
}
"""Next state by command, from each state (CiA 301, figure 48)."""

RESETS = (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)


def rig_in(state: NmtState) -> Rig:
    """Return a device in a state, with nothing sent yet."""
    rig = Rig()
    for command in PATHS[state]:
        rig.nmt(command)
    assert rig.nmt_state is state
    rig.take()
    return rig


@pytest.mark.parametrize('before', PATHS)
@pytest.mark.parametrize('command', LEADS)
def test_every_state_and_command(before: NmtState, command: NmtCommand) -> None:
    """Each command leads where the standard says; a reset shows in one boot-up frame."""
    for node_id in (0, NODE_ID):
        rig = rig_in(before)
        rig.nmt(command, node_id)
        assert rig.nmt_state is LEADS[command]
        assert rig.take(0x700 + NODE_ID) == (BOOT_UP if command in RESETS else [])


@pytest.mark.parametrize('state', PATHS)
def test_what_is_no_command_is_ignored(state: NmtState) -> None:
    """Commands to others, wrong lengths, unknown specifiers and no plain data frames."""
    rig = rig_in(state)
    for command in NmtCommand:
        rig.nmt(command, NODE_ID + 1)
    for data in (b'', b'\x01', b'\x01\x05\x00', b'\x03\x05', b'\xff\x05'):
        rig.send(0, data)
    for kind in ('is_extended', 'is_remote', 'is_error'):
        for data in (b'\x01\x00', b'\x02\x00'):
            rig.device.receive(Frame(0, data, **{kind: True}), rig.now)
    assert rig.nmt_state is state
    assert rig.take() == []


def test_commands_during_initialisation() -> None:
    """Start is not obeyed, a reset prolongs it; there is one boot-up frame."""
    rig = Rig(boot_time=0.5)
    rig.nmt(START)
    rig.run(0.4)
    rig.nmt(NmtCommand.RESET_NODE)
    rig.run(0.4)
    assert rig.take() == []
    rig.run(0.2)
    assert rig.take() == BOOT_UP
    assert rig.nmt_state is PRE


def test_services_of_each_state() -> None:
    """SDO is served but in Stopped, PDOs only in Operational (CiA 301, table 46)."""
    rig = rig_in(PRE)
    rig.put(0x1802, 1, 2)
    for command, sdo, word, tpdos in (
        (NmtCommand.ENTER_PRE_OPERATIONAL, True, 0, 0),
        (START, True, 6, 2),  # TPDO 3 and 4
        (NmtCommand.STOP, False, 6, 0),
    ):
        rig.nmt(command)
        rig.take()
        assert (rig.raw_sdo(b'\x40\x00\x10\x00\x00\x00\x00\x00') is not None) is sdo
        rig.sync()
        assert len(rig.take()) == tpdos
        rig.send(0x200 + NODE_ID, b'\x06\x00' if sdo else b'\x00\x00')
        assert rig.device.store.integer(0x6040).value == word
    rig.take()
    rig.run(1.0)
    assert rig.take() == []


@pytest.mark.parametrize(('command', 'velocity'), [(RESETS[0], 1000), (RESETS[1], 77)])
def test_a_reset_restores_defaults(command: NmtCommand, velocity: int) -> None:
    """Of the node all objects, of communication 0x1000 to 0x1FFF only; nothing else goes on."""
    rig = rig_in(OP)
    rig.put(0x6081, 77)
    rig.put(0x1017, 500)
    rig.raw_sdo(b'\x40\x08\x10\x00\x00\x00\x00\x00')  # of a transfer
    rig.nmt(command)
    rig.take()
    rig.run(5.0)
    assert rig.take() == []
    assert (rig.get(0x6081), rig.get(0x1017)) == (velocity, 0)


def test_device_without_any_object_lives() -> None:
    """A device without any object boots and executes NMT commands."""
    rig = Rig(ObjectDictionary([]))
    assert rig.take(0x700 + NODE_ID) == BOOT_UP
    rig.nmt(START)
    rig.sync()
    rig.run(1.0)
    assert rig.nmt_state is OP
    assert rig.device.drive is None


OWN = 0x700 + NODE_ID
EMCY = 0x080 + NODE_ID
MASTER = 1
LOST = bytes.fromhex('30 81 11 01 00 00 00 00')
GONE = bytes(8)


def beat(rig: Rig, node_id: int = MASTER, state: int = 5) -> None:
    """Send a heartbeat of another device."""
    rig.send(0x700 + node_id, bytes((state,)))


def watch(rig: Rig, milliseconds: int, node_id: int = MASTER, subindex: int = 1) -> None:
    """Configure the device to watch another one."""
    rig.put(0x1016, node_id << 16 | milliseconds, subindex)


@pytest.fixture
def rig() -> Rig:
    """A device in Pre-operational."""
    rig = Rig()
    rig.take()
    return rig


def test_period_is_kept(rig: Rig) -> None:
    """Heartbeats come at exactly the period of 0x1017, the first within one; 0 ends them."""
    start = rig.now
    rig.put(0x1017, 200)
    rig.run(10.0)
    times = rig.times(OWN)
    assert 0.0 < times[0] - start <= 0.2
    steps = [later - earlier for earlier, later in pairwise(times)]
    assert steps == pytest.approx([0.2] * len(steps))
    assert len(times) in (49, 50)
    rig.put(0x1017, 0)
    rig.take()
    rig.run(10.0)
    assert rig.take() == []


def test_heartbeats_of_devices_are_spread() -> None:
    """Seven devices that are configured at once do not beat at once."""
    rigs = [Rig(node_id=node_id) for node_id in range(2, 9)]
    for rig in rigs:
        rig.put(0x1017, 1000)
        rig.run(1.0)
    firsts = sorted(rig.times(0x700 + rig.node_id)[-1] for rig in rigs)
    gaps = [later - earlier for earlier, later in pairwise(firsts)]
    assert min(gaps) > 0.05


def test_no_burst_after_a_standstill(rig: Rig) -> None:
    """A process that could not run for a while sends one heartbeat, not all that it missed."""
    rig.put(0x1017, 100)
    rig.now += 10.0
    rig.device.advance(rig.now)
    assert len(rig.take(OWN)) == 1


def test_loss_is_reported_once(rig: Rig) -> None:
    """One EMCY 0x8130, on time, of a device that has sent one; its return is an error reset."""
    watch(rig, 300)
    rig.run(10.0)
    assert rig.take() == []
    for _ in range(5):
        beat(rig)
        rig.run(0.29)
    assert rig.take() == []
    start = rig.now - 0.29
    rig.run(5.0)
    assert rig.times(EMCY) == pytest.approx([start + 0.3])
    assert rig.take(EMCY) == [LOST]
    assert rig.get(0x1001) == 0x11
    assert rig.get(0x1003, 1) == 0x8130
    beat(rig)
    assert rig.take(EMCY) == [GONE]
    assert rig.get(0x1001) == 0


def test_drive_stops_without_its_master() -> None:
    """A moving drive whose master is lost does what 0x6007 says; by default it is a fault."""
    for option, state, code in (
        (0, DriveState.OPERATION_ENABLED, 0),
        (1, DriveState.FAULT, 0x8130),
        (2, DriveState.SWITCH_ON_DISABLED, 0),
        (3, DriveState.SWITCH_ON_DISABLED, 0),
    ):
        rig = Rig()
        if option != 1:
            rig.put(0x6007, option)
        watch(rig, 300)
        rig.put(0x60FF, 500)
        rig.enable(3)
        beat(rig)
        rig.run(1.0)
        assert (rig.state, rig.get(0x603F)) == (state, code), option
        assert (rig.get(0x606C) == 0) is (option != 0), option


@pytest.mark.parametrize('back', [True, False], ids=['master back', 'master lost'])
def test_a_fault_of_a_lost_master_is_latched(rig: Rig, *, back: bool) -> None:
    """Its return does not clear the fault, a fault reset does; that does not end the error."""
    watch(rig, 300)
    rig.enable(8)
    beat(rig)
    rig.run(1.0)
    if back:
        beat(rig)
    states = [rig.state]
    rig.take()
    rig.command(0x80)
    assert rig.take(EMCY) == [GONE] * back
    states.append(rig.state)
    assert states == [DriveState.FAULT, DriveState.SWITCH_ON_DISABLED]
    beat(rig)
    assert rig.take(EMCY) == [GONE] * (not back)
    rig.run(1.0)  # without torque there is nothing to stop
    assert rig.state is DriveState.SWITCH_ON_DISABLED


def test_several_devices_are_watched(rig: Rig) -> None:
    """Each once (CiA 301, 7.5.2.17); the error lasts until the last lost device is back."""
    watch(rig, 300, node_id=1, subindex=1)
    assert rig.refused(0x1016, 1 << 16 | 500, 2) == AbortCode.PARAMETER_INCOMPATIBLE
    watch(rig, 500, node_id=1, subindex=1)
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
def test_entries_without_a_device(rig: Rig, entry: int) -> None:
    """Node id 0, one beyond 127 or time 0 switch an entry off."""
    rig.put(0x1016, entry, 1)
    beat(rig, entry >> 16 & 0x7F)
    rig.run(5.0)
    assert rig.take() == []


@pytest.mark.parametrize('data', [b'', b'\x05\x05', b'\x01'])
def test_other_frames_are_no_heartbeats(rig: Rig, data: bytes) -> None:
    """Frames of the wrong length or with an unknown state do not count."""
    watch(rig, 300)
    beat(rig)
    for _ in range(5):
        rig.run(0.1)
        rig.send(0x700 + MASTER, data)
    assert rig.take(EMCY) == [LOST]


def guarded(behaviour: int = 0) -> Rig:
    """Return a drive in Pre-operational with a life time of 0.3 s."""
    defaults = {(0x100C, 0): 100, (0x100D, 0): 3, (0x1029, 1): behaviour}
    return Rig(with_defaults(drive_dictionary(), defaults))


def guard(rig: Rig) -> list[int]:
    """Request the state and return the answers."""
    rig.take()
    rig.device.receive(Frame(OWN, is_remote=True), rig.now)
    return [data[0] for data in rig.take(OWN)]


def test_guarding() -> None:
    """Answers have the state and the other toggle bit; a device with heartbeats is not guarded."""
    rig = guarded()
    assert [guard(rig) for _ in range(3)] == [[0x7F], [0xFF], [0x7F]]
    rig.nmt(NmtCommand.START)
    assert guard(rig) == [0x85]
    rig.nmt(NmtCommand.STOP)
    assert guard(rig) == [0x04]
    rig.nmt(NmtCommand.RESET_COMMUNICATION)
    assert guard(rig) == [0x7F]
    rig.put(0x1017, 100)
    assert guard(rig) == []
    rig.put(0x1017, 0)
    assert guard(rig) == [0xFF]
    rig.inject(Fault.HEARTBEAT_STOP, duration=1.0)
    assert guard(rig) == []
    rig.run(1.1)
    assert len(guard(rig)) == 1
    entries = [entry for entry in drive_dictionary() if entry.index not in (0x100C, 0x100D)]
    assert guard(Rig(ObjectDictionary(entries))) == []


@pytest.mark.parametrize('kind', ['heartbeat', 'guarding'])
@pytest.mark.parametrize(
    ('before', 'behaviour', 'state'),
    [
        (NmtState.OPERATIONAL, 0, NmtState.PRE_OPERATIONAL),
        (NmtState.OPERATIONAL, 1, NmtState.OPERATIONAL),
        (NmtState.OPERATIONAL, 2, NmtState.STOPPED),
        (NmtState.PRE_OPERATIONAL, 2, NmtState.PRE_OPERATIONAL),  # concerns Operational only
    ],
)
def test_a_loss_is_handled_as_0x1029_says(
    kind: str, before: NmtState, behaviour: int, state: NmtState
) -> None:
    """A heartbeat, or the requests of a guard, that stay away for their time."""
    rig = guarded(behaviour)
    if kind == 'heartbeat':
        watch(rig, 300)
    if before is NmtState.OPERATIONAL:
        rig.nmt(NmtCommand.START)
    rig.run(5.0)
    assert rig.times(EMCY) == []  # no master yet
    for _ in range(5):
        beat(rig) if kind == 'heartbeat' else guard(rig)
        rig.run(0.29)
    assert rig.times(EMCY) == []
    start = rig.now - 0.29
    rig.run(1.0)
    assert rig.nmt_state is state
    if state is not NmtState.STOPPED:
        assert rig.times(EMCY) == pytest.approx([start + 0.3])
        beat(rig) if kind == 'heartbeat' else guard(rig)
        assert rig.get(0x1001) == 0

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT state machine of a simulated device, and which services each state offers."""

from __future__ import annotations

from device_rig import NODE_ID, Rig
import pytest

from canopen_core.can import Frame
from canopen_core.standard import NmtCommand, NmtState, ObjectDictionary

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
def test_commands_to_others_are_ignored(state: NmtState) -> None:
    """A device executes commands for its own id and 0, and nothing else."""
    rig = rig_in(state)
    for command in NmtCommand:
        rig.nmt(command, NODE_ID + 1)
    assert rig.nmt_state is state
    assert rig.take() == []


@pytest.mark.parametrize(
    'frame',
    [
        *(Frame(0, data) for data in (b'', b'\x01', b'\x01\x05\x00', b'\x03\x05', b'\xff\x05')),
        Frame(0, b'\x01\x00', is_extended=True),
        Frame(0, b'\x01\x00', is_remote=True),
        Frame(0, b'\x01\x00', is_error=True),
    ],
)
def test_what_is_no_command_is_ignored(frame: Frame) -> None:
    """Wrong lengths, unknown command specifiers and frames that are no plain data frames."""
    rig = rig_in(PRE)
    rig.device.receive(frame, rig.now)
    assert rig.nmt_state is PRE
    assert rig.take() == []


def test_first_frame_is_boot_up() -> None:
    """A device says that it is there when its start is over, and not before."""
    rig = Rig(boot_time=0.5, power=False)
    rig.device.advance(rig.now)
    rig.run(0.499)
    assert rig.nmt_state is NmtState.BOOT_UP
    assert rig.take() == []
    rig.run(0.002)
    assert rig.nmt_state is PRE
    assert rig.take(0x700 + NODE_ID) == BOOT_UP


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


def answers_sdo(rig: Rig) -> bool:
    """Return whether the device serves SDOs."""
    return rig.raw_sdo(b'\x40\x00\x10\x00\x00\x00\x00\x00') is not None


def test_services_of_each_state() -> None:
    """SDO is served but in Stopped, PDOs only in Operational (CiA 301, table 46)."""
    rig = rig_in(PRE)
    rig.put(0x1802, 1, 2)
    assert answers_sdo(rig)
    rig.sync()
    assert rig.take() == []
    rig.send(0x200 + NODE_ID, b'\x06\x00')
    assert rig.get(0x6040) == 0

    rig.nmt(START)
    rig.take()
    assert answers_sdo(rig)
    rig.sync()
    assert len(rig.take(0x380 + NODE_ID)) == 1
    rig.send(0x200 + NODE_ID, b'\x06\x00')
    assert rig.get(0x6040) == 6

    rig.nmt(NmtCommand.STOP)
    rig.take()
    assert not answers_sdo(rig)
    rig.sync()
    rig.send(0x200 + NODE_ID, b'\x00\x00')
    rig.run(1.0)
    assert rig.take() == []


@pytest.mark.parametrize(('command', 'velocity'), [(RESETS[0], 1000), (RESETS[1], 77)])
def test_a_reset_restores_defaults(command: NmtCommand, velocity: int) -> None:
    """Of the node all objects, of communication 0x1000 to 0x1FFF only."""
    rig = rig_in(OP)
    rig.put(0x6081, 77)
    rig.put(0x1017, 500)
    rig.nmt(command)
    assert (rig.get(0x6081), rig.get(0x1017)) == (velocity, 0)


def test_reset_ends_a_transfer_and_the_heartbeat() -> None:
    """Nothing of the time before a reset goes on after it."""
    rig = rig_in(PRE)
    rig.put(0x1017, 100)
    rig.raw_sdo(b'\x40\x08\x10\x00\x00\x00\x00\x00')
    rig.nmt(NmtCommand.RESET_COMMUNICATION)
    rig.take()
    rig.run(5.0)
    assert rig.take() == []


def test_device_without_any_object_lives() -> None:
    """A device without any object boots and executes NMT commands."""
    rig = Rig(ObjectDictionary([]))
    assert rig.take(0x700 + NODE_ID) == BOOT_UP
    rig.nmt(START)
    rig.sync()
    rig.run(1.0)
    assert rig.nmt_state is OP
    assert rig.device.drive is None

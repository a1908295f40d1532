# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What happens to a moving drive when the network or a fault takes it away from its master."""

from __future__ import annotations

from device_rig import ENABLE, NODE_ID, Rig, SHUTDOWN, SWITCH_ON
import pytest

from arm_canopen import DriveState
from arm_canopen.standard import NmtCommand, NmtState

MODES = (1, 3, 7, 8)
LOSSES = (NmtCommand.STOP, NmtCommand.RESET_COMMUNICATION)


def moving(mode: int = 3) -> Rig:
    """Return an Operational drive that moves at 500 inc/s or so, in any mode."""
    rig = Rig()
    rig.nmt(NmtCommand.START)
    rig.put(0x6081, 500)
    rig.put(0x60FF, 500)
    rig.put(0x60C2, 250, 1)
    rig.put(0x60C2, -2, 2)  # a line of 2.5 s
    rig.enable(mode)
    rig.command(ENABLE)
    rig.put(0x607A, 1250)
    rig.command(ENABLE | 0x10)
    rig.put(0x60C1, 1250, 1)
    rig.run(0.5)
    assert rig.velocity == pytest.approx(500, abs=5)
    return rig


def still(rig: Rig) -> bool:
    """Return whether the motor stands, and goes on standing."""
    rig.run(1.0)
    position = rig.position
    rig.run(5.0)
    return rig.position == position


@pytest.mark.parametrize('mode', MODES)
@pytest.mark.parametrize('loss', LOSSES)
def test_drive_stops_when_it_is_taken_off_the_network(loss: NmtCommand, mode: int) -> None:
    """NMT stop and reset of communication stop a moving drive, in a fault that can be seen."""
    rig = moving(mode)
    rig.nmt(loss)
    assert still(rig)
    rig.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    assert rig.state is DriveState.FAULT
    assert rig.get(0x603F) == 0x8130
    assert rig.get(0x1001) == 0x11


def test_option_to_go_on() -> None:
    """With 0x6007 = 0 a drive finishes its move also when it is Stopped."""
    rig = moving(1)
    rig.put(0x6007, 0)
    rig.nmt(NmtCommand.STOP)
    rig.run(5.0)
    assert rig.position == pytest.approx(1250)


@pytest.mark.parametrize('mode', MODES)
def test_reset_in_motion(mode: int) -> None:
    """A reset of the node takes the torque away; the motor runs out and is not started again."""
    rig = moving(mode)
    rig.nmt(NmtCommand.RESET_NODE)
    assert rig.nmt_state is NmtState.PRE_OPERATIONAL
    assert rig.state is DriveState.SWITCH_ON_DISABLED
    assert rig.velocity > 0
    assert still(rig)
    stopped = rig.get(0x6064)
    rig.command(SHUTDOWN, SWITCH_ON, ENABLE)
    assert still(rig)
    assert rig.get(0x6064) == stopped


@pytest.mark.parametrize('mode', MODES)
def test_nothing_moves_by_itself_after_a_fault(mode: int) -> None:
    """Fault, reset and enabling again leave the drive where the fault has stopped it."""
    rig = moving(mode)
    rig.drive.raise_fault(0x4310, rig.now)
    rig.put(0x60FF, 0)
    assert still(rig)
    stopped = rig.get(0x6064)
    rig.command(0x00, 0x80, SHUTDOWN, SWITCH_ON, ENABLE)
    assert rig.state is DriveState.OPERATION_ENABLED
    assert still(rig)
    assert rig.get(0x6064) == stopped


@pytest.mark.parametrize('mode', MODES)
def test_pre_operational_is_no_loss(mode: int) -> None:
    """A drive in Pre-operational goes on with its move: its master speaks SDO to it."""
    rig = moving(mode)
    rig.nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    rig.run(0.1)
    assert rig.state is DriveState.OPERATION_ENABLED
    assert rig.velocity == pytest.approx(500, abs=5)


def test_fault_shows_in_the_pdo_at_once() -> None:
    """An event-driven statusword shows the fault without waiting for SYNC."""
    rig = moving(1)
    rig.take()
    rig.drive.raise_fault(0x2310, rig.now)
    rig.run(1.0)
    words = [int.from_bytes(data, 'little') & 0x4F for data in rig.take(0x180 + NODE_ID)]
    assert words == [0x0F, 0x08]


def test_second_fault_keeps_the_state() -> None:
    """A fault during the reaction to another one is reported, and the ramp goes on."""
    rig = moving(3)
    rig.drive.raise_fault(0x2310, rig.now)
    rig.run(0.005)
    rig.drive.raise_fault(0x4310, rig.now)
    assert rig.drive.state is DriveState.FAULT_REACTION_ACTIVE
    assert still(rig)
    assert rig.drive.faults == {0x2310, 0x4310}
    assert rig.get(0x603F) == 0x4310

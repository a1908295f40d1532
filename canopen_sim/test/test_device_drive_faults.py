# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults of the simulated drive with a physical cause, its load and its stops."""

from __future__ import annotations

from device_rig import EDS, ENABLE, FAULT_RESET, Rig, SHUTDOWN, SWITCH_ON
import pytest

from arm_canopen import DriveState
from arm_canopen.config import load_eds
from canopen_sim import Fault, FaultInjection

FAULTS = [fault for fault in Fault if fault.value.code]


@pytest.mark.parametrize('mode', [1, 2, 3, 4, 6, 7, 8, 9, 10])
@pytest.mark.parametrize('fault', FAULTS)
def test_fault_has_its_code_and_stays_while_its_cause_does(fault: Fault, mode: int) -> None:
    """In each mode: EMCY and 0x603F show the code; a reset helps after the cause is gone only."""
    rig = Rig()
    rig.enable(mode)
    rig.take()
    rig.inject(fault, duration=9.0)
    rig.run(0.5)
    assert rig.state is DriveState.FAULT
    assert rig.get(0x603F) == fault.value.code
    assert [data[:2] for data in rig.take(0x080 + rig.node_id)] == [
        fault.value.code.to_bytes(2, 'little')
    ]
    rig.command(FAULT_RESET, 0)
    assert rig.state is DriveState.FAULT
    rig.cure(fault)
    rig.command(FAULT_RESET, 0)
    assert rig.get(0x6041) & 0x4F == 0x40
    assert rig.get(0x603F) == 0


def test_lost_encoder_leaves_no_ramp() -> None:
    """A fault without torque passes the fault reaction by; one with torque ramps down first."""
    for fault, expected in (
        (Fault.ENCODER_LOSS, DriveState.FAULT),
        (Fault.OVER_TEMPERATURE, DriveState.FAULT_REACTION_ACTIVE),
    ):
        rig = Rig()
        rig.put(0x60FF, 2000)
        rig.enable(3)
        rig.run(1.0)
        rig.inject(fault)
        assert rig.state is expected


def test_safe_torque_off_is_no_fault() -> None:
    """STO takes voltage and torque away; the drive goes on only after it is high again."""
    rig = Rig()
    rig.put(0x60FF, 2000)
    rig.enable(3)
    rig.run(1.0)
    rig.inject(Fault.STO)
    assert rig.state is DriveState.SWITCH_ON_DISABLED
    assert not rig.statusword & 0x10
    assert rig.get(0x6079) == 0
    rig.run(1.0)
    assert rig.velocity == 0.0
    rig.command(SHUTDOWN, SWITCH_ON, ENABLE)
    assert rig.get(0x6041) & 0x6F == 0x21
    rig.cure(Fault.STO)
    assert rig.get(0x6041) & 0x6F == 0x27


@pytest.mark.parametrize('mode', [1, 3, 8, 9])
def test_stop_in_the_way_makes_a_following_error(mode: int) -> None:
    """An axis that a stop holds does not pass it, and faults with 0x8611."""
    rig = Rig()
    rig.drive.block(500.0, rig.now)
    rig.enable(mode)
    rig.put(0x607A, 3000)
    rig.put(0x60FF, 1000)
    rig.command(ENABLE | 0x10)
    highest = 0.0
    for _ in range(300):
        rig.run(0.01)
        highest = max(highest, rig.position)
    assert highest == pytest.approx(500.0)
    assert rig.get(0x603F) == 0x8611
    assert rig.statusword & 0x2000
    assert rig.state is DriveState.FAULT


def test_stop_holds_a_torque() -> None:
    """A torque against a stop is no fault; the motor rests there and moves when it is gone."""
    rig = Rig()
    rig.drive.block(100.0, rig.now)
    rig.enable(4)
    rig.put(0x6071, 200)
    rig.run(2.0)
    assert rig.position == pytest.approx(100.0)
    assert rig.state is DriveState.OPERATION_ENABLED
    rig.drive.release(rig.now)
    rig.run(0.5)
    assert rig.position > 200.0


@pytest.mark.parametrize('mode', [4, 10])
def test_load_pulls_unless_the_torque_holds_it(mode: int) -> None:
    """With the torque of the load the axis stays; without, it goes where gravity pulls."""
    rig = Rig()
    rig.drive.set_load(300.0, rig.now)
    rig.put(0x6071, 300)
    rig.enable(mode)
    rig.put(0x6071, 300)
    rig.run(1.0)
    assert rig.position == pytest.approx(0.0, abs=1.0)
    rig.put(0x6071, 0)
    rig.run(0.5)
    assert rig.position < -50.0
    assert rig.velocity < 0.0


def test_position_loop_shows_the_torque_of_a_load() -> None:
    """Held in position, the torque is that of the load."""
    rig = Rig()
    rig.enable(8)
    rig.drive.set_load(-250.0, rig.now)
    assert rig.get(0x6077) == -250


def test_axes_are_apart_and_share_their_errors() -> None:
    """Two axes have objects of their own; EMCY and 0x1001 are the device's."""
    rig = Rig(load_eds(EDS.with_name('cia402_two_axes.eds')).dictionary)
    rig.put(0x6860, 3)
    rig.put(0x68FF, 1000)
    for word in (SHUTDOWN, SWITCH_ON, ENABLE):
        rig.put(0x6840, word)
    rig.run(1.0)
    assert rig.get(0x6864) == pytest.approx(950, abs=10)
    assert (rig.get(0x6064), rig.state) == (0, DriveState.SWITCH_ON_DISABLED)
    first, second = rig.device.drives
    rig.take()
    for drive in (first, second):
        drive.inject(FaultInjection(Fault.OVER_TEMPERATURE), rig.now)
    rig.run(0.5)
    assert (rig.get(0x603F), rig.get(0x683F)) == (0x4310, 0x4310)
    rig.command(FAULT_RESET, 0)
    assert rig.get(0x1001) & 0x08
    rig.put(0x6840, FAULT_RESET)
    assert rig.get(0x1001) == 0
    assert len(rig.take(0x080 + rig.node_id)) == 2

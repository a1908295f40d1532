# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An axis keeps its power until it stands, whatever ends its operation and whoever comes next."""

from __future__ import annotations

from drive_samples import PERIOD, SCALE
from moving_drive import JOINT, MovingDrive, RAMP, STANDING
import pytest

from arm_canopen import DriveState

pytestmark = pytest.mark.slow

QUICK_STOP_ON_LOSS = (0x6007, 0, 3)  # the drive makes a quick stop when it misses the master
SLOW_DISABLE = (0x6084, 0, round(SCALE / RAMP))  # [inc/s^2]: the ramp of 0x605C = 1


def assert_braked(moving: MovingDrive, *states: DriveState) -> None:
    """The drive went through these states, and had power at speed."""
    assert moving.states == [DriveState.OPERATION_ENABLED, *states]
    assert moving.fastest < STANDING


def test_a_drive_that_makes_a_quick_stop_by_itself_brakes_to_the_end() -> None:
    """It is not enabled again when the cause goes away; what may have been the cause is named."""
    moving = MovingDrive(2, QUICK_STOP_ON_LOSS)
    moving.device.connection_lost(moving.net.now)
    moving.run(RAMP + 1.0)
    assert_braked(moving, DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED)
    assert len(moving.errors) == 1, moving.errors
    assert 'left Operation enabled by itself' in moving.errors[0]
    assert 'is it at a limit switch' in moving.errors[0]
    moving.net.do(JOINT, 'enable')
    assert moving.device.state is DriveState.OPERATION_ENABLED


def test_a_drive_that_holds_after_its_own_quick_stop_goes_on_holding() -> None:
    """With 0x605A = 6 a load without brake would drop; `disable` takes the power away."""
    moving = MovingDrive(6, QUICK_STOP_ON_LOSS)
    moving.device.connection_lost(moving.net.now)
    moving.run(RAMP + 1.0)
    assert_braked(moving, DriveState.QUICK_STOP_ACTIVE)
    moving.net.do(JOINT, 'disable', preempt=True)
    assert moving.device.state is DriveState.SWITCH_ON_DISABLED


@pytest.mark.parametrize('verb', ['halt', 'quick_stop', 'disable', 'shutdown'])
@pytest.mark.parametrize('first', ['disable', 'quick_stop'])
@pytest.mark.parametrize('option', [2, 6])
def test_a_stop_during_a_stop_takes_no_power_from_what_still_moves(
    option: int, first: str, verb: str
) -> None:
    """A second person may press another button while the axis brakes."""
    moving = MovingDrive(option, SLOW_DISABLE)
    moving.net.begin(JOINT, first, preempt=True)
    moving.run(3 * PERIOD)
    second = moving.net.begin(JOINT, verb, preempt=True)
    moving.net.run_until(lambda: second.done)
    second.result()
    if verb in {'disable', 'shutdown'}:
        assert moving.device.state in {DriveState.SWITCH_ON_DISABLED, DriveState.SWITCHED_ON}
    moving.run(RAMP + 1.0)
    assert moving.fastest < STANDING
    assert abs(moving.device.velocity) / SCALE < STANDING
    holds = option == 6 and first == 'quick_stop' and verb in {'halt', 'quick_stop'}
    assert (moving.device.state is DriveState.QUICK_STOP_ACTIVE) is holds
    assert moving.device.state is not DriveState.OPERATION_ENABLED


def test_a_disable_lasts_as_long_as_its_ramp() -> None:
    """1 rad/s at 0.15 rad/s^2 takes 6.7 s, longer than a change of state without ramp may."""
    moving = MovingDrive(2, (0x6084, 0, 1_500))
    disabling = moving.net.begin(JOINT, 'disable', preempt=True)
    moving.run(8.0)
    disabling.result()
    assert_braked(moving, DriveState.SWITCHED_ON)


def test_a_disable_whose_ramp_does_not_end_becomes_a_quick_stop() -> None:
    """The drive brakes slower than its objects say; the power goes when it stands."""
    moving = MovingDrive(2, SLOW_DISABLE)
    moving.net.devices[JOINT].store.find(0x6084).value = 500
    disabling = moving.net.begin(JOINT, 'disable', preempt=True)
    moving.run(12.0)
    assert 'Switch on disabled' in disabling.result()
    assert_braked(moving, DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED)


@pytest.mark.parametrize('option', [2, 6])
def test_a_new_master_waits_for_the_quick_stop_that_it_finds(option: int) -> None:
    """The drive has begun it at the loss of the master before."""
    moving = MovingDrive(option, QUICK_STOP_ON_LOSS, kept_alive=True)
    moving.device.connection_lost(moving.net.now)
    moving.net.replace_master()
    moving.net.start()
    moving.run(RAMP + 3.0)
    assert_braked(moving, DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED)

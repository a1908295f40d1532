# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device that is lost in motion: its axis is braked before anything takes its power away."""

from __future__ import annotations

from moving_drive import JOINT, MovingDrive, NODE_ID, RAMP, STANDING
import pytest

from arm_canopen.master.events import Severity
from arm_canopen.standard.drive import DriveState
from arm_canopen.standard.nmt import NmtCommand

pytestmark = pytest.mark.slow

OPTIONS = pytest.mark.parametrize('option', [2, 6], ids=['605A=2', '605A=6'])


def lose(moving: MovingDrive, *cob_ids: int) -> None:
    """Lose all frames of some identifiers of the device from now on."""
    moving.net.wire.loses = lambda sender, frame: frame.can_id in cob_ids


def nmt_commands(moving: MovingDrive) -> list[int]:
    """Return the NMT commands since it moved."""
    return [data[0] for data in moving.net.frames(0x000, since=moving.began)]


def test_a_late_heartbeat_stops_nothing_while_tpdos_come() -> None:
    """It is reported, and the device is neither lost nor configured anew."""
    moving = MovingDrive()
    lose(moving, 0x700 + NODE_ID)
    moving.run(0.45)  # of a consumer time of 0.3
    lose(moving)
    moving.run(1.0)
    assert moving.states == [DriveState.OPERATION_ENABLED]
    assert nmt_commands(moving) == []
    assert moving.errors == []
    late = [text for text in moving.net.reported(Severity.WARNING) if 'heartbeat lost' in text]
    assert len(late) == 1
    assert 'but its TPDOs come' in late[0]


@OPTIONS
def test_a_heartbeat_that_is_gone_brakes_the_axis_before_its_device_is_configured(
    option: int,
) -> None:
    """Quick stop, rest, disable, and only then Pre-operational."""
    moving = MovingDrive(option)
    lose(moving, 0x700 + NODE_ID)
    moving.run(RAMP)
    assert nmt_commands(moving) == []
    moving.run(RAMP)
    assert moving.states == [
        DriveState.OPERATION_ENABLED,
        DriveState.QUICK_STOP_ACTIVE,
        DriveState.SWITCH_ON_DISABLED,
    ]
    assert moving.fastest < STANDING
    assert nmt_commands(moving)[:1] == [NmtCommand.ENTER_PRE_OPERATIONAL]
    assert [text for text in moving.errors if 'stopped: heartbeat lost' in text]
    lose(moving)
    moving.net.run_until(moving.net.all_ready)
    assert moving.net.drives[JOINT].failure == ''

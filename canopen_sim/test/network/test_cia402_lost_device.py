# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A device that is lost in motion: its axis is braked before anything takes its power away."""

from __future__ import annotations

from drive_samples import PERIOD, SCALE
from moving_drive import JOINT, MovingDrive, NODE_ID, RAMP, STANDING
import pytest

from arm_canopen import DriveError, DriveState, EventKind, OperationMode, Severity
from arm_canopen.can import Frame
from arm_canopen.cia402.stop_sequence import SHUTDOWN_MAX
from arm_canopen.config.model.drive import RecoveryPolicy
from arm_canopen.library.canopen_master import leave_device
from arm_canopen.standard import NmtCommand

pytestmark = pytest.mark.slow

OPTIONS = pytest.mark.parametrize('option', [2, 6], ids=['605A=2', '605A=6'])


def lose(moving: MovingDrive, *cob_ids: int) -> None:
    """Lose all frames of some identifiers of the device from now on."""
    moving.net.wire.loses = lambda sender, frame: frame.can_id in cob_ids


def turning(option: int, *writes: tuple[int, int, int]) -> MovingDrive:
    """Return a drive that turns on without set-points, whatever becomes of its master."""
    return MovingDrive(option, (0x6007, 0, 0), *writes, mode=OperationMode.PROFILE_VELOCITY)


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
    assert all(event.kind is not EventKind.HEARTBEAT_LOST for event in moving.net.events)
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
    assert [text for text in moving.errors if 'stopping: heartbeat lost' in text]
    lose(moving)
    moving.net.run_until(moving.net.all_ready)
    assert moving.net.drives[JOINT].failure == ''


@pytest.mark.parametrize('policy', list(RecoveryPolicy), ids=lambda policy: policy.value)
@pytest.mark.parametrize('returns', [RAMP / 2, 3 * RAMP], ids=['while it brakes', 'after it'])
def test_a_drive_without_heartbeat_is_given_back_by_policy(
    returns: float, policy: RecoveryPolicy
) -> None:
    """Its device is lost and booted again, also when the heartbeat comes while it brakes."""
    moving = MovingDrive(recovery=policy)
    lose(moving, 0x700 + NODE_ID)
    while moving.device.state is DriveState.OPERATION_ENABLED:
        moving.run(PERIOD)
    moving.run(returns)
    lose(moving)
    moving.net.run_until(lambda: not moving.net.network.nodes[JOINT].operational)
    moving.net.run_until(moving.net.all_ready)
    drive = moving.net.drives[JOINT]
    assert drive.failure == ''
    moving.net.run(1.0)
    assert drive.control.accepts_targets is (policy is RecoveryPolicy.AUTO)
    assert abs(moving.device.velocity) / SCALE < STANDING


def test_a_device_that_is_commanded_away_while_it_brakes_is_left_there() -> None:
    """Its heartbeat is back, so it is not booted, and its drive is enabled no more."""
    moving = MovingDrive(recovery=RecoveryPolicy.AUTO)
    net = moving.net
    lose(moving, 0x700 + NODE_ID)
    while moving.device.state is DriveState.OPERATION_ENABLED:
        moving.run(PERIOD)
    lose(moving)
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)
    moving.run(3.0 * RAMP)
    assert nmt_commands(moving) == [NmtCommand.ENTER_PRE_OPERATIONAL]
    net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    net.run(3.0)
    assert net.all_ready()
    assert moving.device.state is DriveState.SWITCH_ON_DISABLED


@OPTIONS
@pytest.mark.parametrize('begins', ['NMT', 'silence'])
def test_an_axis_that_turns_when_its_device_starts_is_braked(begins: str, option: int) -> None:
    """The first controlword that it gets is no 0, which would let it coast."""
    moving = turning(option)
    if begins == 'NMT':
        moving.net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)
        moving.run(0.5)
        moving.net.network.send_nmt(NmtCommand.START, NODE_ID)
    else:
        moving.net.wire.loses = lambda sender, frame: True
        moving.run(0.5)
        lose(moving)
    moving.net.run_until(lambda: not moving.net.network.nodes[JOINT].operational)
    moving.run(RAMP + 3.0)
    assert moving.fastest < STANDING
    assert moving.states[1:] == [DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED]
    moving.net.run_until(moving.net.all_ready)
    moving.net.do(JOINT, 'enable')


@pytest.mark.parametrize('lost', [False, True])
def test_a_device_watches_the_master_until_its_motor_was_seen_to_stand(*, lost: bool) -> None:
    """Pre-operational it is stopped by SDO first; where none arrives, it goes on to watch."""
    moving = turning(6)
    net, node = moving.net, moving.net.network.nodes[JOINT]
    node.watch_slot = 1
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)
    moving.run(0.3)
    lose(moving, *([0x600 + NODE_ID] if lost else []))
    assert abs(moving.device.velocity) / SCALE == pytest.approx(1.0)

    def unwatched() -> bool:
        requests = net.frames(0x600 + NODE_ID, since=moving.began)
        return any(data[1:4] == b'\x16\x10\x01' for data in requests)

    scheduler = net.network.scheduler
    leaving = scheduler.spawn(leave_device(node, [net.commands[JOINT]], scheduler))
    net.run_until(lambda: leaving.done or unwatched(), SHUTDOWN_MAX)
    stands = abs(moving.device.velocity) / SCALE < STANDING
    assert stands is unwatched() is not lost
    assert leaving.done is lost
    if lost:
        with pytest.raises(DriveError, match='cut its power'):
            leaving.result()


@OPTIONS
@pytest.mark.parametrize('receives', [True, False], ids=['receives', 'cut off'])
def test_a_device_that_comes_back_in_motion_is_braked_before_it_is_configured(
    option: int, *, receives: bool
) -> None:
    """Nothing of it arrived for a while; one that still receives was stopped meanwhile."""
    moving = turning(option)
    moving.net.wire.loses = lambda sender, frame: sender == JOINT or not receives
    moving.run(0.6)
    assert not moving.net.network.nodes[JOINT].online
    assert (moving.device.state is DriveState.OPERATION_ENABLED) is not receives
    lose(moving)
    while not nmt_commands(moving):
        moving.run(PERIOD)
    assert abs(moving.device.velocity) / SCALE < STANDING
    assert moving.fastest < STANDING
    moving.net.run_until(moving.net.all_ready)


@OPTIONS
def test_a_device_that_leaves_operational_by_itself_in_motion_is_braked_at_once(
    option: int,
) -> None:
    """By SDO, not after the pause before its boot."""
    moving = turning(option)
    unseen = Frame(0x000, bytes((NmtCommand.ENTER_PRE_OPERATIONAL, NODE_ID)))
    moving.net.devices[JOINT].receive(unseen, moving.net.now)
    moving.run(0.2)
    assert moving.device.state is DriveState.QUICK_STOP_ACTIVE
    requests = moving.net.frames(0x600 + NODE_ID, since=moving.began)
    assert not any(data[0] == 0x80 for data in requests), 'an abort could undo the stop'
    moving.run(RAMP + 2.0)
    assert moving.net.all_ready()
    assert moving.fastest < STANDING
    assert moving.states[1:] == [DriveState.QUICK_STOP_ACTIVE, DriveState.SWITCH_ON_DISABLED]

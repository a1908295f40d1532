# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One stop for all drives: whatever each of them does, and whatever one of them cannot."""

from __future__ import annotations

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, PERIOD, SCALE, sdo_write
from moving_drive import JOINT, MovingDrive, STANDING
import pytest

from arm_canopen import DriveState, OperationMode
from arm_canopen.cia402.stop_all import stop_all, StopReport
from arm_canopen.master.remote_node import BootPhase
from arm_canopen.standard import NmtCommand
from canopen_sim import Drive as SimulatedDrive

pytestmark = pytest.mark.slow

MOVES, RESTS, HOMES, WAITS, DIES = NAMES = ('moves', 'rests', 'homes', 'waits', 'dies')


def test_all_drives_stand_and_it_says_what_became_of_each() -> None:
    """A move, a homing, rest, no power; one without an answer keeps no other from it."""
    writes = (*MOTION_WRITES, sdo_write(0x6099, 1, 5_000))
    drives = (drive_config(name, 2 + n, sdo_writes=writes) for n, name in enumerate(NAMES))
    net = VirtualNetwork(bus_config(*drives))
    net.boot()
    for name in (MOVES, RESTS, HOMES, DIES):
        net.do(name, 'init')
        net.select(name, OperationMode.PROFILE_POSITION)
    homing = net.commands[HOMES].run('home', net.commands[HOMES].home(17))
    net.commands[MOVES].set_target(30.0)
    net.run(0.5)
    net.power_off(DIES)
    net.run(0.5)
    assert {name for name in NAMES if name in net.devices and speed(net, name)} == {MOVES, HOMES}
    assert not homing.done
    report = stop(net)
    assert (report.stopped, report.standing) == ((MOVES, HOMES), (RESTS,))
    assert report.unpowered == (WAITS,)
    assert 'ended by halt' in str(homing.error)
    assert str(report).startswith(f'NOT known to stand: {DIES} is not seen to come to rest')
    enabled = [name for name in net.devices if state(net, name) is DriveState.OPERATION_ENABLED]
    assert enabled == [MOVES, RESTS, HOMES]
    for _ in range(200):
        net.run(PERIOD)
        assert all(speed(net, name) < STANDING for name in net.devices)
    again = stop(net)
    assert (again.stopped, again.standing) == ((), (MOVES, RESTS, HOMES))


@pytest.mark.parametrize('nmt', [NmtCommand.ENTER_PRE_OPERATIONAL, NmtCommand.STOP])
@pytest.mark.parametrize('lost', [(), (0x582,)], ids=['SDO', 'no SDO'])
def test_a_device_without_pdos_is_stopped_by_sdo(nmt: NmtCommand, lost: tuple[int, ...]) -> None:
    """Stopped it takes none before it is pre-operational; unanswered, its rest is unknown."""
    writes = (*MOTION_WRITES, sdo_write(0x6007, 0, 0), sdo_write(0x605A, 0, 6))
    net = VirtualNetwork(bus_config(drive_config(MOVES, 2, sdo_writes=writes)))
    net.boot()
    net.do(MOVES, 'init')
    net.select(MOVES, OperationMode.PROFILE_VELOCITY)
    net.commands[MOVES].set_target(0.5)
    net.run(0.5)
    net.network.send_nmt(nmt, 2)
    net.run(0.3)
    assert speed(net, MOVES) == pytest.approx(0.5)
    net.wire.loses = lambda sender, frame: frame.can_id in lost
    report = stop(net)
    assert speed(net, MOVES) < STANDING
    if lost:
        assert report == StopReport((), (), (), report.failed)
        assert report.failed[0].startswith(f'{MOVES} is not seen to come to rest; ')
        assert 'NMT state PRE_OPERATIONAL' in report.failed[0]
        return
    assert report == StopReport((MOVES,), (), (), ())
    assert state(net, MOVES) is DriveState.QUICK_STOP_ACTIVE


def test_a_second_stop_does_not_spoil_the_answer_of_the_first() -> None:
    """Two people press it: both answers are right, and it was stopped once."""
    net = VirtualNetwork(bus_config(drive_config(MOVES, 2)))
    net.boot()
    net.do(MOVES, 'init')
    net.select(MOVES, OperationMode.PROFILE_POSITION)
    net.commands[MOVES].set_target(3.0)
    net.run(0.5)
    scheduler, commands = net.network.scheduler, list(net.commands.values())
    first = scheduler.spawn(stop_all(commands, scheduler))
    net.run(0.02)
    assert not first.done
    second = scheduler.spawn(stop_all(commands, scheduler))
    assert net.result(second).stopped == (MOVES,)
    assert net.result(first) == StopReport((MOVES,), (), (), ())


def test_a_quick_stop_in_progress_is_waited_for() -> None:
    """A halt leaves it alone; the answer comes when the motor stands, and not before."""
    moving = MovingDrive(option=6)  # stays in Quick Stop Active
    moving.net.begin(JOINT, 'quick_stop', preempt=True)
    moving.net.run(3 * PERIOD)
    assert abs(moving.device.velocity) > 0.8 * SCALE
    report = stop(moving.net)
    assert abs(moving.device.velocity) < STANDING * SCALE
    assert report == StopReport((JOINT,), (), (), ())
    assert moving.net.drives[JOINT].view.state is DriveState.QUICK_STOP_ACTIVE


def test_the_reaction_to_a_fault_is_waited_for() -> None:
    """It brakes by itself, under power; only then nothing moves it."""
    moving = MovingDrive()
    moving.device.raise_fault(0x2310, moving.net.now)
    moving.net.run(3 * PERIOD)
    assert moving.net.drives[JOINT].view.state is DriveState.FAULT_REACTION_ACTIVE
    report = stop(moving.net)
    assert abs(moving.device.velocity) < STANDING * SCALE
    assert report == StopReport((), (), (f'{JOINT} (faulted)',), ())
    assert stop(moving.net) == report


@pytest.mark.parametrize('begins', ['quick_stop', 'fault'])
def test_what_does_not_come_to_rest_is_said(begins: str) -> None:
    """A ramp that takes a minute: within some seconds the answer is that it moves."""
    moving = MovingDrive(6, (0x6085, 0, round(SCALE / 60)))
    if begins == 'fault':
        moving.device.raise_fault(0x2310, moving.net.now)
    else:
        moving.net.begin(JOINT, 'quick_stop', preempt=True)
    moving.net.run(3 * PERIOD)
    report = stop(moving.net)
    assert abs(moving.device.velocity) > 0.5 * SCALE
    assert report.failed[0].startswith(f'{JOINT} is not seen to come to rest')
    assert report == StopReport((), (), (), report.failed)


def test_it_is_there_before_and_while_devices_boot() -> None:
    """What is not booted yet is not known to stand, and is not enabled by what came before."""
    net = VirtualNetwork(bus_config(drive_config(MOVES, 2), drive_config(RESTS, 3)))
    net.start()
    assert len(stop(net).failed) == 2
    net.run_until(lambda: net.drives[MOVES].node.phase is BootPhase.CONFIGURING)
    assert f'NOT known to stand: {MOVES} is not known to stand, as it was never' in str(stop(net))
    net.run_until(net.all_ready)
    assert stop(net) == StopReport((), (), (MOVES, RESTS), ())


def stop(net: VirtualNetwork) -> StopReport:
    """Stop all drives."""
    scheduler = net.network.scheduler
    report = net.result(scheduler.spawn(stop_all(list(net.commands.values()), scheduler)))
    assert isinstance(report, StopReport)
    return report


def simulated(net: VirtualNetwork, name: str) -> SimulatedDrive:
    """Return the drive of a simulated device."""
    drive = net.devices[name].drive
    assert drive is not None
    return drive


def state(net: VirtualNetwork, name: str) -> DriveState:
    """Return the state in which a simulated drive really is."""
    return simulated(net, name).state


def speed(net: VirtualNetwork, name: str) -> float:
    """Return how fast a motor really turns in [rad/s]."""
    return abs(simulated(net, name).velocity) / SCALE

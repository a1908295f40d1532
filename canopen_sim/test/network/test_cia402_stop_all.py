# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One stop for all drives: whatever each of them does, and whatever one of them cannot."""

from __future__ import annotations

from drive_samples import bus_config, drive_config, PERIOD, SCALE
from moving_drive import JOINT, MovingDrive, STANDING
import pytest
from virtual_network import VirtualNetwork

from arm_canopen.cia402.stop_all import stop_all, StopReport
from arm_canopen.master.remote_node import BootPhase
from arm_canopen.standard.drive import DriveState, OperationMode

pytestmark = pytest.mark.slow

MOVES, RESTS, HOMES, WAITS, DIES = NAMES = ('moves', 'rests', 'homes', 'waits', 'dies')


def test_all_drives_stand_and_it_says_what_became_of_each() -> None:
    """A move, a homing, rest, no power; one without an answer keeps no other from it."""
    net = VirtualNetwork(bus_config(*(drive_config(n, 2 + i) for i, n in enumerate(NAMES))))
    net.boot()
    for name in (MOVES, RESTS, HOMES, DIES):
        net.do(name, 'init')
        net.select(name, OperationMode.PROFILE_POSITION)
    homing = net.begin(HOMES, 'home')
    net.commands[MOVES].set_target(3.0)
    net.run(0.5)
    net.power_off(DIES)
    net.run(2.0)
    assert not net.drives[MOVES].view.stands
    report = stop(net)
    assert report.stopped[:1] == (MOVES,)
    assert RESTS in report.standing
    assert HOMES in (*report.stopped, *report.standing)
    assert homing.done
    assert report.unpowered == (WAITS,)
    assert [text.split()[0] for text in report.failed] == [DIES]
    assert str(report).startswith(f'NOT known to stand: {DIES} is not operational')
    assert net.drives[MOVES].view.state is DriveState.OPERATION_ENABLED
    here = motor(net)
    net.run(2.0)
    assert motor(net) == pytest.approx(here, abs=1e-3)
    again = stop(net)
    assert again.stopped == ()
    assert MOVES in again.standing


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
    moving.net.do(JOINT, 'quick_stop', preempt=True)
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
        moving.net.do(JOINT, 'quick_stop', preempt=True)
    moving.net.run(3 * PERIOD)
    report = stop(moving.net)
    assert abs(moving.device.velocity) > 0.5 * SCALE
    assert report.failed[0].startswith(f'{JOINT} is not seen to come to rest: ')
    assert report == StopReport((), (), (), report.failed)


def test_it_is_there_before_and_while_devices_boot() -> None:
    """What is not booted yet is not known to stand, and is not enabled by what came before."""
    net = VirtualNetwork(bus_config(drive_config(MOVES, 2), drive_config(RESTS, 3)))
    net.start()
    assert len(stop(net).failed) == 2
    net.run_until(lambda: net.drives[MOVES].node.phase is BootPhase.CONFIGURING)
    assert f'NOT known to stand: {MOVES} is not operational' in str(stop(net))
    net.run_until(net.all_ready)
    assert stop(net) == StopReport((), (), (MOVES, RESTS), ())


def stop(net: VirtualNetwork) -> StopReport:
    """Stop all drives."""
    scheduler = net.network.scheduler
    report = net.result(scheduler.spawn(stop_all(list(net.commands.values()), scheduler)))
    assert isinstance(report, StopReport)
    return report


def motor(net: VirtualNetwork) -> float:
    """Return where the motor that moved is in [rad]."""
    drive = net.devices[MOVES].drive
    assert drive is not None
    return drive.position / SCALE

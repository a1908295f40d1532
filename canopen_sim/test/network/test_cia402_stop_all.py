# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One stop for all drives: whatever each of them does, and whatever one of them cannot."""

from __future__ import annotations

from drive_samples import bus_config, drive_config, SCALE
import pytest
from virtual_network import VirtualNetwork

from arm_canopen.cia402.stop_all import stop_all, StopReport
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

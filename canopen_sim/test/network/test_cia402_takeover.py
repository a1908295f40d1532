# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A drive that is to be kept alive passes from one master to the next without a twitch."""

from __future__ import annotations

from dataclasses import replace
import itertools

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, every_mode
import pytest

from arm_canopen import DriveState, OperationMode, Severity
from arm_canopen.standard import NmtCommand

pytestmark = pytest.mark.slow

LOAD = 0.2  # share of the rated torque

CYCLIC = [OperationMode.CYCLIC_POSITION, OperationMode.INTERPOLATED_POSITION]


def kept_alive() -> VirtualNetwork:
    """Return a network whose drive is enabled by a first master, which does not watch it."""
    config = replace(every_mode(drive_config('a', 2)), reset_communication=False)
    net = VirtualNetwork(bus_config(config))
    net.boot()
    net.do('a', 'init')
    return net


def positions(net: VirtualNetwork, duration: float) -> list[float]:
    """Return where the motor was in each millisecond of a time in [s]."""
    seen = []
    for _ in range(round(duration * 1000)):
        net.run(0.001)
        drive = net.devices['a'].drive
        assert drive is not None
        seen.append(float(net.devices['a'].store.find(0x6064).value))
    return seen


@pytest.mark.parametrize('mode', CYCLIC)
def test_a_drive_that_holds_goes_on_holding(mode: OperationMode) -> None:
    """No state is left, no position changes, and the new master commands it at once."""
    net = kept_alive()
    net.select('a', mode)
    net.commands['a'].set_target(0.3)
    net.run(3.0)
    at_rest = positions(net, 0.01)[-1]
    begin = net.now
    net.replace_master()
    net.start()
    seen = positions(net, 1.0)
    drive = net.drives['a']
    assert net.network.nodes['a'].taken_over
    assert drive.view.state is DriveState.OPERATION_ENABLED
    assert drive.control.accepts_targets
    assert max(abs(position - at_rest) for position in seen) <= 1
    assert all(word & 0x0F == 0x0F for word in net.controlwords('a', since=begin))
    assert any('taken over enabled' in text for text in net.reported())
    net.commands['a'].set_target(0.5)
    net.run(3.0)
    assert drive.view.position == pytest.approx(0.5, abs=1e-3)


def test_a_move_on_its_way_is_brought_to_its_end() -> None:
    """Profile position: the drive has its target, and nobody takes it away."""
    net = kept_alive()
    net.select('a', OperationMode.PROFILE_POSITION)
    net.commands['a'].set_target(2.0)
    net.run(0.5)
    net.replace_master()
    net.start()
    seen = positions(net, 4.0)
    steps = [later - before for before, later in itertools.pairwise(seen)]
    assert min(steps) >= -1
    assert net.drives['a'].view.position == pytest.approx(2.0, abs=1e-3)


def test_a_drive_that_is_not_enabled_is_not_enabled() -> None:
    """Taking over requests nothing."""
    net = kept_alive()
    net.do('a', 'disable')
    net.replace_master()
    net.start()
    net.run(1.0)
    assert net.drives['a'].view.state is not DriveState.OPERATION_ENABLED
    assert net.drives['a'].control.goal is None


def test_what_was_taken_over_is_led_anew_after_a_stop() -> None:
    """A stop by NMT ends the take-over: after the next start the drive is not enabled."""
    net = kept_alive()
    net.select('a', OperationMode.CYCLIC_POSITION)
    net.replace_master()
    net.start()
    net.run(0.5)
    net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 2)
    net.run(0.5)
    net.network.send_nmt(NmtCommand.START, 2)
    net.run(1.0)
    assert net.drives['a'].view.state is not DriveState.OPERATION_ENABLED
    assert net.reported(Severity.ERROR) == []

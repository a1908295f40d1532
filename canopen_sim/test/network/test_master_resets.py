# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A reset by command is reported as what it is, and one without a command as an error."""

from __future__ import annotations

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config
import pytest

from arm_canopen import Severity
from arm_canopen.can import Frame
from arm_canopen.master.remote_node import RESET_TIME
from arm_canopen.standard import nmt_frame, NmtCommand, RESETS

pytestmark = pytest.mark.slow

NODE = 'a'
NODE_ID = 2


@pytest.fixture
def net() -> VirtualNetwork:
    """A booted device with an enabled drive."""
    made = VirtualNetwork(bus_config(drive_config(NODE, NODE_ID)))
    made.boot()
    made.do(NODE, 'init')
    made.run(0.5)
    made.events.clear()
    return made


def back(net: VirtualNetwork) -> None:
    """Wait until the device was lost and is booted again."""
    node = net.network.nodes[NODE]
    net.run_until(lambda: not node.online)
    net.run_until(net.all_ready)


@pytest.mark.parametrize('command', sorted(RESETS), ids=lambda command: command.name)
@pytest.mark.parametrize('ours', [True, False], ids=['our_service', 'other_tool'])
def test_a_commanded_reset_is_no_error(
    net: VirtualNetwork, command: NmtCommand, *, ours: bool
) -> None:
    """It is reported by name, and nothing worse but what the drive itself reports."""
    if ours:
        net.network.send_nmt(command, NODE_ID)
    else:
        net.send_as('tool', Frame(0x000, nmt_frame(command, NODE_ID)))
    back(net)
    assert [text for text in net.reported(Severity.WARNING) if 'EMCY' not in text] == []
    assert f'a: restarts, by the NMT command {command.name}' in net.reported()
    assert 'a: operational' in net.reported()


def test_a_device_that_restarts_slowly_is_no_error(net: VirtualNetwork) -> None:
    """It misses its heartbeat before its boot-up message comes; that is reported as the reset."""
    net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    net.power_off(NODE)
    net.run(0.9)
    assert not net.network.nodes[NODE].online
    net.power_on(NODE)
    net.run_until(net.all_ready)
    assert net.reported(Severity.ERROR) == []
    assert sum('restarts, by the NMT command' in text for text in net.reported()) == 1


def test_a_reset_that_nobody_commanded_is_an_error(net: VirtualNetwork) -> None:
    """So is one long after the last command, and one of another device."""
    net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    back(net)
    net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID + 1)
    net.run(RESET_TIME)
    net.power_off(NODE)
    net.power_on(NODE)
    back(net)
    assert any(
        'restarted: a boot-up message came' in text for text in net.reported(Severity.ERROR)
    )


def test_a_reset_that_is_not_obeyed_does_not_hide_a_later_loss(net: VirtualNetwork) -> None:
    """A heartbeat that stops when the reset is long over is an error."""
    net.wire.loses = lambda sender, frame: frame.can_id == 0
    net.network.send_nmt(NmtCommand.RESET_NODE, NODE_ID)
    net.run(RESET_TIME + 1.0)
    assert net.network.nodes[NODE].online
    net.power_off(NODE)
    net.run(1.0)
    assert any('heartbeat lost' in text for text in net.reported(Severity.ERROR))

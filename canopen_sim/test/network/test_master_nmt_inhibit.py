# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""NMT inhibit time (0x102A) on a bus with several drives: nobody is taken for lost by waiting."""

from __future__ import annotations

import itertools

from bus_rig import booted, Sent, START, VirtualNetwork
from drive_samples import bus_config, drive_config
import pytest

from arm_canopen import BusError, EventKind, Severity
from arm_canopen.standard import CobId, NmtCommand, NmtState

pytestmark = pytest.mark.slow

NODE_IDS = range(2, 9)
SDO_DOWNLOAD = 1  # command specifier of an initiated download (CiA 301, 7.2.4.3.3)


def seven_drives(inhibit_time: float) -> VirtualNetwork:
    """Return a bus of seven drives whose master waits between NMT commands."""
    configs = [drive_config(f'joint{number}', number) for number in NODE_IDS]
    return VirtualNetwork(bus_config(*configs, nmt_inhibit_time=inhibit_time))


def nmt_commands(net: VirtualNetwork) -> list[Sent]:
    """Return the NMT commands that were on the bus."""
    return [sent for sent in net.wire.log if sent.frame.can_id == CobId.NMT]


def sent_at(net: VirtualNetwork, command: NmtCommand, node_id: int) -> list[float]:
    """Return when a command was sent to a node id in [s]."""
    data = bytes((command, node_id))
    return [sent.time for sent in nmt_commands(net) if sent.frame.data == data]


@pytest.mark.parametrize('inhibit_time', [0.02, 0.05, 0.1])
def test_seven_drives_boot_and_stay(inhibit_time: float) -> None:
    """All of them are operational at the end of their one boot, and none drops out afterwards."""
    net = seven_drives(inhibit_time)
    net.boot()
    net.run(1.5)
    assert net.all_ready()
    assert [event for event in net.events if event.kind is EventKind.HEARTBEAT_LOST] == []
    times = [sent.time for sent in nmt_commands(net)]
    assert len(times) == 1 + 2 * len(NODE_IDS)
    assert min(b - a for a, b in itertools.pairwise(times)) >= inhibit_time - 1e-9


def test_no_device_is_configured_before_it_is_pre_operational() -> None:
    """PDO parameters may only be written while the device processes no PDOs."""
    net = seven_drives(0.1)
    net.boot()
    for node_id in NODE_IDS:
        (stopped,) = sent_at(net, NmtCommand.ENTER_PRE_OPERATIONAL, node_id)
        writes = [
            sent.time
            for sent in net.wire.log
            if sent.frame.can_id == CobId.SDO_REQUEST + node_id
            and sent.frame.data[0] >> 5 == SDO_DOWNLOAD
        ]
        assert writes
        assert min(writes) >= stopped


def test_devices_that_are_reset_one_by_one_boot_once() -> None:
    """The boot of a device begins when its own reset has left, not while that waits."""
    alive = drive_config('alive', 20, reset_communication=False)
    configs = [drive_config(f'joint{number}', number) for number in NODE_IDS]
    net = booted(*configs, alive, nmt_inhibit_time=0.1)
    for node_id in NODE_IDS:
        (reset,) = sent_at(net, NmtCommand.RESET_COMMUNICATION, node_id)
        (stopped,) = sent_at(net, NmtCommand.ENTER_PRE_OPERATIONAL, node_id)
        (started,) = sent_at(net, NmtCommand.START, node_id)
        assert START <= reset < stopped < started


def test_a_start_that_waits_is_withdrawn_when_its_device_restarts() -> None:
    """The device that came back is not the one that was configured."""
    net = seven_drives(0.1)
    net.start()
    last = NODE_IDS[-1]
    net.run_until(lambda: bool(sent_at(net, NmtCommand.ENTER_PRE_OPERATIONAL, last)))
    net.run(0.02)  # configured by now; its start waits behind those of the others
    assert not sent_at(net, NmtCommand.START, last)
    net.power_off(f'joint{last}')
    net.power_on(f'joint{last}')
    net.run_until(net.all_ready)
    (first, again) = sent_at(net, NmtCommand.ENTER_PRE_OPERATIONAL, last)
    (started,) = sent_at(net, NmtCommand.START, last)
    assert first < again < started


def test_a_command_is_done_when_it_has_left() -> None:
    """Whoever sends a command may wait for it to be on the bus."""
    net = seven_drives(0.1)
    net.boot()
    net.run(0.2)
    net.network.advance(net.now)
    begin = net.now
    sent = [net.network.send_nmt(NmtCommand.START, node_id) for node_id in NODE_IDS]
    assert [promise.done for promise in sent] == [True] + [False] * 6
    net.result(sent[-1])
    assert net.now - begin == pytest.approx(0.6)


def test_a_reset_that_waits_is_a_commanded_one_when_it_has_left() -> None:
    """What was queued behind it does not count yet: no device is said to restart by itself."""
    net = seven_drives(0.1)
    net.boot()
    net.run(0.2)
    for command in (NmtCommand.RESET_COMMUNICATION, NmtCommand.START):
        sent = [net.network.send_nmt(command, node_id) for node_id in NODE_IDS]
    net.result(sent[-1])
    net.run_until(net.all_ready)
    net.run(1.0)
    restarts = [event for event in net.events if 'RESET_COMMUNICATION' in event.text]
    assert [event.node for event in restarts] == list(net.devices)
    assert all(event.severity is Severity.INFO for event in restarts)


@pytest.mark.parametrize('inhibit_time', [0.0, 0.05])
def test_a_defect_at_one_command_keeps_back_no_other(
    inhibit_time: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stop by NMT must leave, whatever went wrong before."""
    net = seven_drives(inhibit_time)
    net.allows_defects = True
    net.boot()
    with monkeypatch.context() as patch:
        patch.setattr(net.network._nmt, '_send', None)
        net.network.send_nmt(NmtCommand.STOP, 2)
        net.run(0.2)
    assert sent_at(net, NmtCommand.STOP, 2) == []
    net.network.send_nmt(NmtCommand.STOP, 3)
    net.run(0.2)
    assert len(sent_at(net, NmtCommand.STOP, 3)) == 1


@pytest.mark.parametrize('inhibit_time', [0.0, 0.05])
def test_a_command_that_the_bus_refuses_leaves_as_soon_as_the_bus_takes_it(
    inhibit_time: float,
) -> None:
    """It is not done before, keeps its place, and counts as commanded when it has left."""
    net = seven_drives(inhibit_time)
    net.boot()
    net.run(0.5)
    net.wire.refuses = 'the transmit queue is full'
    stop, start = (net.network.send_nmt(c, 2) for c in (NmtCommand.STOP, NmtCommand.START))
    net.run(0.2)
    assert not stop.done
    assert net.network.nodes['joint2'].wanted is NmtState.OPERATIONAL
    net.wire.refuses = ''
    net.result(start)
    last_two = [sent.frame.data[0] for sent in nmt_commands(net)[-2:]]
    assert last_two == [NmtCommand.STOP, NmtCommand.START]


def test_a_command_that_the_bus_never_takes_is_answered_so() -> None:
    """It does not leave later, when nobody expects it any more."""
    net = seven_drives(0.0)
    net.boot()
    before = len(nmt_commands(net))
    net.wire.refuses = 'the transmit queue is full'
    with pytest.raises(BusError, match='NMT STOP to node 2 was not sent: the transmit queue is'):
        net.result(net.network.send_nmt(NmtCommand.STOP, 2))
    net.wire.refuses = ''
    net.run(0.05)
    assert len(nmt_commands(net)) == before

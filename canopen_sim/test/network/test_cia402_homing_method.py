# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which homing method is used, what a homing leaves behind, and that it succeeds only if seen."""

from __future__ import annotations

from dataclasses import replace

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, sdo_write
import pytest

from arm_canopen import DriveError, Severity
from arm_canopen.master.scheduler import Promise
from arm_canopen.standard import NmtCommand
from canopen_sim import Fault, FaultInjection

pytestmark = pytest.mark.slow

JOINT = 'joint'
METHOD = 0x6098


def network(method: int) -> VirtualNetwork:
    """Return a booted drive whose bus.yml writes a homing method."""
    net = VirtualNetwork(
        bus_config(drive_config(JOINT, 2, sdo_writes=(sdo_write(METHOD, 0, method),)))
    )
    net.boot()
    return net


def begin(net: VirtualNetwork, method: int | None) -> Promise[str]:
    """Begin to home by a method, or by that of the drive."""
    commands = net.commands[JOINT]
    return commands.run('home', commands.home(method))


def in_drive(net: VirtualNetwork) -> int:
    """Return what the simulated drive has in 0x6098."""
    return int.from_bytes(net.devices[JOINT].store.read(METHOD), 'little', signed=True)


def test_a_method_is_for_one_homing() -> None:
    """The next one without a method uses, and names, that of bus.yml."""
    net = network(35)
    assert 'homed by method 37' in net.result(begin(net, 37))
    assert 'homed by method 35' in net.result(begin(net, None))
    assert in_drive(net) == 35
    assert net.reported(Severity.WARNING) == []


def test_goals_without_a_pause_do_not_keep_each_others_method() -> None:
    """The second begins before the write that ends the first is answered."""
    net = network(35)
    net.result(begin(net, 37))
    net.result(begin(net, 34))
    net.run(0.1)
    assert in_drive(net) == 35


def test_a_cancelled_homing_gives_the_method_back() -> None:
    """There is no time to wait for the answer, and it is written all the same."""
    net = network(35)
    task = begin(net, 1)
    net.run_until(lambda: in_drive(net) == 1)
    net.run(0.2)
    net.commands[JOINT].cancel('homing was cancelled')
    with pytest.raises(DriveError, match='cancelled'):
        net.result(task)
    net.run(0.1)
    assert in_drive(net) == 35


def test_the_method_that_somebody_wrote_is_used() -> None:
    """What is in the drive counts where no method is named, not what was there at boot."""
    net = network(35)
    node = net.network.nodes[JOINT]
    net.result(node.objects.write_object(METHOD, 0, 37))
    assert 'homed by method 37' in net.result(begin(net, None))


def test_a_method_that_cannot_be_put_back_is_reported() -> None:
    """A drive that is lost in mid-homing keeps the method, which somebody has to know."""
    net = network(35)
    task = begin(net, 1)
    net.run_until(lambda: in_drive(net) == 1)
    net.run(0.2)
    net.power_off(JOINT)
    with pytest.raises(DriveError):
        net.result(task)
    net.run_until(
        lambda: any('35 was not put back' in text for text in net.reported(Severity.WARNING))
    )


@pytest.mark.parametrize('bits', [True, False], ids=['old bits', 'no bits'])
@pytest.mark.parametrize('end', ['sto', 'nmt'])
def test_a_homing_that_was_cut_off_has_not_succeeded(end: str, *, bits: bool) -> None:
    """The answer comes at once, whatever bits 10 and 12 show, and `~/enable` is free again."""
    net = network(35)
    device = net.devices[JOINT]
    if bits:
        device.faults.inject(FaultInjection(Fault.ARRIVED_WHEN_DISABLED), net.now)
    task = begin(net, 1)
    net.run(0.5)
    if end == 'sto':
        device.faults.inject(FaultInjection(Fault.STO), net.now)
    else:
        net.network.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 2)
    with pytest.raises(DriveError, match='was cut off while it homed, and is not homed'):
        net.result(task, 0.5)
    device.faults.end(net.now, Fault.STO)
    net.network.send_nmt(NmtCommand.START, 2)
    net.run(1.0)  # what homed on meanwhile is led to rest
    net.do(JOINT, 'enable')


def test_bits_of_an_earlier_homing_do_not_count() -> None:
    """The statusword that shows them may be old: its TPDO answers each fortieth SYNC."""
    slow = drive_config(JOINT, 2, sdo_writes=(sdo_write(METHOD, 0, 37),))
    state = replace(slow.tpdos[0], transmission=40)
    net = VirtualNetwork(bus_config(replace(slow, tpdos=(state, *slow.tpdos[1:]))))
    net.boot()
    assert 'homed' in net.result(begin(net, 37))
    with pytest.raises(DriveError, match='failed to home by method 99'):
        net.result(begin(net, 99))

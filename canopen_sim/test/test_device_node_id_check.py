# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Simulated devices do not get power where others have their node ids."""

from __future__ import annotations

from pathlib import Path

from can_addresses import free_virtual
from device_rig import drive_dictionary, NODE_ID
import pytest

from arm_canopen import CanopenError
from canopen_core.can import Frame, open_bus
from canopen_sim import DeviceRunner, simulated_devices
from canopen_sim.node_id_check import NodeIdCheck

TIMEOUT = 10.0  # [s]
PANDA = Path(__file__).parents[2] / 'arm_bringup' / 'robots' / 'panda' / 'bus.yml'


class StoppedClock:
    """A clock that goes on when it is read, so that nothing waits long."""

    def __init__(self, step: float) -> None:
        self.now, self.step = 100.0, step

    def __call__(self) -> float:
        """Return the time in [s]."""
        self.now += self.step
        return self.now


def test_a_device_that_answers_is_found() -> None:
    """It says nothing by itself: it waits for a master."""
    name = free_virtual()
    with open_bus(name) as first, open_bus(name) as second:
        devices = DeviceRunner(first)
        devices.host.add(NODE_ID, drive_dictionary())
        devices.start()
        try:
            devices.call(lambda: None).result(TIMEOUT)
            second.receive(0.0)  # its boot-up, which was before
            check = NodeIdCheck(second, [4, NODE_ID], StoppedClock(0.0))
            with pytest.raises(
                CanopenError, match=r'SDO response \(0x585\) of node id 5.* End th'
            ):
                check.finish()
        finally:
            devices.stop()


def test_an_answer_counts_after_other_work_that_took_long() -> None:
    """It has been received meanwhile."""
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as other:
        check = NodeIdCheck(bus, [NODE_ID], StoppedClock(10.0))
        other.send(Frame(0x585, bytes(8)))
        with pytest.raises(CanopenError, match='0x585'):
            check.finish()


@pytest.mark.parametrize(
    ('frame', 'found'),
    [
        (Frame(0x705, b'\0'), True),
        (Frame(0x705, b'\5'), True),
        (Frame(0x585, bytes(8)), True),
        (Frame(0x706, b'\0'), False),
        (Frame(0x605, bytes(8)), False),
        (Frame(0x705, is_remote=True), False),
        (Frame(0x080), False),
    ],
)
def test_only_what_the_device_itself_sends_counts(frame: Frame, found: bool) -> None:
    """The requests of a master, its node guarding and other devices do not."""
    name = free_virtual()
    with open_bus(name) as bus, open_bus(name) as other:
        other.send(frame)
        check = NodeIdCheck(bus, [NODE_ID], StoppedClock(0.05))
        assert bool(check.found) is found
        requests = [each.can_id for each in other.receive(0.0)]
        assert requests == ([] if found else [0x605])  # devices that are there are not disturbed
        if not found:
            check.finish()


def test_a_second_simulation_of_a_bus_is_refused() -> None:
    """The first goes on; when it has ended, there is room."""
    name = free_virtual()
    with simulated_devices(PANDA, name) as first:
        with pytest.raises(CanopenError, match='already'), simulated_devices(PANDA, name):
            pass
        assert len(first.call(lambda: first.host.devices).result(TIMEOUT)) == 7
    with simulated_devices(PANDA, name) as again:
        assert again.bus_name == name

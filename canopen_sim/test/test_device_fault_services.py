# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The services of simulated devices: faults, power and STO by hand."""

from __future__ import annotations

from collections.abc import Iterator
import time
from typing import Any

from can_addresses import free_virtual
from device_rig import drive_dictionary
from isolation import Isolation
import pytest

from canopen_core.can import Bus, open_bus
from canopen_core.standard import Statusword
from canopen_sim import DeviceRunner, Fault

rclpy = pytest.importorskip('rclpy')
pytest.importorskip('arm_msgs')

ARRIVAL = 20.0  # [s] a deadline, no measure
NAMES = {'joint1': 2, 'joint2': 3, 'no-name': 4}


class Services:
    """A node with three simulated drives, and clients.

    Attributes:
        runner: Runs the devices.
        other: The bus, as the rest of the network has it.
    """

    def __init__(self, bus: Bus, other: Bus) -> None:
        """Start everything; needs an initialised context."""
        from canopen_sim.nodes.fault_services import FaultServices

        self.other = other
        self.runner = DeviceRunner(bus)
        for node_id in NAMES.values():
            self.runner.host.add(node_id, drive_dictionary())
        self.node = rclpy.create_node('slaves')
        FaultServices(self.node, self.runner, NAMES)
        self.runner.start()
        self._executor = rclpy.executors.SingleThreadedExecutor()
        self._executor.add_node(self.node)

    def call(self, service: Any, name: str, **fields: Any) -> Any:
        """Call a service and return the response."""
        client = self.node.create_client(service, f'/slaves/{name}')
        future = client.call_async(service.Request(**fields))
        self._executor.spin_until_future_complete(future, ARRIVAL)
        assert future.done(), name
        return future.result()

    def faults(self) -> dict[int, list[Fault]]:
        """Return the faults that go on, by node id."""
        return self.runner.call(
            lambda: {
                device.node_id: [injection.fault for injection in device.faults.active]
                for device in self.runner.host.devices
            }
        ).result(ARRIVAL)

    def wait_for_boot_up(self, *node_ids: int) -> None:
        """Wait for the boot-up messages of devices."""
        missing = {0x700 + node_id for node_id in node_ids}
        deadline = time.monotonic() + ARRIVAL
        while missing:
            assert time.monotonic() < deadline, missing
            missing -= {f.can_id for f in self.other.receive(0.5) if f.data == b'\x00'}

    def close(self) -> None:
        """End everything."""
        self.runner.stop()
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def services(isolation: Isolation) -> Iterator[Services]:
    """Three drives with their services."""
    rclpy.init(domain_id=isolation.domain_id)
    name = free_virtual()
    try:
        with open_bus(name) as bus, open_bus(name) as other:
            stage = Services(bus, other)
            stage.wait_for_boot_up(*NAMES.values())
            yield stage
            stage.close()
    finally:
        rclpy.try_shutdown()


@pytest.mark.scenario
def test_faults_by_hand(services: Services) -> None:
    """One device or all misbehave by name, until "none" ends it."""
    from arm_msgs.srv import InjectFault

    answer = services.call(
        InjectFault,
        'fault',
        device='joint1',
        fault='sdo_delay',
        settings=['delay=0.3'],
        duration=60.0,
    )
    assert answer.success, answer.message
    assert answer.message == 'joint1: sdo_delay: answers SDOs late, by 0.3 s, for 60 s'
    assert services.call(InjectFault, 'fault', device='3', fault='disconnect').success
    assert services.call(InjectFault, 'no_name/fault', fault='heartbeat_stop').success
    assert services.faults() == {
        2: [Fault.SDO_DELAY],
        3: [Fault.DISCONNECT],
        4: [Fault.HEARTBEAT_STOP],
    }
    answer = services.call(InjectFault, 'fault', fault='none')
    assert answer.success
    assert answer.message.startswith('3 devices: ended: sdo_delay')
    assert services.faults() == {2: [], 3: [], 4: []}


@pytest.mark.scenario
def test_wrong_requests_say_what_there_is(services: Services) -> None:
    """Unknown devices, faults and settings change nothing; the answer lists those that exist."""
    from arm_msgs.srv import InjectFault

    cases: list[tuple[dict[str, Any], str]] = [
        ({'device': 'joint9', 'fault': 'reboot'}, "unknown device 'joint9'; did you mean 'joint"),
        ({'fault': 'explode'}, '\n  power_off: has no power (position_kept, duration)'),
        ({'fault': 'sdo_delay', 'settings': ['pdo=1']}, 'choose one of duration, object, delay'),
        ({'fault': 'sdo_delay', 'duration': -1.0}, 'duration -1.0'),
    ]
    for request, expected in cases:
        answer = services.call(InjectFault, 'fault', **request)
        assert not answer.success
        assert expected in answer.message
    assert services.faults() == {2: [], 3: [], 4: []}
    # rclpy ends a node that logs with two severities from one place
    assert services.call(InjectFault, 'fault', device='3', fault='heartbeat_stop').success


@pytest.mark.scenario
def test_power_and_sto_by_hand(services: Services) -> None:
    """One device boots again, or all; STO takes the voltage of one drive or all, and gives it."""
    from std_srvs.srv import SetBool, Trigger

    def supplied() -> list[bool]:
        devices = services.runner.host.devices
        words = services.runner.call(
            lambda: [device.store.integer(0x6041).value for device in devices]
        ).result(ARRIVAL)
        return [bool(word & Statusword.VOLTAGE_ENABLED) for word in words]

    assert services.call(SetBool, 'joint1/sto', data=True).success
    assert supplied() == [False, True, True]
    assert services.call(SetBool, 'sto', data=True).success
    assert supplied() == [False, False, False]
    answer = services.call(SetBool, 'sto', data=False)
    assert answer.message == '3 devices: STO is released'
    assert supplied() == [True, True, True]
    assert services.call(Trigger, 'joint2/power_cycle').success
    services.wait_for_boot_up(3)
    answer = services.call(Trigger, 'power_cycle')
    assert answer.message.startswith('3 devices: power_off')
    services.wait_for_boot_up(*NAMES.values())
    services.runner.stop()
    answer = services.call(Trigger, 'power_cycle')
    assert not answer.success
    assert 'has ended' in answer.message

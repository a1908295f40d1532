# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services that are called side by side, over DDS."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
import threading
import time

from isolation import reserve
import pytest
import rclpy
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger

from arm_bringup.bringup import enabling
from arm_bringup.service_client import ServiceClient
from node_runner import LATCHED, spin
from process_supervisor import CallError

pytestmark = pytest.mark.scenario


class Drives(Node):
    """A drive that does what it is asked, and one that refuses.

    Attributes:
        calls: Names of the services that were called, in their order.
    """

    def __init__(self) -> None:
        """Serve."""
        super().__init__('drives')
        self.calls: list[str] = []
        for name in ('good', 'bad'):
            self.create_service(Trigger, name, partial(self._answer, name))

    def _answer(
        self, name: str, _: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        self.calls.append(name)
        response.success, response.message = name != 'bad', f'{name} it is'
        return response


@pytest.fixture
def drives(monkeypatch: pytest.MonkeyPatch) -> Iterator[Drives]:
    """Serve them in a thread, in a domain of their own."""
    with reserve() as isolation:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(isolation.domain_id))
        rclpy.init(domain_id=isolation.domain_id)
        node, ending = Drives(), threading.Event()
        thread = threading.Thread(target=spin, args=([node], ending))
        thread.start()
        yield node
        ending.set()
        thread.join()
        node.destroy_node()
        rclpy.shutdown()


@pytest.mark.parametrize('by_heartbeat', [True, False])
def test_drives_are_enabled_when_they_have_booted(
    drives: Drives, by_heartbeat: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No service is called that would be refused, and said to be, at a healthy start.

    The master knows that before a heartbeat shows it.
    """
    monkeypatch.setattr('arm_bringup.bringup.BOOT_TIMEOUT', 600.0)
    states = drives.create_publisher(String, 'arm/nmt_state', LATCHED)
    states.publish(String(data='PREOP'))
    for name in ('init', 'mode'):
        drives.create_service(Trigger, f'arm/{name}', partial(drives._answer, name))
    said: list[str] = []
    booted = threading.Event()
    with enabling(['arm'], 'mode', said.append, booted=booted):
        time.sleep(1.5)
        assert drives.calls == []
        if by_heartbeat:
            states.publish(String(data='START'))
        else:
            booted.set()
        deadline = time.monotonic() + 60.0
        while not said and time.monotonic() < deadline:
            time.sleep(0.05)
    assert said == ['all 1 drives are enabled, in mode']
    assert drives.calls == ['init', 'mode']


def test_each_service_is_called_once(drives: Drives) -> None:
    """A refusal is said and not repeated; of a service that is not there nothing is called."""
    client = ServiceClient('test_client', lambda: False)
    try:
        client.prepare(['good', 'bad'])
        assert client.call(['good'], 60.0) == {'good': 'good it is'}
        with pytest.raises(CallError, match=r'^bad: bad it is$'):
            client.call(['good', 'bad'], 60.0)
        client.prepare(['none'])
        with pytest.raises(CallError, match='none'):
            client.call(['none'], 0.5)
    finally:
        client.close()
    assert sorted(drives.calls) == ['bad', 'good', 'good']

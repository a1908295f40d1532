# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Services that are called side by side, over DDS."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from functools import partial
import threading

from isolation import reserve
import pytest
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger

from arm_bringup import service_client
from arm_bringup.service_client import ServiceClient
from node_runner import create_deferred_service, spin
from process_supervisor import CallError

pytestmark = pytest.mark.scenario


class Drives(Node):
    """Two drives, of which one loses its first answer, and one that refuses.

    Attributes:
        calls: Names of the services that were called, in their order.
    """

    def __init__(self) -> None:
        """Serve."""
        super().__init__('drives')
        self.calls: list[str] = []
        for name in ('good', 'deaf', 'bad'):
            create_deferred_service(self, Trigger, name, partial(self._begin, name))

    def _begin(self, name: str, _: Trigger.Request) -> Future[Trigger.Response]:
        self.calls.append(name)
        future: Future[Trigger.Response] = Future()
        if name != 'deaf' or self.calls.count(name) > 1:
            future.set_result(Trigger.Response(success=name != 'bad', message=f'{name} it is'))
        return future


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


def test_a_lost_answer_is_asked_for_again(drives: Drives, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the one that did not answer; a refusal is said, and not repeated."""
    monkeypatch.setattr(service_client, 'ANSWER_TIME', 1.0)
    client = ServiceClient('test_client', lambda: False)
    try:
        client.prepare(['good', 'deaf', 'bad'])
        found = client.call(['good', 'deaf'], 60.0)
        assert found == {'good': 'good it is', 'deaf': 'deaf it is'}
        assert drives.calls.count('deaf') >= 2
        with pytest.raises(CallError, match=r'^bad: bad it is$'):
            client.call(['bad'], 60.0)
        client.prepare(['none'])
        with pytest.raises(CallError, match='none'):
            client.call(['none'], 0.5)
    finally:
        client.close()

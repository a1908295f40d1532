# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Requests to the controller over DDS: none overtakes a stop, and no stop is dropped."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from isolation import Isolation
import pytest
from ros_client import RosClient
from std_srvs.srv import Trigger
from teleop_robot import TEST_TIMEOUT

from quad_msgs.srv import SetMode
from quad_teleop import Mode
from quad_teleop.motion import RobotRequest
from quad_teleop.nodes.teleop import RobotLink

pytestmark = pytest.mark.scenario


def test_each_stop_is_sent_and_ends_what_was_requested_before(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mode that still waits for its service is not sent later; answers are shown once."""
    clock = SimpleNamespace(monotonic=lambda: 0.0)
    monkeypatch.setattr('quad_teleop.nodes.teleop.time', clock)
    shown: list[str] = []
    handled: list[str] = []

    def stop(_: Any, response: Any) -> Any:
        handled.append('stop')
        response.success, response.message = True, 'stands'
        return response

    def set_mode(request: Any, response: Any) -> Any:
        handled.append(request.mode)
        response.success, response.message = True, request.mode
        return response

    with RosClient(isolation.domain_id) as client:
        robot = RobotLink(client.node, shown.append)

        def wait_for_service(name: str) -> None:
            service = next(c for c in client.node.clients if c.srv_name.endswith(name))
            client.spin_until(service.service_is_ready, TEST_TIMEOUT, name)

        def stopped(times: int) -> bool:
            return handled == ['stop'] * times and robot._stops._future is None

        client.node.create_service(Trigger, 'stop', stop)
        wait_for_service('stop')
        robot.handle(Mode.WALK, 0.0)
        robot.handle(RobotRequest.STOP, 0.1)
        client.spin_until(lambda: stopped(1), TEST_TIMEOUT, 'stop')
        robot.handle(RobotRequest.STOP, 0.2)
        client.spin_until(lambda: stopped(2), TEST_TIMEOUT, 'second stop')
        assert shown == ['stop: stands']
        clock.monotonic = lambda: 1.0
        robot.handle(RobotRequest.STOP, 0.3)
        client.spin_until(lambda: stopped(3), TEST_TIMEOUT, 'third stop')
        assert shown == ['stop: stands'] * 2

        client.node.create_service(SetMode, 'set_mode', set_mode)
        wait_for_service('set_mode')
        robot.serve(0.4)
        robot.handle(Mode.STAND, 0.5)
        client.spin_until(lambda: robot.mode is Mode.STAND, TEST_TIMEOUT, 'stand')
        assert handled == ['stop'] * 3 + ['stand']

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A client waits until the node of its service has matched it."""

from __future__ import annotations

from isolation import Isolation
import pytest
import rclpy
from rclpy.context import Context
from rclpy.node import Node
from ros_client import RosClient
from std_srvs.srv import Trigger

from node_runner import ServerMatch

pytestmark = pytest.mark.scenario
TIMEOUT = 20.0  # [s]


@pytest.mark.parametrize('with_parameters', [True, False])
def test_a_server_that_is_served_matches(isolation: Isolation, *, with_parameters: bool) -> None:
    """Not before it answers; one without services of parameters counts when it is found."""
    context = Context()
    rclpy.init(context=context, domain_id=isolation.domain_id)
    server = Node(
        'server', enable_rosout=False, context=context, start_parameter_services=with_parameters
    )
    server.create_service(Trigger, 'do', lambda _, response: response)
    served = rclpy.executors.SingleThreadedExecutor(context=context)
    served.add_node(server)
    with RosClient(isolation.domain_id) as client:
        caller = client.node.create_client(Trigger, 'do')
        client.spin_until(caller.service_is_ready, TIMEOUT, 'the service')
        match = ServerMatch(client.node, ['do'])
        client.spin_until(lambda: match.advance() or True, TIMEOUT, 'a first look')
        client.spin_for(0.5)
        assert match.advance() is not with_parameters, 'it was not served yet'

        def both() -> bool:
            served.spin_once(0.0)
            return match.advance()

        client.spin_until(both, TIMEOUT, 'the match')
        assert list(client.node.clients) == [caller], 'the probe is gone'
        assert not ServerMatch(client.node, ['do', 'not_there']).advance(), 'no node offers it'
    served.shutdown()
    server.destroy_node()
    rclpy.shutdown(context=context)

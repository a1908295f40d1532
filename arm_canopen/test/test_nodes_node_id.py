# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from isolation import Isolation
import rclpy
from rclpy.logging import get_logger

from arm_canopen.nodes.device_node import DeviceNode
from arm_canopen.nodes.output_thread import OutputThread


def test_node_id_is_that_of_the_device(isolation: Isolation) -> None:
    """A parameter for all nodes of the process does not give a device another node id."""
    config = SimpleNamespace(name='gripper', namespace='', remappings={}, node_id=7)
    device: Any = SimpleNamespace(config=config, objects=None)
    nobody: Any = None  # the services are not called
    rclpy.init(args=['--ros-args', '-p', 'node_id:=99'], domain_id=isolation.domain_id)
    try:
        node = DeviceNode(device, nobody, OutputThread(get_logger('gripper')))
        assert node.get_parameter('node_id').value == 7
        node.destroy_node()
    finally:
        rclpy.shutdown()

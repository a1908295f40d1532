# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scene of the planner, for the arms that are moved here."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from moveit_msgs.msg import PlanningScene
from rclpy.node import Node

from arm_model import ArmError
from arm_model.ros import apply_planning_scene
from node_runner import LATCHED

from ..core.gateway import CommandGateway

TOPIC = 'monitored_planning_scene'
"""Where move_group publishes its scene, latched."""

RETRY_PERIOD = 0.1
"""Time between two looks whether the arms' positions are known in [s]."""


class SceneListener:
    """Applies each scene of the topic to all arms; what is refused is logged."""

    def __init__(self, node: Node, gateways: Sequence[CommandGateway]) -> None:
        """Subscribe.

        Args:
            node: The node.
            gateways: Commands to the core of each arm.
        """
        self._node = node
        self._scenes = {gateway: gateway.model.scene for gateway in gateways}
        self._waiting: deque[PlanningScene] = deque()
        node.create_subscription(PlanningScene, TOPIC, self._take, LATCHED)
        node.create_timer(RETRY_PERIOD, self._apply_waiting)

    def _take(self, message: PlanningScene) -> None:
        if not message.is_diff:  # it replaces what has waited
            self._waiting.clear()
        self._waiting.append(message)
        self._apply_waiting()

    def _apply_waiting(self) -> None:
        """Apply what has come, once it is known where all arms are."""
        if any(gateway.snapshot.reference is None for gateway in self._scenes):
            return
        while self._waiting:
            message = self._waiting.popleft()
            for gateway in self._scenes:
                self._apply(message, gateway)

    def _apply(self, message: PlanningScene, gateway: CommandGateway) -> None:
        reference = gateway.snapshot.reference
        if reference is None:
            return
        try:
            scene = apply_planning_scene(self._scenes[gateway], message, reference.position)
            gateway.use_scene(scene)
        except ArmError as error:
            self._node.get_logger().error(
                f'{TOPIC} refused for {gateway.model.group}, the scene before counts: {error}'
            )
            return
        self._scenes[gateway] = scene

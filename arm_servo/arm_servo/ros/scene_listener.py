# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scene of the planner, for the groups that are moved here."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from functools import partial
import time

from moveit_msgs.msg import PlanningScene
from rclpy.node import Node

from arm_model import ArmError, Array
from arm_model import PlanningScene as Scene
from arm_model.ros import apply_planning_scene
from node_runner import LATCHED

from ..core.gateway import CommandGateway
from ..core.scene_updater import SceneUpdater

TOPIC = 'monitored_planning_scene'
"""Where move_group publishes its scene, latched."""

RETRY_PERIOD = 0.1
"""Time between two looks whether the groups' positions are known in [s]."""

PLACE_TIMEOUT = 1.0
"""Time for which a scene waits for a group's position without a warning in [s]."""


class SceneListener:
    """Applies each scene of the topic to all groups; what is refused is logged.

    Scenes are built and measured in a thread of their own: neither the executor nor a cycle waits.
    """

    def __init__(
        self,
        node: Node,
        gateways: Sequence[CommandGateway],
        worker: Executor | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Subscribe.

        Args:
            node: The node.
            gateways: Commands to the core of each group.
            worker: Builds the scenes, one after the other; by default a thread.
            clock: Steady time in [s].
        """
        self._node, self._clock = node, clock
        self._worker = worker or ThreadPoolExecutor(1, thread_name_prefix='scenes')
        self._updaters = [SceneUpdater(gateway) for gateway in gateways]
        self._received = -1.0
        self._unplaced = list(self._updaters)  # those of which no warning has said so
        node.create_subscription(PlanningScene, TOPIC, self._take, LATCHED)
        node.create_timer(RETRY_PERIOD, self._retry)

    def _take(self, message: PlanningScene) -> None:
        if message.is_diff:
            self._node.get_logger().error(
                f'{TOPIC}: a diff (is_diff) is refused, the scene before counts: who joins a'
                ' latched topic gets its last message only; publish whole scenes there, and send'
                ' diffs to planning_scene of move_group',
                once=True,
            )
            return
        self._received = self._clock()
        for updater in self._updaters:
            updater.replace(partial(_replaced, message))
        self._retry()

    def _retry(self) -> None:
        """Have applied what can be, and warn of groups for which a scene waits in vain."""
        for updater in self._updaters:
            if not updater.waits:
                continue
            if updater.is_placed:
                self._worker.submit(self._update, updater)
            elif updater in self._unplaced and self._clock() - self._received > PLACE_TIMEOUT:
                self._unplaced.remove(updater)
                self._node.get_logger().warning(
                    f'{updater.gateway.model.group}: its position is not known, so the scene of'
                    f' {TOPIC} does not count for it yet; is its bus up, are its joint states'
                    ' published?'
                )

    def _update(self, updater: SceneUpdater) -> None:
        """Apply what waits for a group; in the thread of the scenes."""
        try:
            updater.update()
        except Exception as error:  # noqa: BLE001  # a scene must not end the thread
            reason = (
                str(error) if isinstance(error, ArmError) else f'{type(error).__name__}: {error}'
            )
            self._node.get_logger().error(
                f'{TOPIC} refused for {updater.gateway.model.group}, the scene before counts:'
                f' {reason}'
            )


def _replaced(message: PlanningScene, scene: Scene, positions: Array) -> Scene:
    return apply_planning_scene(scene, message, positions)

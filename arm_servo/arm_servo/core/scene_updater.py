# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scene of one group: what a planner publishes, applied once it is known where the arm is."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from arm_model import Array, PlanningScene

from .gateway import CommandGateway

SceneChange = Callable[[PlanningScene, Array], PlanningScene]
"""Makes a scene of the one before and the positions of the group's joints in [rad]."""


class SceneUpdater:
    """Has the newest scene of a planner count for one group.

    :meth:`replace` is for any thread, :meth:`update` for one: it takes as long as it needs.

    Attributes:
        gateway: Commands to the core of the group.
    """

    def __init__(self, gateway: CommandGateway) -> None:
        """Begin with the scene of the model.

        Args:
            gateway: Commands to the core of the group.
        """
        self.gateway = gateway
        self._scene = gateway.model.scene
        self._newest: deque[SceneChange] = deque(maxlen=1)

    @property
    def waits(self) -> bool:
        """Whether a scene does not count yet."""
        return bool(self._newest)

    @property
    def is_placed(self) -> bool:
        """Whether it is known where the group is, so that a scene can be applied."""
        return self.gateway.snapshot.reference is not None

    def replace(self, change: SceneChange) -> None:
        """Have a scene count in the place of the present one, and of any that waits.

        Args:
            change: Makes it.
        """
        self._newest.append(change)

    def update(self) -> None:
        """Apply what waits, if it is known where the group is; one that is equal changes nothing.

        Raises:
            ArmError: The scene is refused; the one before counts.
        """
        reference = self.gateway.snapshot.reference
        if reference is None or not self._newest:
            return
        scene = self._newest.pop()(self._scene, reference.position)
        if not scene.is_same(self._scene):
            self.gateway.use_scene(scene)
            self._scene = scene

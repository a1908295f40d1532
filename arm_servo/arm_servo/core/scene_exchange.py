# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes from any thread for the cycle; a trajectory under way is checked again in each."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from itertools import count

from arm_model import Array, PlanningScene

from .execution import Execution
from .motion_core import MotionCore
from .orders import Cycle, OrderQueue
from .prepared_scene import PreparedScene


class SceneExchange:
    """Has scenes prepared by who brings them, taken by the cycle, and paths checked in them."""

    def __init__(self, core: MotionCore, orders: OrderQueue, worker: Executor) -> None:
        self._core, self._orders, self._worker = core, orders, worker
        self._versions = count(1)

    def use(self, scene: PlanningScene, near: Array | None) -> Future[int]:
        """Use a scene from the next cycle on; it is measured here, in the caller's thread.

        Args:
            near: Where the arm is in [rad]; None while that is not known.

        Returns:
            The version of the scene once it counts.

        Raises:
            SceneError: The scene is of another arm.
        """
        version = next(self._versions)
        prepared = self._core.prepare_scene(scene, version, near)
        future: Future[int] = Future()

        def take(_cycle: Cycle) -> bool:
            # to free a large scene takes milliseconds: in the worker, not in the cycle
            before = [self._core.scene]
            execution = self._core.use_scene(prepared)
            if execution is not None:
                self.recheck(execution)
            self._worker.submit(before.clear)
            future.set_result(version)
            return True

        self._orders.append(take)
        return future

    def recheck(self, execution: Execution) -> None:
        """Check the rest of a path in the present scene, in the worker's thread; for the cycle."""
        begin, scene = execution.feedback.time, self._core.scene
        self._worker.submit(lambda: self._check(execution, begin, scene))

    def _check(self, execution: Execution, begin: float, scene: PreparedScene) -> None:
        """Check the rest of a path for contact; in the worker's thread."""
        if scene is not self._core.scene:
            return  # a newer one counts, in which it is checked as well
        try:
            found = None if scene.check is None else execution.contact(scene.check, begin)
            problem = found and (
                f'{" and ".join(found.links)} would collide at {found.time:.2f} s of the'
                ' trajectory: the scene changed; lead it around that'
            )
        except Exception as error:  # noqa: BLE001  # what is not known to be clear ends
            problem = (
                'the scene changed, and the rest of the trajectory could not be checked:'
                f' {type(error).__name__}: {error}'
            )

        def conclude(_cycle: Cycle) -> bool:
            self._core.conclude_check(execution, scene, problem or '')
            return True

        self._orders.append(conclude)

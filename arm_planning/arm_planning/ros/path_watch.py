# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories on their way when the scene changes: what is left of them must be clear."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from typing import Any

import numpy as np

from arm_model import Array, PlanningScene
from arm_trajectory import Path, PathCheck

from .background import as_refusal, Background
from .execution import Execution, INVALIDATED, TrajectoryExecution
from .scene_monitor import SceneMonitor
from .trajectories import part_of, path_of

LOOKS = 400  # places on a trajectory at which the arm is looked for

AMBIGUOUS = 0.02
"""Places that are this much farther away than the nearest may be where the arm is, in [rad]."""

LATENCY = 0.1
"""How far before that place the trajectory is looked at, in [s]: joint states come late."""


class PathWatch:
    """Stops executions whose way is not clear any more; belongs to the node's executor."""

    def __init__(
        self, monitor: SceneMonitor, execution: TrajectoryExecution, background: Background
    ) -> None:
        """Check executions after each change of the scene, and as they begin.

        The scene may have changed since a trajectory was planned.
        """
        self._monitor, self._execution, self._background = monitor, execution, background
        self._is_looking, self._looks_again = False, False
        monitor.on_change(self._look)
        execution.on_start(self._look)
        execution.on_failure(self._find_out)

    def _find_out(self, failed: Execution) -> None:
        """Find out whether a controller gave up because of the scene."""
        scene, here = self._monitor.snapshot.scene, self._monitor.positions()

        def found(done: Future[str]) -> None:
            contact = '' if done.cancelled() or done.exception() else done.result()
            self._execution.explain(failed, contact and _words(contact))

        self._background.submit(lambda: contact_ahead(failed.way, here, scene), found)

    def _look(self) -> None:
        """Check all executions in the present scene; once more where a check is under way."""
        self._looks_again = self._is_looking
        if self._is_looking or not (running := self._execution.running):
            return
        self._is_looking = True
        scene, here = self._monitor.snapshot.scene, self._monitor.positions()

        def contacts() -> list[str]:
            return [_contact(each.way, here, scene) for each in running]

        self._background.submit(contacts, lambda done: self._looked(running, done))

    def _looked(self, running: Sequence[Execution], done: Future[list[str]]) -> None:
        self._is_looking = False
        if done.cancelled():
            return
        for execution, contact in zip(running, done.result(), strict=True):
            if contact:
                self._execution.stop(execution, INVALIDATED, _words(contact))
        if self._looks_again:
            self._look()


def _words(contact: str) -> str:
    return f'the way is not clear in the present scene: {contact}'


def _contact(trajectory: Any, here: Array, scene: PlanningScene) -> str:  # noqa: ANN401
    """Return the contact ahead; what cannot be looked at is not known to be clear."""
    try:
        return contact_ahead(trajectory, here, scene)
    except Exception as error:  # noqa: BLE001  # one trajectory must not stop the others
        return f'what is left of the trajectory cannot be looked at: {as_refusal(error)}'


def contact_ahead(
    trajectory: Any,  # noqa: ANN401  # messages have no type
    here: Array,
    scene: PlanningScene,
) -> str:
    """Return what the rest of a trajectory would touch, in words; empty for nothing.

    Args:
        trajectory: A trajectory_msgs/JointTrajectory that was checked, with the way to its
            first point.
        scene: What may collide; all joints of the robot move in it.
    """
    joints = list(scene.kinematics.joints)
    moved = [name for name in trajectory.joint_names if name in joints]
    if len(trajectory.points) < 2 or not moved:
        return ''  # nothing that the robot has moves
    path = path_of(part_of(trajectory, moved))
    columns = [joints.index(name) for name in moved]
    passed = passed_time(path, here[columns])

    def rows(times: Array) -> Array:
        found = np.tile(here, (len(times), 1))
        found[:, columns] = path.positions(times + passed)
        return found

    contact = PathCheck(scene).contact(rows, path.duration - passed)
    if contact is None:
        return ''
    first, second = contact.links
    return f'{first} and {second} would touch in {contact.time:.1f} s'


def passed_time(path: Path, positions: Array) -> float:
    """Return a time of a path that is not behind the arm in [s]."""
    times = np.linspace(0.0, path.duration, LOOKS)
    apart = np.abs(path.positions(times) - positions).max(axis=1)
    first = int((apart <= apart.min() + AMBIGUOUS).argmax())
    return max(float(times[first]) - LATENCY, 0.0)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The whole robot with all of its joints, and the SRDF groups for which motions are planned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
import threading
from typing import Any

import numpy as np
from urdf_reader import DescriptionError, find_group, JointKind, parse_srdf, read_urdf

from arm_model import (
    AllowedCollisionMatrix,
    Array,
    frozen,
    Kinematics,
    ModelError,
    PlanningScene,
    RobotModel,
    with_default_collisions,
)

from ..exceptions import PlanningCode, PlanningError


class _Placed(threading.local):
    """The models that one thread last requested, by group."""

    def __init__(self) -> None:
        self.models: dict[str, RobotModel] = {}


class RobotGroups:
    """The whole robot, and a model of each group, built on first use.

    Thread-safe.

    Attributes:
        all_joints: Names of all joints, including mimic joints.
        continuous: Names of the continuous joints, whose whole turns do not count.
        scene: The robot alone; all joints move.
        world_frames: Frames to which the SRDF fixes the root link.
    """

    def __init__(
        self, urdf: str, srdf: str, limits: Mapping[str, Any], folder: Path | None = None
    ) -> None:
        self._texts, self._limits, self._folder = (urdf, srdf), limits, folder
        try:
            tree, semantic = read_urdf(urdf), parse_srdf(srdf)
        except DescriptionError as error:
            raise ModelError(str(error)) from error
        self.name, self.names = tree.name, tuple(semantic.groups)
        self.world_frames = semantic.world_frames
        if not self.names:
            raise ModelError('the SRDF has no group; give it one with <group name="arm">')
        self.kinematics = Kinematics(tree, [each.name for each in tree.joints if each.independent])
        self.all_joints = tuple(each.name for each in tree.movable())
        self.continuous = frozenset(
            each.name for each in tree.movable() if each.kind is JointKind.CONTINUOUS
        )
        joints = {}
        for name in self.names:
            # a group of links alone, such as a fixed hand, moves nothing
            with suppress(DescriptionError):
                joints[name] = find_group(tree, semantic, name).joints
        self._joints: Mapping[str, Sequence[str]] = joints
        ranges = tree.ranges()
        self._standing = frozen(
            [min(max(ranges[name].lower, 0.0), ranges[name].upper) for name in self.joints]
        )
        self._models: dict[str, RobotModel] = {}
        self._lock = threading.Lock()  # held while a model is made
        self._thread = _Placed()
        shapes = self.model(next(iter(joints), self.names[0])).scene.link_shapes
        self.scene = with_default_collisions(
            PlanningScene(self.kinematics, shapes, AllowedCollisionMatrix.of_srdf(semantic)),
            tree,
            np.array([ranges[name].lower for name in self.joints]),
            np.array([ranges[name].upper for name in self.joints]),
            notes=[],  # the models of the groups have them
        )

    @property
    def joints(self) -> Sequence[str]:
        """Names of all joints of the robot, in the order of its positions."""
        return self.kinematics.joints

    def group_joints(self) -> Mapping[str, Sequence[str]]:
        """Return the movable joints of each group."""
        return self._joints

    def model(self, group: str) -> RobotModel:
        """Return the model of a group; refuse a group that is unknown or cannot be moved."""
        if group not in self.names:
            raise PlanningError(
                PlanningCode.INVALID_GROUP_NAME,
                f'no group {group!r}; groups: {", ".join(self.names)}',
            )
        with self._lock:
            if group not in self._models:
                try:
                    self._models[group] = RobotModel(
                        *self._texts, self._limits, group, folder=self._folder
                    )
                except ModelError as error:
                    raise PlanningError(
                        PlanningCode.INVALID_GROUP_NAME,
                        f'group {group!r} cannot be moved: {error}',
                    ) from error
            return self._models[group]

    def model_at(self, group: str, positions: Array) -> RobotModel:
        """Return the model of a group, with joints outside it at ``positions`` in [rad].

        A thread gets the same model as long as these joints do not move.
        """
        placed = self._thread.models
        before = placed.get(group) or self.model(group)
        places = dict(zip(self.joints, positions.tolist(), strict=True))
        placed[group] = before.with_others(places)
        return placed[group]

    def positions(self, by_joint: Mapping[str, float]) -> Array:
        """Return the positions of all joints; joints not given are at 0 or the nearest limit."""
        positions = np.array(self._standing)
        for place, name in enumerate(self.joints):
            positions[place] = by_joint.get(name, positions[place])
        return frozen(positions)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Looks on from beside move_group: measures distances at the joint states that come.

It believes nobody: the scene is what the demo itself has put in, the positions are measured ones,
and every pair is measured at each of them and in between.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
import math

import numpy as np
from urdf_reader import read_urdf

from arm_model import Array, Clearances, frozen, Kinematics, PlanningScene, RobotModel

STEP = 0.005
"""Greatest motion of a joint between two looks in [rad] or [m]."""
TOUCH = 5e-4
"""Overlap that counts as contact in [m]; joint states of a busy computer are of several cycles."""
WITHIN = 0.5
"""Distances up to this are exact, greater ones a lower bound, in [m]."""


@dataclass(slots=True)
class Watch:
    """What was seen while something moved.

    Attributes:
        clearance: Least distance from the robot, and what it holds, to an obstacle in [m].
        nearest: The two of them.
        contacts: What touched, in words; the first time of each pair.
        gap: Greatest motion of a joint between two joint states in [rad] or [m].
    """

    clearance: float = math.inf
    nearest: tuple[str, str] = ('', '')
    contacts: dict[tuple[str, str], str] = field(default_factory=dict)
    gap: float = 0.0


class Observer:
    """Measures; belongs to one thread.

    Attributes:
        joints: Names of the joints of the robot that are independent.
        scene: What the demo has put around the robot, and what that holds.
        positions: Where the joints were seen last in [rad] or [m]; None before.
        states: How often they were seen.
        room: Distance of the robot, and what it holds, to the nearest obstacle then in [m].
        nearest: The two of them.
    """

    def __init__(self, urdf: str, model: RobotModel) -> None:
        """Begin with the robot alone.

        Args:
            urdf: The description of the robot.
            model: Any group of it, for shapes and what may touch by the SRDF.
        """
        tree = read_urdf(urdf)
        names = [each.name for each in tree.joints if each.independent]
        kinematics = Kinematics(tree, names)
        self.joints: Sequence[str] = kinematics.joints
        self.scene = PlanningScene(kinematics, model.scene.link_shapes, model.scene.allowed)
        self.positions: Array | None = None
        self.states = 0
        self.room, self.nearest = math.nan, ('', '')
        self._places: dict[str, float] = {}
        self._watches: list[Watch] = []
        self._measure = Clearances(self.scene)
        self._counted: Array = np.zeros(0, dtype=bool)
        self.change(self.scene)

    def change(self, scene: PlanningScene, ignored: Collection[str] = ()) -> None:
        """Measure in another scene from now on.

        Args:
            scene: Of the whole robot.
            ignored: Objects that are approached on purpose; contacts with them count all the same.
        """
        self.scene, self._measure = scene, Clearances(scene)
        things, passed = {*scene.objects, *scene.attached_bodies}, set(ignored)
        self._counted = np.array(
            [not things.isdisjoint(pair) and passed.isdisjoint(pair) for pair in scene.pairs],
            dtype=bool,
        )

    def watch(self) -> Watch:
        """Return what is filled from now on, until :meth:`end`."""
        watch = Watch()
        self._watches.append(watch)
        return watch

    def end(self, watch: Watch) -> None:
        """Fill it no more.

        Args:
            watch: Of :meth:`watch`.
        """
        self._watches = [each for each in self._watches if each is not watch]

    def see(self, places: Mapping[str, float]) -> None:
        """Take joint states in.

        Args:
            places: Positions by joint in [rad] or [m]; others keep their place.
        """
        self._places.update(places)
        positions = frozen([self._places.get(name, 0.0) for name in self.joints])
        before = positions if self.positions is None else self.positions
        self.positions, self.states = positions, self.states + 1
        moved = float(np.abs(positions - before).max())
        for watch in self._watches:
            watch.gap = max(watch.gap, moved)
        steps = max(1, math.ceil(moved / STEP))
        for share in np.linspace(0.0, 1.0, steps + 1)[1:].tolist():
            self._look(before + share * (positions - before))

    def contacts(self, positions: Array) -> Collection[frozenset[str]]:
        """Return the pairs that touch somewhere.

        Args:
            positions: Positions of all joints in [rad] or [m].
        """
        found = Clearances(self.scene).contacts(positions)
        return {frozenset(each.bodies) for each in found}

    def _look(self, positions: Array) -> None:
        distances = self._measure.least(positions, WITHIN)
        if not distances.size:
            return
        touching = (distances < -TOUCH).nonzero()[0].tolist()
        counted = np.where(self._counted, distances, math.inf)
        nearest = int(counted.argmin())
        self.room, self.nearest = float(counted[nearest]), self.scene.pairs[nearest]
        for watch in self._watches:
            for pair in touching:
                names = self.scene.pairs[pair]
                depth = 1e3 * -float(distances[pair])
                first, second = names
                watch.contacts.setdefault(names, f'{first} touched {second}, {depth:.1f} mm deep')
            if self.room < watch.clearance:
                watch.clearance, watch.nearest = self.room, self.nearest

    def row(self, places: Mapping[str, float]) -> Array:
        """Return positions of all joints, with some elsewhere than they were seen.

        Args:
            places: Positions by joint in [rad] or [m].
        """
        return frozen([places.get(name, self._places.get(name, 0.0)) for name in self.joints])

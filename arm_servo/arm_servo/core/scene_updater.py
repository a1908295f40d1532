# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scene of one group: what a planner publishes, with the joints beside it where they are.

A group that moves by itself (another arm) is checked against where it came to rest; while it
moves, :class:`MovingArms` keeps the two apart. Other joints beside the group (a gripper, a neck, a
lift) are checked where they are, or were half a second ago.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
import math

from urdf_reader import Pair

from arm_model import Array, PlanningScene

from .gateway import CommandGateway
from .moving_arms import MovingArms

SceneChange = Callable[[PlanningScene, Array], PlanningScene]
"""Makes a scene of the one before and the positions of the group's joints in [rad]."""

MOVING_PERIOD = 0.5  # time between two scenes for a joint beside the group that moves in [s]

PLACE_TOLERANCE = 1e-3
"""How far a joint that stands still may seem to move in [rad] or [m]: noise of its sensor."""


@dataclass(frozen=True, slots=True)
class JointPlaces:
    """One look at the joints of a robot."""

    # where they are in [rad] or [m], by joint
    places: Mapping[str, float] = field(default_factory=dict)
    moving: Collection[str] = frozenset()  # those that move

    def next(self, places: Mapping[str, float], commanded: Collection[str]) -> JointPlaces:
        """Return the next look; a joint that was not there before counts as one that moves."""
        moved = {
            joint
            for joint, place in places.items()
            if not abs(place - self.places.get(joint, math.nan)) <= PLACE_TOLERANCE
        }
        return JointPlaces(places, moved.union(commanded))


class SceneUpdater:
    """Has the newest scene count for one group, as it is with the joints beside the group.

    :meth:`change` is for one thread, :meth:`update` for another: it takes as long as it needs.
    """

    def __init__(
        self,
        gateway: CommandGateway,
        arms: Mapping[str, Sequence[str]],
        moving: MovingArms | None = None,
    ) -> None:
        """Begin with the scene of the model.

        Args:
            arms: Joints of the arms that move by themselves, by group.
        """
        self.gateway = gateway
        self._moving = moving
        model = gateway.model
        self._scene = self._planned = model.scene
        self._moved_by_others = model.moved_by_others
        self._arms = {group: arms[group] for group in self._moved_by_others}
        self._unchecked = self._moved_by(self._arms)
        if self._unchecked:
            self._planned = model.scene.with_allowed(model.allowed)
        self._moved = -math.inf
        self._changes: deque[SceneChange] = deque()  # the last whole scene, and those after it

    @property
    def waits(self) -> bool:
        """Whether a scene does not count yet."""
        return bool(self._changes)

    @property
    def others(self) -> Mapping[str, float]:
        """Where the joints beside the group count in [rad], by joint."""
        return self._planned.kinematics.others

    @property
    def is_placed(self) -> bool:
        """Whether it is known where the group is, so that a scene can be applied."""
        return self.gateway.snapshot.reference is not None

    def change(self, change: SceneChange, *, is_whole: bool) -> None:
        """Change the scene after the changes that wait; a whole scene replaces those."""
        if is_whole:
            self._changes = deque([change])
        else:
            self._changes.append(change)

    def update(self, joints: JointPlaces, now: float) -> None:
        """Apply the next change, if it is known where the group is.

        An equal scene changes nothing.

        Raises:
            ArmError: The scene is refused; the one before counts.
        """
        reference = self.gateway.snapshot.reference
        if reference is None:
            return
        moved = self._planned.kinematics.with_others(self._elsewhere(joints, now))
        planned = self._planned.with_others(moved)
        changes = self._changes  # another thread may replace them
        if changes:
            planned = changes.popleft()(planned, reference.position)
        unchecked = self._moved_by(
            group
            for group, names in self._arms.items()
            if any(name in joints.moving or name not in joints.places for name in names)
        )
        if planned is self._planned and unchecked == self._unchecked:
            return
        if self._moving is not None:
            self._moving.use_scene(planned)
        self._planned, self._unchecked = planned, unchecked
        scene = planned
        if unchecked:
            scene = planned.with_allowed(planned.allowed.with_entries(unchecked, True))
        if not scene.is_same(self._scene):
            self.gateway.use_scene(scene)
            self._scene = scene

    def _moved_by(self, groups: Iterable[str]) -> frozenset[Pair]:
        """Return the pairs of links that groups move."""
        return frozenset().union(*(self._moved_by_others[group] for group in groups))

    def _elsewhere(self, joints: JointPlaces, now: float) -> Mapping[str, float]:
        """Return the joints beside the group that count where they are not any more."""
        of_arms = {name for names in self._arms.values() for name in names}
        waits = now - self._moved < MOVING_PERIOD
        found = {
            joint: joints.places[joint]
            for joint, place in self.others.items()
            if joint in joints.places
            and abs(joints.places[joint] - place) > PLACE_TOLERANCE
            and not (joint in joints.moving and (waits or joint in of_arms))
        }
        if found:
            self._moved = now
        return found

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects of a planning scene: in the world, or attached to a link."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..exceptions import ObjectNameError, SceneError
from ..pose import ORIGIN, Pose
from .shapes import native, PlacedShape, Shape


@dataclass(frozen=True, slots=True, init=False)
class CollisionObject:
    """A thing that the robot must not touch."""

    name: str  # its name, which no link has
    shapes: tuple[PlacedShape, ...]  # its shapes, in its own frame
    # where it is: in the root link, or in the link that it is attached to
    pose: Pose = field(default=ORIGIN, compare=False)

    def __init__(self, name: str, *shapes: Shape | PlacedShape, pose: Pose = ORIGIN) -> None:
        """Put an object together.

        Args:
            shapes: Its shapes; without a pose of their own they are at its origin.

        Raises:
            SceneError: It has no name or no shape, or a shape is not usable.
        """
        if not name:
            raise ObjectNameError('an object needs a name; give it one')
        if not shapes:
            raise SceneError(f'object {name!r}: no shapes; it needs one at least')
        placed = tuple(
            shape if isinstance(shape, PlacedShape) else PlacedShape(shape) for shape in shapes
        )
        for each in placed:
            native(each.shape)  # or says why not
        object.__setattr__(self, 'name', name)
        object.__setattr__(self, 'shapes', placed)
        object.__setattr__(self, 'pose', pose)

    def at(self, pose: Pose) -> CollisionObject:
        """Return the object at another place."""
        return CollisionObject(self.name, *self.shapes, pose=pose)

    def is_same(self, other: CollisionObject) -> bool:
        """Whether another object has this name, and these shapes at the same places."""
        return (
            (self.name, len(self.shapes)) == (other.name, len(other.shapes))
            and self.pose.is_close(other.pose)
            and all(
                mine.shape == its.shape and mine.pose.is_close(its.pose)
                for mine, its in zip(self.shapes, other.shapes, strict=True)
            )
        )


@dataclass(frozen=True, slots=True)
class AttachedBody:
    """An object that moves with a link."""

    object: CollisionObject  # the object; its pose is in the link
    link: str  # the link
    touch_links: frozenset[str] = frozenset()  # links that it may touch; the link itself always

    def is_same(self, other: AttachedBody) -> bool:
        """Whether another body is the same object on the same link, and may touch the same."""
        mine, its = (self.link, self.touch_links), (other.link, other.touch_links)
        return mine == its and self.object.is_same(other.object)

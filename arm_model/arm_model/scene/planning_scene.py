# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The planning scene: links, objects, attached bodies, and the pairs checked for collisions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import copy
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import combinations, product
from types import MappingProxyType

import numpy as np
import pinocchio as pin

from ..arrays import Array, combined, inverse, Mask, Native, Places, Pose
from ..exceptions import LinkNameError, ObjectNameError, SceneError
from ..kinematics import Kinematics
from .objects import (
    AllowedCollisionMatrix,
    AttachedBody,
    Cells,
    check_padding,
    CollisionObject,
    native,
    padded,
    PlacedShape,
)
from .octomap import OCTOMAP_NAME


@dataclass(frozen=True, slots=True)
class _Body:
    """A shape that may collide."""

    name: str  # its link or object
    link: str  # the link that carries it; empty for an object of the world
    joint: int  # number of the joint that moves it; 0 for what stands still
    attached: AttachedBody | None = None  # the attached body that it is part of
    # whether it counts against the world only, with its padding, or without that against the robot
    # only; None for both
    padded: bool | None = None

    def counts_against(self, other: _Body) -> bool:
        """Whether the pair with another body must be checked."""
        return self.padded is None or self.padded is not bool(other.link)

    def may_touch(self, other: _Body) -> bool:
        """Whether an attached body may touch the other because of its links."""
        if self.attached is None:
            return False
        if other.attached is not None:
            return self.link == other.link
        return other.name in self.attached.touch_links or other.name == self.link


class PlanningScene:
    """Robot shapes, world objects, attached bodies and allowed collisions. Immutable.

    ``with_...``, ``without`` and similar methods return a new scene. Poses of objects are in the
    root link. Scenes are thread-safe; a :class:`Clearances`, one per thread, measures distances.
    Pairs that no joint of the group moves against each other are not checked.

    Attributes:
        padding: Thickness in [m] added to links and their attached bodies in checks against world
            objects, by link; not in checks against each other, as in MoveIt.
        scale: Scale factors, used in the same way.
        geometry: pinocchio geometry model with all shapes and pairs.
        octrees: Cells of octree shapes, by their numbers in the geometry.
        pairs: Names of the link or object of each pair of shapes that is checked (k).
        pair_shapes: Numbers of both shapes in the geometry (k, 2).
        of_cells: Mask of the pairs with an octree shape (k).
        relative_motion_sign: Sign with which each column of the kinematics moves the second shape
            of a pair relative to the first (k, columns): 1, -1, or 0.
        distance_rate_bounds: Greatest rate at which each joint changes the distance of a pair in
            any state (k, n) in [m/rad].
    """

    def __init__(
        self,
        kinematics: Kinematics,
        link_shapes: Mapping[str, Sequence[PlacedShape]],
        allowed: AllowedCollisionMatrix,
        objects: Iterable[CollisionObject] = (),
        attached_bodies: Iterable[AttachedBody] = (),
        *,
        padding: Mapping[str, float] | None = None,
        scale: Mapping[str, float] | None = None,
    ) -> None:
        """Create a scene; start from :attr:`RobotModel.scene` instead.

        Raises:
            SceneError: A name is not unique, a link is unknown, or a padding is not usable.
        """
        self.kinematics, self.link_shapes, self.allowed = kinematics, link_shapes, allowed
        self.objects = MappingProxyType({each.name: each for each in objects})
        self.attached_bodies = MappingProxyType(
            {each.object.name: each for each in attached_bodies}
        )
        self.padding = MappingProxyType(dict(padding or {}))
        self.scale = MappingProxyType(dict(scale or {}))
        self._refuse_names()
        self.geometry = pin.GeometryModel()
        self.octrees: dict[int, Cells] = {}
        bodies = self._bodies()
        extents = np.array([_extent(each) for each in self.geometry.geometryObjects])
        pairs = [
            # the octree first: coal turns the normal of the other order about
            (second, first) if second in self.octrees else (first, second)
            for first, second in _candidates(bodies)
            if self._checks(bodies[first], bodies[second])
        ]
        self.pair_shapes: Places = np.array(pairs, int).reshape(-1, 2)
        for pair in pairs:
            self.geometry.addCollisionPair(pin.CollisionPair(*pair))
        self.pairs: Sequence[tuple[str, str]] = tuple(
            (bodies[first].name, bodies[second].name) for first, second in pairs
        )
        self.relative_motion_sign, self.distance_rate_bounds = self._bounds(bodies, extents, pairs)
        self.of_cells: Mask = np.isin(self.pair_shapes[:, 0], list(self.octrees))
        fixed = (self.relative_motion_sign, self.distance_rate_bounds)
        for array in (*fixed, self.of_cells, self.pair_shapes):
            array.setflags(write=False)

    @property
    def names(self) -> Sequence[str]:
        """Names of all links with shapes, objects and attached bodies."""
        return (*self.link_shapes, *self.objects, *self.attached_bodies)

    def is_same(self, other: PlanningScene) -> bool:
        """Whether another scene has the same content at the same poses, and the same matrix."""
        return (
            self.kinematics.joints == other.kinematics.joints
            and self.kinematics.others == other.kinematics.others
            and self.link_shapes == other.link_shapes
            and self.allowed == other.allowed
            and (self.padding, self.scale) == (other.padding, other.scale)
            and self.objects.keys() == other.objects.keys()
            and self.attached_bodies.keys() == other.attached_bodies.keys()
            and all(thing.is_same(other.objects[name]) for name, thing in self.objects.items())
            and all(
                body.is_same(other.attached_bodies[name])
                for name, body in self.attached_bodies.items()
            )
        )

    def with_object(self, thing: CollisionObject) -> PlanningScene:
        """Return the scene with an object added to the world, or replaced if the name exists.

        Args:
            thing: The object; its pose is in the root link.

        Raises:
            SceneError: A link or an attached body has its name.
        """
        return self.with_contents(objects={**self.objects, thing.name: thing})

    def without(self, name: str) -> PlanningScene:
        """Return the scene without an object or attached body; SceneError for an unknown one."""
        self._thing(name)
        return self.with_contents(
            objects={each: thing for each, thing in self.objects.items() if each != name},
            attached_bodies={
                each: body for each, body in self.attached_bodies.items() if each != name
            },
        )

    def attached(
        self, name: str, link: str, positions: Array, touch_links: Iterable[str] = ()
    ) -> PlanningScene:
        """Return the scene with a world object attached to a link, at its present pose.

        Raises:
            SceneError: The world object or the link is unknown.
        """
        if name not in self.objects:
            raise ObjectNameError(f'no object {name!r} in the world; {self._known()}')
        self._check_links(name, link)
        place = inverse(self.kinematics.link_pose(link, positions))
        thing = self.objects[name].at(combined(place, self.objects[name].pose))
        body = AttachedBody(thing, link, frozenset(touch_links))
        return self.with_contents(
            objects={each: other for each, other in self.objects.items() if each != name},
            attached_bodies={**self.attached_bodies, name: body},
        )

    def with_attached(self, body: AttachedBody) -> PlanningScene:
        """Return the scene with an attached body added, or replaced if the name exists.

        Args:
            body: The body; the pose of its object is in the frame of the link.

        Raises:
            SceneError: A link or an object of the world has its name, or a link is unknown.
        """
        return self.with_contents(attached_bodies={**self.attached_bodies, body.object.name: body})

    def detached(self, name: str, positions: Array) -> PlanningScene:
        """Return the scene with an attached body detached to the world, at its present pose.

        Raises:
            SceneError: No such body is attached.
        """
        if name not in self.attached_bodies:
            raise ObjectNameError(f'no attached body {name!r}; {self._known()}')
        body = self.attached_bodies[name]
        place = self.kinematics.link_pose(body.link, positions)
        thing = body.object.at(combined(place, body.object.pose))
        bodies = {each: other for each, other in self.attached_bodies.items() if each != name}
        return self.with_contents(objects={**self.objects, name: thing}, attached_bodies=bodies)

    def pose(self, name: str, positions: Array) -> Pose:
        """Return the pose of an object or attached body in the root link, or raise SceneError."""
        thing = self._thing(name)
        if name in self.objects:
            return thing.pose
        link = self.attached_bodies[name].link
        return combined(self.kinematics.link_pose(link, positions), thing.pose)

    def with_contents(
        self,
        *,
        objects: Mapping[str, CollisionObject] | None = None,
        attached_bodies: Mapping[str, AttachedBody] | None = None,
        allowed: AllowedCollisionMatrix | None = None,
        padding: Mapping[str, float] | None = None,
        scale: Mapping[str, float] | None = None,
    ) -> PlanningScene:
        """Return the scene with several parts replaced in one step; None keeps a part.

        Removed objects lose their matrix entries, so a new object of the same name is checked.
        Entries of the octomap stay.

        Raises:
            SceneError: A name is not unique, a link is unknown, or a padding is not usable.
        """
        objects = self.objects if objects is None else objects
        attached_bodies = self.attached_bodies if attached_bodies is None else attached_bodies
        allowed = self.allowed if allowed is None else allowed
        for name in {*self.objects, *self.attached_bodies} - {*objects, *attached_bodies}:
            allowed = allowed if name == OCTOMAP_NAME else allowed.without(name)
        return PlanningScene(
            self.kinematics,
            self.link_shapes,
            allowed,
            objects.values(),
            attached_bodies.values(),
            padding=self.padding if padding is None else padding,
            scale=self.scale if scale is None else scale,
        )

    def with_others(self, kinematics: Kinematics) -> PlanningScene:
        """Return the scene with joints outside the group moved, together with what they carry."""
        if kinematics is self.kinematics:
            return self
        moved = copy.copy(self)
        moved.kinematics = kinematics
        return moved.with_contents()

    def between(self, groups: Sequence[Sequence[str]]) -> PlanningScene:
        """Return a scene for collisions between groups that move at the same time.

        Its joints are those of all groups. It only checks pairs that joints of more than one group
        move against each other; world objects, which no two groups move, are left
        out.

        Args:
            groups: Joints of each group, without overlap.
        """
        kinematics = self.kinematics.of_joints([joint for group in groups for joint in group])
        shapes, attached = self.link_shapes, self.attached_bodies.values()
        whole = PlanningScene(kinematics, shapes, self.allowed, (), attached)
        moved = whole.distance_rate_bounds > 0.0
        owners = np.array(
            [
                moved[:, [name in group for name in kinematics.joints]].any(axis=1)
                for group in groups
            ]
        )
        alone = (owners.sum(axis=0) < 2).nonzero()[0].tolist()
        return whole.with_allowed(
            self.allowed.with_entries((frozenset(whole.pairs[pair]) for pair in alone), True)
        )

    def with_allowed(self, allowed: AllowedCollisionMatrix) -> PlanningScene:
        """Return the scene with another allowed collision matrix, which may have unknown names."""
        return self.with_contents(allowed=allowed)

    def allowing(self, first: str, second: str, allowed: bool = True) -> PlanningScene:
        """Return the scene with an entry for all pairs of names that fit two patterns.

        Args:
            first: Name of a link or object; ``*``, ``?`` and ``[...]`` as in file names.
            allowed: Whether the pairs may touch; False to check them.

        Raises:
            SceneError: No name fits one of the patterns.
        """
        ones, others = (self._fitting(pattern) for pattern in (first, second))
        pairs = [frozenset((one, other)) for one in ones for other in others if one != other]
        return self.with_allowed(self.allowed.with_entries(pairs, allowed))

    def _thing(self, name: str) -> CollisionObject:
        if name in self.objects:
            return self.objects[name]
        if name in self.attached_bodies:
            return self.attached_bodies[name].object
        raise ObjectNameError(f'no object {name!r}; {self._known()}')

    def _known(self) -> str:
        world, attached = (
            ', '.join(names) or 'none' for names in (self.objects, self.attached_bodies)
        )
        return f'objects: {world}; attached bodies: {attached}'

    def _fitting(self, pattern: str) -> Sequence[str]:
        found = [name for name in self.names if fnmatchcase(name, pattern)]
        if not found:
            raise SceneError(f'no link or object {pattern!r}; there are: {", ".join(self.names)}')
        return found

    def _refuse_names(self) -> None:
        for name in (*self.objects, *self.attached_bodies):
            if name in self.kinematics.frames:
                raise ObjectNameError(f'object {name!r}: a link has this name')
        for name, body in self.attached_bodies.items():
            if name in self.objects:
                raise ObjectNameError(
                    f'object {name!r} is in the world and attached to {body.link}'
                )
            self._check_links(name, body.link, *body.touch_links)
        for link in {**self.padding, **self.scale}:
            if link not in self.kinematics.frames:
                known = ', '.join(self.kinematics.frames)
                raise LinkNameError(f'link_padding, link_scale: no link {link!r}; links: {known}')
            check_padding(link, self.padding.get(link, 0.0), self.scale.get(link, 1.0))

    def _check_links(self, name: str, *links: str) -> None:
        for link in links:
            if link not in self.kinematics.frames:
                raise LinkNameError(
                    f'object {name!r}: no link {link!r} to attach it to or to touch'
                )

    def _bodies(self) -> Sequence[_Body]:
        """Add all shapes to the geometry, and return the bodies they belong to."""
        bodies: list[_Body] = []
        for link, shapes in self.link_shapes.items():
            body = _Body(link, link, self.kinematics.parent_joint(link))
            bodies += self._carried(body, shapes, pin.SE3.Identity())
        for name, thing in self.objects.items():
            body, place = _Body(name, '', 0), _se3(thing.pose)
            bodies += [
                self._placed(body, each, place, native(each.shape)) for each in thing.shapes
            ]
        for name, attached in self.attached_bodies.items():
            thing = attached.object
            body = _Body(
                name, attached.link, self.kinematics.parent_joint(attached.link), attached
            )
            bodies += self._carried(body, thing.shapes, _se3(thing.pose))
        return bodies

    def _carried(
        self, body: _Body, shapes: Sequence[PlacedShape], place: Native
    ) -> Sequence[_Body]:
        """Add the shapes of a link or attached body, and padded copies for the world."""
        padding, scale = self.padding.get(body.link, 0.0), self.scale.get(body.link, 1.0)
        if (padding, scale) == (0.0, 1.0):
            return [self._placed(body, each, place, native(each.shape)) for each in shapes]
        bare, thick = replace(body, padded=False), replace(body, padded=True)
        return [
            *(self._placed(bare, each, place, native(each.shape)) for each in shapes),
            *(
                self._placed(thick, each, place, padded(each.shape, padding, scale))
                for each in shapes
            ),
        ]

    def _placed(self, body: _Body, placed: PlacedShape, place: Native, solid: Native) -> _Body:
        """Add a shape of a body to the geometry, at a pose in its link or in the world."""
        model = self.kinematics.native
        frame_id = self.kinematics.frames[body.link] if body.link else 0
        in_joint = model.frames[frame_id].placement * place * _se3(placed.pose)
        if isinstance(placed.shape, Cells):
            self.octrees[self.geometry.ngeoms] = placed.shape
        name = f'{body.name}_{self.geometry.ngeoms}'
        self.geometry.addGeometryObject(
            pin.GeometryObject(name, body.joint, frame_id, in_joint, solid)
        )
        return body

    def _checks(self, first: _Body, second: _Body) -> bool:
        if not (first.counts_against(second) and second.counts_against(first)):
            return False
        if first.may_touch(second) or second.may_touch(first):
            return False
        if not self.kinematics.moves(first.joint, second.joint):
            return False
        return not self.allowed.allows(first.name, second.name)

    def _bounds(
        self, bodies: Sequence[_Body], extents: Array, pairs: Sequence[tuple[int, int]]
    ) -> tuple[Array, Array]:
        """Return signs of relative motion and distance rate bounds of pairs.

        Each bound is the smaller of those seen from either shape.
        """
        kinematics = self.kinematics
        columns = kinematics.native.nv
        if not pairs:
            return np.zeros((0, columns)), np.zeros((0, len(kinematics.joints)))
        bounds = []
        for one, other in (np.array(pairs).T, np.array(pairs).T[::-1]):
            motions = [
                kinematics.relative_motion(bodies[a].joint, bodies[b].joint)
                for a, b in zip(one.tolist(), other.tolist(), strict=True)
            ]
            rate = np.array([motion.rate for motion in motions])
            turning = np.array([motion.turning for motion in motions])
            bounds.append(np.where(turning, rate + extents[one][:, None], rate))
        ends = ((bodies[first].joint, bodies[second].joint) for first, second in pairs)
        signs = np.array([kinematics.relative_motion(*joints).sign for joints in ends])
        return signs, kinematics.bounded(np.minimum(*bounds))


def _candidates(bodies: Sequence[_Body]) -> Sequence[tuple[int, int]]:
    """Return the pairs of bodies of which at least one moves."""
    moving = [number for number, body in enumerate(bodies) if body.joint]
    still = [number for number, body in enumerate(bodies) if not body.joint]
    mixed = ((min(pair), max(pair)) for pair in product(moving, still))
    return sorted([*combinations(moving, 2), *mixed])


def _se3(pose: Pose) -> Native:
    return pin.SE3(pose.rotation, pose.position)


def _extent(shape: Native) -> float:
    """Return the distance of the farthest point of a shape from its joint in [m]."""
    if not np.isfinite(shape.geometry.aabb_radius):
        return float('inf')
    center = shape.placement.act(shape.geometry.aabb_center)
    return float(np.linalg.norm(center)) + float(shape.geometry.aabb_radius)

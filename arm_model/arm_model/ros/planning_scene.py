# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Converts moveit_msgs scenes to the model's: objects, attached bodies, allowed collisions.

All changes of a message make one new scene. Attached bodies are applied before world objects, as
in MoveIt: one message may attach an object and also remove it from the world.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from moveit_msgs.msg import AllowedCollisionMatrix as MatrixMessage
from moveit_msgs.msg import AttachedCollisionObject
from moveit_msgs.msg import CollisionObject as ObjectMessage
from moveit_msgs.msg import PlanningScene as SceneMessage
import numpy as np
from octomap_msgs.msg import OctomapWithPose
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import Plane as PlaneMessage
from shape_msgs.msg import SolidPrimitive

from ..arrays import Array, combined, inverse, ORIGIN, Pose
from ..exceptions import LinkNameError, ObjectNameError, SceneError
from ..scene.objects import (
    AllowedCollisionMatrix,
    AttachedBody,
    Box,
    CollisionObject,
    Cone,
    Cylinder,
    Mesh,
    PlacedShape,
    Plane,
    Shape,
    Sphere,
)
from ..scene.octomap import OCTOMAP_NAME, octomap_shapes
from ..scene.planning_scene import PlanningScene
from .tf import pose_of, xyz, xyzw

FrameOf = Callable[[str], Pose]
"""Returns the pose of a frame in the root link, or raises a SceneError where there is none."""

ADD, REMOVE, APPEND, MOVE = (  # in Python a constant of the type byte is bytes
    int.from_bytes(each, 'little') if isinstance(each, bytes) else int(each)
    for each in (ObjectMessage.ADD, ObjectMessage.REMOVE, ObjectMessage.APPEND, ObjectMessage.MOVE)
)

MAX_CORNERS = 300
"""Greatest number of corners of a mesh hull: a controller builds it in less than a millisecond."""

LENGTHS: dict[int, tuple[type[Box | Sphere | Cylinder | Cone], tuple[int, ...]]] = {
    SolidPrimitive.BOX: (Box, (SolidPrimitive.BOX_X, SolidPrimitive.BOX_Y, SolidPrimitive.BOX_Z)),
    SolidPrimitive.SPHERE: (Sphere, (SolidPrimitive.SPHERE_RADIUS,)),
    SolidPrimitive.CYLINDER: (
        Cylinder,
        (SolidPrimitive.CYLINDER_RADIUS, SolidPrimitive.CYLINDER_HEIGHT),
    ),
    SolidPrimitive.CONE: (Cone, (SolidPrimitive.CONE_RADIUS, SolidPrimitive.CONE_HEIGHT)),
}
"""Shape, and indices of its lengths in ``dimensions``, by type of primitive."""


def apply_planning_scene(
    scene: PlanningScene,
    message: SceneMessage,
    positions: Array,
    frame_of: FrameOf | None = None,
    *,
    world_frames: Collection[str] = (),
) -> PlanningScene:
    """Apply a PlanningScene message to a scene; return the new scene.

    A whole scene replaces objects, attached bodies, padding and scale; a diff (``is_diff``)
    changes only those that it names. A matrix without names leaves allowed collisions as they
    are. Joint states in the message are ignored. An octomap becomes the object ``<octomap>``.

    Args:
        positions: Joint positions in [rad], for frames that move with the arm.
        frame_of: Returns the pose of frames that are not links; without it such frames fail.
        world_frames: Other names of the root link: those of the SRDF's virtual joint, in which
            MoveIt places its objects.

    Raises:
        SceneError: The message contradicts the robot or the previous scene.
    """
    state = message.robot_state
    is_whole = not message.is_diff
    keeps = state.is_diff or not (
        state.joint_state.name or state.attached_collision_objects or is_whole
    )
    draft = _Draft(
        scene,
        positions,
        frame_of,
        world_frames,
        {} if is_whole else dict(scene.objects),
        dict(scene.attached_bodies) if keeps and not is_whole else {},
    )
    for attached in state.attached_collision_objects:
        draft.apply_attached(attached)
    for thing in message.world.collision_objects:
        draft.apply(thing)
    draft.apply_octomap(message.world.octomap)
    padding = {each.link_name: each.padding for each in message.link_padding}
    scale = {each.link_name: each.scale for each in message.link_scale}
    return scene.with_contents(
        objects=draft.objects,
        attached_bodies=draft.attached,
        allowed=_merged(scene, message.allowed_collision_matrix),
        padding=padding if is_whole else {**scene.padding, **padding},
        scale=scale if is_whole else {**scene.scale, **scale},
    )


def scene_change(*things: ObjectMessage | AttachedCollisionObject) -> SceneMessage:
    """Return a diff that adds, changes or removes objects and attached bodies, and nothing else.

    For attached bodies, ADD without shapes attaches an object of the world; REMOVE without an id
    detaches all bodies of the link.
    """
    change = SceneMessage(is_diff=True)
    change.robot_state.is_diff = True
    for each in things:
        if isinstance(each, AttachedCollisionObject):
            change.robot_state.attached_collision_objects.append(each)
        else:
            change.world.collision_objects.append(each)
    return change


def allowed_collisions(message: MatrixMessage) -> AllowedCollisionMatrix:
    """Convert a matrix message to allowed collisions.

    As in MoveIt, the upper triangle counts, and an entry equal to the defaults of its names is
    dropped, because a client that changes a default sends back the entries that it has read.

    Raises:
        SceneError: Rows or columns are missing.
    """
    names, rows = list(message.entry_names), list(message.entry_values)
    defaults = list(message.default_entry_values)
    if len(rows) != len(names) or any(len(row.enabled) != len(names) for row in rows):
        raise SceneError(
            f'allowed_collision_matrix: {len(names)} entry_names need as many entry_values, each'
            ' of that length'
        )
    if len(defaults) != len(message.default_entry_names):
        raise SceneError(
            f'allowed_collision_matrix: {len(message.default_entry_names)} default_entry_names'
            f' and {len(defaults)} default_entry_values'
        )
    by_default = AllowedCollisionMatrix(
        defaults=dict(zip(message.default_entry_names, map(bool, defaults), strict=True))
    )
    entries = {}
    for row, first in enumerate(names):
        for column in range(row + 1, len(names)):
            second, allowed = names[column], bool(rows[row].enabled[column])
            if not (
                by_default.defaults.keys() & {first, second}
                and by_default.allows(first, second) == allowed
            ):
                entries[frozenset((first, second))] = allowed
    return AllowedCollisionMatrix(entries, by_default.defaults)


def _merged(scene: PlanningScene, message: MatrixMessage) -> AllowedCollisionMatrix | None:
    """Return the matrix of a message, plus the scene's entries for links that it does not name."""
    if not (message.entry_names or message.default_entry_names):
        return None
    given = allowed_collisions(message)
    named, links = set(message.entry_names), set(scene.kinematics.frames)
    kept = {
        pair: allowed
        for pair, allowed in scene.allowed.entries.items()
        if pair <= links and not pair <= named
    }
    return AllowedCollisionMatrix(kept | dict(given.entries), given.defaults)


@dataclass(frozen=True, slots=True)
class _Draft:
    """Objects and attached bodies while a message is applied."""

    before: PlanningScene
    positions: Array
    frame_of: FrameOf | None
    world_frames: Collection[str]
    objects: dict[str, CollisionObject]
    attached: dict[str, AttachedBody]

    def apply_octomap(self, message: OctomapWithPose) -> None:
        """Replace the octomap as in MoveIt: no id keeps the present one, no data removes it."""
        tree = message.octomap
        if not tree.id:
            return
        self.objects.pop(OCTOMAP_NAME, None)
        if not tree.data:
            return
        cells = octomap_shapes(
            tree.id, tree.data.tobytes(), float(tree.resolution), binary=bool(tree.binary)
        )
        if cells:
            frame = self._frame(OCTOMAP_NAME, message.header.frame_id)
            place = combined(frame, _pose(message.origin, OCTOMAP_NAME))
            self.objects[OCTOMAP_NAME] = CollisionObject(OCTOMAP_NAME, *cells, pose=place)

    def apply(self, message: ObjectMessage) -> None:
        """Add, move, extend or remove an object of the world."""
        name, operation = message.id, _operation(message)
        _refuse_reserved(name)
        if operation == REMOVE and not name:
            for each in self.objects.keys() - {OCTOMAP_NAME}:
                del self.objects[each]
        elif operation == REMOVE:
            if name not in self.attached:  # what a link has taken up is in the world no more
                self._known(name)
                del self.objects[name]
        elif operation == MOVE:
            self.objects[name] = self._moved(message)
        elif operation == APPEND and name in self.objects:
            before = self.objects[name]
            back = combined(inverse(before.pose), self._pose(message))
            more = [
                PlacedShape(each.shape, combined(back, each.pose)) for each in _shapes(message)
            ]
            self.objects[name] = CollisionObject(name, *before.shapes, *more, pose=before.pose)
        else:
            self.objects[name] = self._new(message)

    def apply_attached(self, message: AttachedCollisionObject) -> None:
        """Attach or detach an object."""
        thing, link = message.object, message.link_name
        name, operation = thing.id, _operation(thing)
        _refuse_reserved(name)
        if operation == REMOVE:
            self._detach(name, link)
            return
        if operation == MOVE:
            raise SceneError(
                f'attached object {name!r}: MOVE has no meaning; ADD it again at its new place'
            )
        place = inverse(self._link(name, link))
        touch = frozenset(message.touch_links)
        shapes = list(_shapes(thing))
        if operation == APPEND and name in self.attached:
            body = self.attached[name]
            if body.link != link:
                raise SceneError(f'attached object {name!r} is on {body.link!r}, not on {link!r}')
            back = combined(inverse(body.object.pose), combined(place, self._pose(thing)))
            more = [PlacedShape(each.shape, combined(back, each.pose)) for each in shapes]
            whole = CollisionObject(name, *body.object.shapes, *more, pose=body.object.pose)
            self.attached[name] = AttachedBody(whole, link, body.touch_links | touch)
            return
        if shapes:
            in_world = self._new(thing)
        elif name in self.objects:
            in_world = self.objects[name]
        else:
            raise ObjectNameError(
                f'attached object {name!r} has no shapes, and no object of the world has this name'
            )
        self.objects.pop(name, None)
        in_link = in_world.at(combined(place, in_world.pose))
        self.attached[name] = AttachedBody(in_link, link, touch)

    def _detach(self, name: str, link: str) -> None:
        fitting = [
            each
            for each, body in self.attached.items()
            if name in {'', each} and link in {'', body.link}
        ]
        if name and not fitting:
            known = ', '.join(self.attached) or 'none'
            raise ObjectNameError(f'no attached object {name!r} on {link!r}; there are: {known}')
        for each in fitting:
            body = self.attached.pop(each)
            place = combined(self._link(each, body.link), body.object.pose)
            self.objects[each] = body.object.at(place)

    def _new(self, message: ObjectMessage) -> CollisionObject:
        """Return a new object; without a pose it gets that of its only shape, as in MoveIt."""
        pose, shapes = self._pose(message), list(_shapes(message))
        x, y, z, w = xyzw(message.pose.orientation)
        is_unset = not any((*xyz(message.pose.position), x, y, z)) and w in {0.0, 1.0}
        if len(shapes) == 1 and is_unset:
            pose, shapes = combined(pose, shapes[0].pose), [PlacedShape(shapes[0].shape)]
        return CollisionObject(message.id, *shapes, pose=pose)

    def _moved(self, message: ObjectMessage) -> CollisionObject:
        before = self._known(message.id)
        if any((message.primitives, message.meshes, message.planes)):
            raise SceneError(f'object {message.id!r}: MOVE takes no shapes; use ADD to replace it')
        poses = [*message.primitive_poses, *message.mesh_poses, *message.plane_poses]
        shapes: tuple[PlacedShape, ...] = before.shapes
        if poses:
            if len(poses) != len(shapes):
                raise SceneError(
                    f'object {message.id!r}: {len(poses)} poses to move {len(shapes)} shapes'
                )
            shapes = tuple(
                PlacedShape(old.shape, _pose(new, message.id))
                for old, new in zip(shapes, poses, strict=True)
            )
        return CollisionObject(message.id, *shapes, pose=self._pose(message))

    def _known(self, name: str) -> CollisionObject:
        if name not in self.objects:
            known = ', '.join(self.objects) or 'none'
            raise ObjectNameError(f'no object {name!r} in the world; there are: {known}')
        return self.objects[name]

    def _pose(self, message: ObjectMessage) -> Pose:
        """Return the pose of an object in the root link."""
        place = _pose(message.pose, message.id)
        frame = self._frame(message.id, message.header.frame_id)
        return place if frame is ORIGIN else combined(frame, place)

    def _frame(self, name: str, frame: str) -> Pose:
        kinematics = self.before.kinematics
        if frame in {'', kinematics.root}:
            return ORIGIN
        if frame in kinematics.frames:
            return kinematics.link_pose(frame, self.positions)
        if frame in self.world_frames:
            return ORIGIN
        if self.frame_of is None:
            known = ', '.join(kinematics.frames)
            raise SceneError(f'object {name!r}: no frame {frame!r}; links: {known}')
        return self.frame_of(frame)

    def _link(self, name: str, link: str) -> Pose:
        """Return the pose of a link in the root link."""
        if link not in self.before.kinematics.frames:
            known = ', '.join(self.before.kinematics.frames)
            raise LinkNameError(f'attached object {name!r}: no link {link!r}; links: {known}')
        return self.before.kinematics.link_pose(link, self.positions)


def _refuse_reserved(name: str) -> None:
    if name == OCTOMAP_NAME:
        raise ObjectNameError(
            f"The ID '{name}' cannot be used for collision objects (name reserved); send an"
            ' octomap'
        )


def _operation(message: ObjectMessage) -> int:
    given = message.operation
    operation = int.from_bytes(given, 'little') if isinstance(given, bytes) else int(given)
    if operation not in {ADD, REMOVE, APPEND, MOVE}:
        raise SceneError(
            f'object {message.id!r}: no operation {operation}; choose ADD, REMOVE, APPEND or MOVE'
        )
    return operation


def _shapes(message: ObjectMessage) -> Iterator[PlacedShape]:
    """Yield primitives, meshes and planes; a missing pose is the object's origin."""
    name = message.id
    for what, things, poses, shape_of in (
        ('primitive', message.primitives, message.primitive_poses, primitive_shape),
        ('mesh', message.meshes, message.mesh_poses, _mesh),
        ('plane', message.planes, message.plane_poses, _plane),
    ):
        if len(poses) not in {0, len(things)}:
            raise SceneError(
                f'object {name!r}: {len(things)} {what} shapes and {len(poses)} poses'
            )
        for number, thing in enumerate(things):
            pose = _pose(poses[number], name) if len(poses) else ORIGIN
            yield PlacedShape(shape_of(thing, name), pose)


def primitive_shape(message: SolidPrimitive, name: str) -> Shape:
    """Convert a primitive to a shape.

    Raises:
        SceneError: The type is unknown, or the number of dimensions is wrong.
    """
    dimensions = [float(each) for each in message.dimensions]
    if message.type == SolidPrimitive.PRISM:
        return _prism(message, dimensions, name)
    if message.type not in LENGTHS:
        raise SceneError(
            f'object {name!r}: no primitive {message.type}; choose BOX, SPHERE, CYLINDER, CONE'
            ' or PRISM'
        )
    kind, places = LENGTHS[message.type]
    if len(dimensions) != len(places):
        raise SceneError(
            f'object {name!r}: a {kind.__name__.lower()} has {len(places)} dimensions, not'
            f' {len(dimensions)}'
        )
    return kind(*(dimensions[place] for place in places))


def _prism(message: SolidPrimitive, dimensions: list[float], name: str) -> Shape:
    corners = [(point.x, point.y) for point in message.polygon.points]
    if len(dimensions) != 1 or len(corners) < 3:
        raise SceneError(
            f'object {name!r}: a prism has 1 dimension and 3 corners at least, not'
            f' {len(dimensions)} and {len(corners)}'
        )
    half = 0.5 * dimensions[SolidPrimitive.PRISM_HEIGHT]
    return Mesh([(x, y, z) for x, y in corners for z in (-half, half)])


def _mesh(message: MeshMessage, name: str) -> Shape:
    vertices = [(point.x, point.y, point.z) for point in message.vertices]
    try:
        return hull_of(np.array(vertices, dtype=np.float64).tobytes())
    except SceneError as error:
        raise SceneError(f'object {name!r}: {error}') from error


@lru_cache(maxsize=64)
def hull_of(vertices: bytes) -> Mesh:
    """Return the hull of a mesh, cached because scenes are sent repeatedly.

    Args:
        vertices: Its corners as double-precision numbers.

    Raises:
        SceneError: The corners are not points, or not finite.
    """
    return Mesh(np.frombuffer(vertices).reshape(-1, 3), MAX_CORNERS)


def _plane(message: PlaneMessage, _name: str) -> Shape:
    """Return the half-space below a plane a x + b y + c z + d = 0."""
    a, b, c, d = (float(each) for each in message.coef)
    length = float(np.linalg.norm((a, b, c)))
    return Plane((a, b, c), -d / length if length else 0.0)


def _pose(message: Any, name: str) -> Pose:  # noqa: ANN401  # message classes have no type
    return pose_of(message.position, message.orientation, f'object {name!r}')

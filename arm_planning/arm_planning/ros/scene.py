# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The shared planning scene, and its conversion to messages; :mod:`.scene_changes` reads them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from geometry_msgs.msg import Point, Transform, TransformStamped, Vector3
from geometry_msgs.msg import Pose as PoseMessage
from moveit_msgs.msg import (
    AllowedCollisionEntry,
    AttachedCollisionObject,
    LinkPadding,
    LinkScale,
    ObjectColor,
    PlanningSceneComponents,
)
from moveit_msgs.msg import AllowedCollisionMatrix as MatrixMessage
from moveit_msgs.msg import CollisionObject as ObjectMessage
from moveit_msgs.msg import PlanningScene as SceneMessage
from moveit_msgs.msg import RobotState as StateMessage
import numpy as np
from object_recognition_msgs.msg import ObjectType
import pinocchio as pin
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import MeshTriangle, SolidPrimitive
from shape_msgs.msg import Plane as PlaneMessage
from std_msgs.msg import ColorRGBA, Header

from arm_model import (
    AllowedCollisionMatrix,
    Array,
    Box,
    Capsule,
    CollisionObject,
    combined,
    Cone,
    Cylinder,
    Mesh,
    OCTOMAP_NAME,
    ORIGIN,
    PlacedShape,
    Plane,
    PlanningScene,
    Pose,
    Sphere,
)

from ..exceptions import PlanningCode, PlanningError

MIN_FULLNESS = 0.9  # share of its hull that a mesh fills at least without a note


@dataclass(frozen=True, slots=True, eq=False)
class ObjectDetails:
    """Details of an object that collision checks do not use."""

    type_key: str = ''  # key of its type in a database
    type_db: str = ''  # which database
    subframes: Mapping[str, Pose] = field(default_factory=dict)  # poses in the object, by name
    # its shape_msgs/Mesh, in the order of its hulls; None for that of a prism
    meshes: Sequence[Any] = ()
    fullness: float = 1.0  # volume of its meshes as a share of that of their hulls, which count


@dataclass(frozen=True, slots=True, eq=False)
class AttachedDetails:
    """Details of an attached body that collision checks do not use."""

    detach_posture: Any  # the trajectory_msgs/JointTrajectory that lets it go
    weight: float  # its weight in [kg]


OuterFrames = Callable[[str, Array], Pose]
"""Returns the pose in the root link of a frame that is in neither robot nor scene, by its name and
the positions of all joints; raises PlanningError."""


@dataclass(frozen=True, slots=True, eq=False)
class SceneSnapshot:
    """One state of the scene; immutable."""

    scene: PlanningScene  # what may collide: all joints of the robot move
    name: str = ''  # its name
    # of objects of the world and attached ones, by name
    details: Mapping[str, ObjectDetails] = field(default_factory=dict)
    # of attached bodies, by name
    attached_details: Mapping[str, AttachedDetails] = field(default_factory=dict)
    # red, green, blue and opacity, by object
    colors: Mapping[str, tuple[float, float, float, float]] = field(default_factory=dict)
    # frames that clients named, in the root link
    fixed_frames: Mapping[str, Pose] = field(default_factory=dict)
    octomap: Any = None  # the octomap_msgs/OctomapWithPose in the root link; None for none
    world_frames: Sequence[str] = ()  # names of the world in which the root link stands
    outer_frames: OuterFrames | None = None  # frames of others, such as those of TF; None for none

    @property
    def root(self) -> str:
        """The link in which poses of world objects are expressed."""
        return self.scene.kinematics.root

    @property
    def notes(self) -> Sequence[str]:
        """Warnings about objects that are checked as larger than they are."""
        return [
            f'object {name!r} counts as the convex hull of its mesh, of which it fills'
            f' {100.0 * each.fullness:.0f} %; give it several meshes of convex parts where that'
            ' refuses too much'
            for name, each in self.details.items()
            if each.fullness < MIN_FULLNESS
        ]

    def link_of(self, frame: str) -> tuple[str, Pose]:
        """Return the link that carries a frame, and the pose of the frame in that link.

        The frame is a link, an object, an attached body, a subframe as ``object/subframe``, or a
        named frame; empty is the root link. Other frames are refused.
        """
        name = frame.removeprefix('/')
        if name in self.scene.kinematics.frames:
            return name, ORIGIN
        if not name or name in self.world_frames:
            return self.root, ORIGIN
        if name in self.fixed_frames:
            return self.root, self.fixed_frames[name]
        thing, separator, subframe = name.partition('/')
        found = self._thing(thing)
        if found is None or (separator and subframe not in self.details[thing].subframes):
            raise PlanningError(
                PlanningCode.FRAME_TRANSFORM_FAILURE,
                f'Unknown frame: {frame!r}; it must be a link, an object or object/subframe;'
                f' objects: {", ".join(self.details) or "none"}',
            )
        link, pose = found
        return link, combined(pose, self.details[thing].subframes[subframe]) if separator else pose

    def frame(self, frame: str, positions: Array) -> Pose:
        """Return the pose in the root link of a frame of :meth:`link_of`, or of an outer frame."""
        try:
            link, pose = self.link_of(frame)
        except PlanningError:
            if self.outer_frames is None:
                raise
            return self.outer_frames(frame.removeprefix('/'), positions)
        if link == self.root:
            return pose
        return combined(self.scene.kinematics.link_pose(link, positions), pose)

    def _thing(self, name: str) -> tuple[str, Pose] | None:
        if name in self.scene.objects:
            return self.root, self.scene.objects[name].pose
        if name in self.scene.attached_bodies:
            body = self.scene.attached_bodies[name]
            return body.link, body.object.pose
        return None


ALL_COMPONENTS = (1 << 10) - 1  # all bits of moveit_msgs/PlanningSceneComponents


def collision_message(snapshot: SceneSnapshot, robot_name: str) -> SceneMessage:
    """Return a scene for controllers: meshes are sent as the corners of their hulls."""
    bare = {name: ObjectDetails() for name in snapshot.details}
    message = scene_message(replace(snapshot, details=bare), robot_name, StateMessage())
    held = message.robot_state.attached_collision_objects
    for thing in (*message.world.collision_objects, *(each.object for each in held)):
        for mesh in thing.meshes:
            mesh.triangles = []
    return message


def scene_message(
    snapshot: SceneSnapshot, robot_name: str, state: StateMessage, components: int = ALL_COMPONENTS
) -> SceneMessage:
    """Return a scene as a moveit_msgs/PlanningScene, whole or only the requested parts.

    Attached bodies are added to the state; parts are bits of PlanningSceneComponents.
    """
    has = PlanningSceneComponents
    objects = {name: each for name, each in snapshot.scene.objects.items() if name != OCTOMAP_NAME}
    message = SceneMessage(robot_model_name=robot_name)
    # as MoveIt: an answer with parts only is a change
    message.is_diff = message.robot_state.is_diff = components != ALL_COMPONENTS
    message.name = snapshot.name
    if components & has.TRANSFORMS:
        message.fixed_frame_transforms = [
            _transform(snapshot.root, name, pose) for name, pose in snapshot.fixed_frames.items()
        ]
    if components & has.ROBOT_STATE:
        message.robot_state = state
        message.robot_state.is_diff = False
    if components & (has.ROBOT_STATE_ATTACHED_OBJECTS | has.ROBOT_STATE):
        message.robot_state.attached_collision_objects = attached_messages(snapshot)
    if components & has.ALLOWED_COLLISION_MATRIX:
        message.allowed_collision_matrix = matrix_message(snapshot.scene.allowed)
    if components & has.LINK_PADDING_AND_SCALING:
        scene = snapshot.scene  # a link without a shape may carry something
        message.link_padding = [
            LinkPadding(link_name=link, padding=scene.padding.get(link, 0.0))
            for link in {**scene.link_shapes, **scene.padding}
        ]
        message.link_scale = [
            LinkScale(link_name=link, scale=scene.scale.get(link, 1.0))
            for link in {**scene.link_shapes, **scene.scale}
        ]
    if components & has.OBJECT_COLORS:
        message.object_colors = [
            ObjectColor(id=name, color=ColorRGBA(**dict(zip('rgba', color, strict=True))))
            for name, color in snapshot.colors.items()
        ]
    if components & has.WORLD_OBJECT_GEOMETRY:
        message.world.collision_objects = [
            object_message(each, snapshot.details[name], snapshot.root)
            for name, each in objects.items()
        ]
    elif components & has.WORLD_OBJECT_NAMES:
        message.world.collision_objects = [
            _identified(name, snapshot.details[name], snapshot.root) for name in objects
        ]
    if components & has.OCTOMAP and snapshot.octomap is not None:
        message.world.octomap = snapshot.octomap
    return message


def attached_messages(snapshot: SceneSnapshot) -> Sequence[AttachedCollisionObject]:
    """Return the attached bodies as messages, each in the frame of its link."""
    return [
        AttachedCollisionObject(
            link_name=body.link,
            object=object_message(body.object, snapshot.details[name], body.link),
            touch_links=sorted(body.touch_links),
            detach_posture=snapshot.attached_details[name].detach_posture,
            weight=snapshot.attached_details[name].weight,
        )
        for name, body in snapshot.scene.attached_bodies.items()
    ]


def object_message(thing: CollisionObject, details: ObjectDetails, frame: str) -> ObjectMessage:
    """Return an object as a moveit_msgs/CollisionObject."""
    message = _identified(thing.name, details, frame)
    message.pose = pose_message(thing.pose)
    meshes = iter(details.meshes)
    for placed in (part for each in thing.shapes for part in _as_primitives(each)):
        shape, pose = placed.shape, pose_message(placed.pose)
        match shape:
            case Mesh():
                message.meshes.append(next(meshes, None) or _mesh(shape))
                message.mesh_poses.append(pose)
            case Plane():
                length = float(np.linalg.norm(shape.normal))
                message.planes.append(PlaneMessage(coef=[*shape.normal, -shape.offset * length]))
                message.plane_poses.append(pose)
            case Box() | Sphere() | Cylinder() | Cone():
                message.primitives.append(_primitive(shape))
                message.primitive_poses.append(pose)
    message.subframe_names = list(details.subframes)
    message.subframe_poses = [pose_message(each) for each in details.subframes.values()]
    return message


def matrix_message(allowed: AllowedCollisionMatrix) -> MatrixMessage:
    """Return allowed collisions as a moveit_msgs/AllowedCollisionMatrix."""
    names = sorted({name for pair in allowed.entries for name in pair} | set(allowed.defaults))
    return MatrixMessage(
        entry_names=names,
        entry_values=[
            AllowedCollisionEntry(enabled=[allowed.allows(first, second) for second in names])
            for first in names
        ],
        default_entry_names=list(allowed.defaults),
        default_entry_values=list(allowed.defaults.values()),
    )


def _identified(name: str, details: ObjectDetails, frame: str) -> ObjectMessage:
    kind = ObjectType(key=details.type_key, db=details.type_db)
    return ObjectMessage(header=Header(frame_id=frame), id=name, type=kind)


def _transform(root: str, name: str, pose: Pose) -> TransformStamped:
    message = TransformStamped(header=Header(frame_id=root), child_frame_id=name)
    placed = pose_message(pose)
    x, y, z = pose.position.tolist()
    message.transform = Transform(translation=Vector3(x=x, y=y, z=z), rotation=placed.orientation)
    return message


def pose_message(pose: Pose) -> PoseMessage:
    """Return a pose as a geometry_msgs/Pose."""
    message = PoseMessage(position=point_message(pose.position))
    numbers = pin.Quaternion(pose.rotation).normalized().coeffs().tolist()
    turn = message.orientation
    turn.x, turn.y, turn.z, turn.w = numbers
    return message


def point_message(position: Array) -> Point:
    """Return a position as a geometry_msgs/Point."""
    x, y, z = (float(number) for number in position)
    return Point(x=x, y=y, z=z)


def _primitive(shape: Box | Sphere | Cylinder | Cone) -> SolidPrimitive:
    """Return a shape as a shape_msgs/SolidPrimitive."""
    match shape:
        case Box(x, y, z):
            return SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[x, y, z])
        case Sphere(radius):
            return SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[radius])
        case Cylinder(radius, length):
            return SolidPrimitive(type=SolidPrimitive.CYLINDER, dimensions=[length, radius])
        case Cone(radius, length):
            return SolidPrimitive(type=SolidPrimitive.CONE, dimensions=[length, radius])


def _as_primitives(placed: PlacedShape) -> Sequence[PlacedShape]:
    """Return shapes that messages know: a capsule becomes a cylinder and two spheres."""
    shape, pose = placed.shape, placed.pose
    if not isinstance(shape, Capsule):
        return (placed,)
    half = 0.5 * shape.length * pose.rotation[:, 2]
    ends = (Pose(pose.rotation, pose.position + side * half) for side in (-1, 1))
    caps = (PlacedShape(Sphere(shape.radius), end) for end in ends)
    return (PlacedShape(Cylinder(shape.radius, shape.length), pose), *caps)


def _mesh(mesh: Mesh) -> MeshMessage:
    """Return the surface of a hull as a shape_msgs/Mesh."""
    hull = mesh.hull
    faces = (hull.polygons(number) for number in range(hull.num_polygons))
    triangles = [MeshTriangle(vertex_indices=[face[0], face[1], face[2]]) for face in faces]
    return MeshMessage(triangles=triangles, vertices=[point_message(each) for each in mesh.points])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Poses, shapes and the scene as messages; :mod:`.scene_changes` is the way back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

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
    Cone,
    Cylinder,
    Mesh,
    OCTOMAP_NAME,
    PlacedShape,
    Plane,
    Pose,
    Sphere,
)

from .scene_snapshot import ObjectDetails, SceneSnapshot

ALL_COMPONENTS = (1 << 10) - 1  # all bits of moveit_msgs/PlanningSceneComponents


def collision_message(snapshot: SceneSnapshot, robot_name: str) -> SceneMessage:
    """Return a scene as controllers take it: of meshes the corners of the hulls that count."""
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
    """Return a scene as a moveit_msgs/PlanningScene, whole or the parts that are asked for.

    Args:
        state: Where the joints are; attached bodies are added here.
        components: Bits of moveit_msgs/PlanningSceneComponents.
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
                message.planes.append(_plane(shape))
                message.plane_poses.append(pose)
            case Box() | Sphere() | Cylinder() | Cone():
                message.primitives.append(_primitive(shape))
                message.primitive_poses.append(pose)
    message.subframe_names = list(details.subframes)
    message.subframe_poses = [pose_message(each) for each in details.subframes.values()]
    return message


def matrix_message(allowed: AllowedCollisionMatrix) -> MatrixMessage:
    """Return what may touch as a moveit_msgs/AllowedCollisionMatrix."""
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
    """Return shapes that a message has: a capsule is a cylinder with a sphere on either end."""
    shape, pose = placed.shape, placed.pose
    if not isinstance(shape, Capsule):
        return (placed,)
    half = 0.5 * shape.length * pose.rotation[:, 2]
    ends = (Pose(pose.rotation, pose.position + side * half) for side in (-1, 1))
    caps = (PlacedShape(Sphere(shape.radius), end) for end in ends)
    return (PlacedShape(Cylinder(shape.radius, shape.length), pose), *caps)


def _plane(plane: Plane) -> PlaneMessage:
    """Return a plane as a shape_msgs/Plane."""
    length = float(np.linalg.norm(plane.normal))
    return PlaneMessage(coef=[*plane.normal, -plane.offset * length])


def _mesh(mesh: Mesh) -> MeshMessage:
    """Return the surface of a hull as a shape_msgs/Mesh."""
    hull = mesh.hull
    faces = (hull.polygons(number) for number in range(hull.num_polygons))
    triangles = [MeshTriangle(vertex_indices=[face[0], face[1], face[2]]) for face in faces]
    return MeshMessage(triangles=triangles, vertices=[point_message(each) for each in mesh.points])

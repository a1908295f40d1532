# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scene as MoveIt's messages; :class:`.SceneEdit` is the way back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from geometry_msgs.msg import Transform, TransformStamped, Vector3
from moveit_msgs.msg import (
    AllowedCollisionEntry,
    AttachedCollisionObject,
    LinkPadding,
    LinkScale,
    ObjectColor,
    PlanningSceneComponents,
    PlanningSceneWorld,
)
from moveit_msgs.msg import AllowedCollisionMatrix as MatrixMessage
from moveit_msgs.msg import CollisionObject as ObjectMessage
from moveit_msgs.msg import PlanningScene as SceneMessage
from moveit_msgs.msg import RobotState as StateMessage
from object_recognition_msgs.msg import ObjectType
from std_msgs.msg import ColorRGBA, Header

from arm_model import (
    AllowedCollisionMatrix,
    Box,
    CollisionObject,
    Cone,
    Cylinder,
    Mesh,
    OCTOMAP_NAME,
    Plane,
    Pose,
    Sphere,
)

from .geometry import as_primitives, mesh_message, plane_message, pose_message, primitive_message
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
    message = SceneMessage(robot_model_name=robot_name)
    # as MoveIt: an answer with parts only is a change
    message.is_diff = message.robot_state.is_diff = components != ALL_COMPONENTS
    message.name = snapshot.name
    if components & has.TRANSFORMS:
        message.fixed_frame_transforms = _transforms(snapshot)
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
        message.object_colors = _colors(snapshot.colors)
    if components & has.WORLD_OBJECT_GEOMETRY:
        message.world = world_message(snapshot)
    elif components & has.WORLD_OBJECT_NAMES:
        names = snapshot.scene.objects
        message.world.collision_objects = [
            _identified(name, snapshot.details[name], snapshot.root)
            for name in names
            if name != OCTOMAP_NAME
        ]
    if components & has.OCTOMAP and snapshot.octomap is not None:
        message.world.octomap = snapshot.octomap
    return message


def world_message(snapshot: SceneSnapshot) -> PlanningSceneWorld:
    """Return the objects of the world as a moveit_msgs/PlanningSceneWorld."""
    return PlanningSceneWorld(
        collision_objects=[
            object_message(each, snapshot.details[name], snapshot.root)
            for name, each in snapshot.scene.objects.items()
            if name != OCTOMAP_NAME
        ]
    )


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
    for placed in (part for each in thing.shapes for part in as_primitives(each)):
        shape, pose = placed.shape, pose_message(placed.pose)
        match shape:
            case Mesh():
                message.meshes.append(next(meshes, None) or mesh_message(shape))
                message.mesh_poses.append(pose)
            case Plane():
                message.planes.append(plane_message(shape))
                message.plane_poses.append(pose)
            case Box() | Sphere() | Cylinder() | Cone():
                message.primitives.append(primitive_message(shape))
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


def _colors(colors: Mapping[str, Iterable[float]]) -> Sequence[ObjectColor]:
    return [
        ObjectColor(id=name, color=ColorRGBA(**dict(zip('rgba', color, strict=True))))
        for name, color in colors.items()
    ]


def _transforms(snapshot: SceneSnapshot) -> Sequence[TransformStamped]:
    return [
        TransformStamped(
            header=Header(frame_id=snapshot.root), child_frame_id=name, transform=_transform(pose)
        )
        for name, pose in snapshot.fixed_frames.items()
    ]


def _transform(pose: Pose) -> Transform:
    placed: Any = pose_message(pose)
    place = placed.position
    return Transform(
        translation=Vector3(x=place.x, y=place.y, z=place.z), rotation=placed.orientation
    )

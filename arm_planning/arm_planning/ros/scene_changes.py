# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Changes of the shared scene by MoveIt's messages: each message is applied whole or not at all.

:mod:`arm_model.ros` reads collision geometry; this module adds details that collision checks do
not use, frames of objects, and error codes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from moveit_msgs.msg import CollisionObject as ObjectMessage
import numpy as np
from octomap_msgs.msg import OctomapWithPose
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

from arm_model import (
    AllowedCollisionMatrix,
    Array,
    combined,
    LinkNameError,
    ObjectNameError,
    Places,
    PlanningScene,
    Pose,
    SceneError,
)
from arm_model.ros import apply_planning_scene, hull_of, pose_of

from ..exceptions import coded, PlanningCode, PlanningError
from .scene import AttachedDetails, ObjectDetails, pose_message, SceneSnapshot

CODES = (
    (LinkNameError, PlanningCode.INVALID_LINK_NAME),
    (ObjectNameError, PlanningCode.INVALID_OBJECT_NAME),
)
"""MoveIt's error codes of refused scenes; other refusals get FAILURE."""

MIN_THICKNESS = 1e-6  # least extent of a mesh along its thinnest axis in [m] that is a volume


def apply_scene(snapshot: SceneSnapshot, message: Any, positions: Array) -> SceneSnapshot:  # noqa: ANN401
    """Apply a moveit_msgs/PlanningScene, a diff or a whole scene; return the new scene."""
    before = snapshot
    if not message.is_diff:  # what a whole scene replaces besides its objects
        before = replace(before, colors={}, fixed_frames={}, octomap=None)
    before = replace(
        before,
        name=message.name or snapshot.name,
        fixed_frames=_fixed(before, message.fixed_frame_transforms, positions),
    )
    before = replace(before, octomap=_octomap(before, message.world.octomap, positions))
    bodies = message.robot_state.attached_collision_objects
    things = [*message.world.collision_objects, *(each.object for each in bodies)]
    for each in things:
        for mesh in each.meshes:
            if problem := _problem(*_arrays(mesh)):
                raise PlanningError(PlanningCode.FAILURE, f'object {each.id!r}: {problem}')
    try:
        scene = apply_planning_scene(
            before.scene, message, positions, lambda frame: before.frame(frame, positions)
        )
    except SceneError as error:
        codes = (code for kind, code in CODES if isinstance(error, kind))
        raise PlanningError(next(codes, PlanningCode.FAILURE), str(error)) from error
    colors = {
        each.id: (each.color.r, each.color.g, each.color.b, each.color.a)
        for each in message.object_colors
    }
    return _described(before, scene, things, bodies, {**before.colors, **colors})


def scene_for(snapshot: SceneSnapshot, robot_alone: PlanningScene) -> PlanningScene:
    """Return the scene in which a group of the robot moves.

    Pairs allowed in the first scene of the group's model stay allowed if the matrix of the
    scene has neither an entry for them nor a default for a name.
    """
    whole, alone = snapshot.scene, robot_alone.allowed.entries
    defaults = whole.allowed.defaults.keys()
    entries = {pair: allowed for pair, allowed in alone.items() if not pair & defaults}
    entries |= whole.allowed.entries
    return robot_alone.with_contents(
        objects=whole.objects,
        attached_bodies=whole.attached_bodies,
        allowed=AllowedCollisionMatrix(entries, whole.allowed.defaults),
        padding=whole.padding,
        scale=whole.scale,
    )


def _described(
    before: SceneSnapshot,
    scene: PlanningScene,
    things: Iterable[Any],
    bodies: Iterable[Any],
    colors: Mapping[str, tuple[float, float, float, float]],
) -> SceneSnapshot:
    """Return a scene with the further details of objects from messages."""
    details, attached = dict(before.details), dict(before.attached_details)
    for message in things:
        if message.primitives or message.meshes or message.planes:
            read = _details(message)
            is_more = message.operation == ObjectMessage.APPEND and message.id in details
            details[message.id] = _joined(details[message.id], read) if is_more else read
    for body in bodies:
        attached[body.object.id] = AttachedDetails(body.detach_posture, body.weight)
    names = {*scene.objects, *scene.attached_bodies}
    return replace(
        before,
        scene=scene,
        details={name: details.get(name, ObjectDetails()) for name in names},
        attached_details={name: attached[name] for name in scene.attached_bodies},
        colors={name: color for name, color in colors.items() if name in names},
    )


def _details(message: Any) -> ObjectDetails:  # noqa: ANN401
    what = f'object {message.id!r}'
    if len(message.subframe_names) != len(message.subframe_poses):
        raise PlanningError(
            PlanningCode.FAILURE,
            f'{what}: {len(message.subframe_names)} names of subframes and'
            f' {len(message.subframe_poses)} poses',
        )
    pairs = zip(message.subframe_names, message.subframe_poses, strict=True)
    with coded():
        subframes = {
            name: pose_of(each.position, each.orientation, f'subframe {name!r} of {what}')
            for name, each in pairs
        }
    solid, whole = (
        sum(each) for each in zip((0.0, 0.0), *map(_volumes, message.meshes), strict=True)
    )
    fullness = solid / whole if whole else 1.0
    prisms = [None for each in message.primitives if each.type == SolidPrimitive.PRISM]
    meshes = (*prisms, *message.meshes)
    return ObjectDetails(message.type.key, message.type.db, subframes, meshes, fullness)


def _joined(before: ObjectDetails, added: ObjectDetails) -> ObjectDetails:
    return replace(
        before,
        subframes={**before.subframes, **added.subframes},
        meshes=(*before.meshes, *added.meshes),
        fullness=min(before.fullness, added.fullness),
    )


def _octomap(snapshot: SceneSnapshot, message: Any, positions: Array) -> Any:  # noqa: ANN401
    """Return the octomap after a octomap_msgs/OctomapWithPose, in the root link; None for none."""
    if not message.octomap.id:
        return snapshot.octomap
    if not message.octomap.data:
        return None
    frame = snapshot.frame(message.header.frame_id, positions)
    origin = message.origin
    with coded():
        in_frame = pose_of(origin.position, origin.orientation, 'origin of the octomap')
    header = Header(frame_id=snapshot.root, stamp=message.header.stamp)
    return OctomapWithPose(
        header=header, origin=pose_message(combined(frame, in_frame)), octomap=message.octomap
    )


def _fixed(
    snapshot: SceneSnapshot, transforms: Iterable[Any], positions: Array
) -> Mapping[str, Pose]:
    found = dict(snapshot.fixed_frames)
    for each in transforms:
        name, place = each.child_frame_id.removeprefix('/'), each.transform
        with coded():
            pose = pose_of(place.translation, place.rotation, f'frame {name!r}')
        found[name] = combined(snapshot.frame(each.header.frame_id, positions), pose)
    return found


def _volumes(message: Any) -> tuple[float, float]:  # noqa: ANN401
    """Return the volumes of a closed shape_msgs/Mesh and of its hull; 0 for an open one."""
    corners, triangles = _arrays(message)
    hull = hull_of(corners.tobytes()).hull
    corners, same = np.unique(corners, axis=0, return_inverse=True)
    triangles = same.reshape(-1)[triangles]
    edges = np.sort(triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    if (np.unique(edges, axis=0, return_counts=True)[1] % 2).any():
        return 0.0, 0.0
    a, b, c = (corners[triangles[:, each]] for each in range(3))
    return abs(float((a * np.cross(b, c)).sum()) / 6.0), float(hull.computeVolume())


def _arrays(message: Any) -> tuple[Array, Places]:  # noqa: ANN401
    """Return corners (m, 3) in [m], and the three numbers of each triangle (n, 3)."""
    corners = np.array([(each.x, each.y, each.z) for each in message.vertices], dtype=float)
    triangles = np.array([each.vertex_indices for each in message.triangles], dtype=int)
    return corners.reshape(-1, 3), triangles.reshape(-1, 3)


def _problem(corners: Array, triangles: Places) -> str:
    """Return why corners and triangles of a mesh form no body; empty if they do."""
    if not len(triangles) or not len(corners):
        return f'a mesh of {len(corners)} vertices and {len(triangles)} triangles has no volume'
    if triangles.max() >= len(corners):
        return f'a triangle names vertex {triangles.max()}; there are {len(corners)}'
    if not np.isfinite(corners).all():
        return 'a vertex of a mesh is not finite'
    centered = corners - corners.mean(axis=0)
    _, axes = np.linalg.eigh(centered.T @ centered)
    if np.ptp(centered @ axes, axis=0).min() < MIN_THICKNESS:
        return 'the mesh is flat, it has no volume; use a thin box, or a plane'
    return ''

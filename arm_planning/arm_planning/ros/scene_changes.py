# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Changes of the shared scene by MoveIt's messages: a message counts as a whole or not at all.

:mod:`arm_model.ros` reads what may collide; here are the parts that collisions do not need, frames
of objects, and the codes of refusals.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from moveit_msgs.msg import CollisionObject as ObjectMessage
from octomap_msgs.msg import OctomapWithPose
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Header

from arm_model import (
    AllowedCollisionMatrix,
    Array,
    combined,
    LinkNameError,
    ObjectNameError,
    PlanningScene,
    Pose,
    SceneError,
)
from arm_model.ros import (
    apply_attached_object,
    apply_collision_object,
    apply_planning_scene,
    FrameOf,
    xyz,
    xyzw,
)

from ..exceptions import PlanningCode, PlanningError
from .geometry import check_mesh, placement, pose_message, pose_of, volumes
from .scene_snapshot import AttachedDetails, ObjectDetails, SceneSnapshot


def apply_scene(
    snapshot: SceneSnapshot,
    message: Any,  # noqa: ANN401  # message classes have no type
    positions: Array,
) -> SceneSnapshot:
    """Return a scene after a moveit_msgs/PlanningScene: a change, or a whole scene.

    Args:
        positions: Positions of all joints of the robot in [rad].

    Raises:
        PlanningError: A part of it is refused.
    """
    before = snapshot if message.is_diff else _without_settings(snapshot)
    before = replace(
        before,
        name=message.name or snapshot.name,
        fixed_frames=_fixed(before, message.fixed_frame_transforms, positions),
    )
    before = replace(before, octomap=_octomap(before, message.world.octomap, positions))
    bodies = message.robot_state.attached_collision_objects
    _check_meshes([*message.world.collision_objects, *(each.object for each in bodies)])
    with _refused():
        scene = apply_planning_scene(
            before.scene, message, positions, _frame_of(before, positions)
        )
    colors = {
        each.id: (each.color.r, each.color.g, each.color.b, each.color.a)
        for each in message.object_colors
    }
    after = replace(before, colors={**before.colors, **colors})
    return _described(after, scene, message.world.collision_objects, bodies)


def apply_object(
    snapshot: SceneSnapshot,
    message: Any,  # noqa: ANN401
    positions: Array,
) -> SceneSnapshot:
    """Return a scene after a moveit_msgs/CollisionObject.

    Args:
        positions: Positions of all joints of the robot in [rad].

    Raises:
        PlanningError: It is refused.
    """
    _check_meshes([message])
    with _refused():
        scene = apply_collision_object(
            snapshot.scene, message, positions, _frame_of(snapshot, positions)
        )
    return _described(snapshot, scene, [message], [])


def apply_attached(
    snapshot: SceneSnapshot,
    message: Any,  # noqa: ANN401
    positions: Array,
) -> SceneSnapshot:
    """Return a scene after a moveit_msgs/AttachedCollisionObject.

    Args:
        positions: Positions of all joints of the robot in [rad].

    Raises:
        PlanningError: It is refused.
    """
    _check_meshes([message.object])
    with _refused():
        scene = apply_attached_object(
            snapshot.scene, message, positions, _frame_of(snapshot, positions)
        )
    return _described(snapshot, scene, [], [message])


def scene_for(snapshot: SceneSnapshot, robot_alone: PlanningScene) -> PlanningScene:
    """Return the scene as a group of the robot moves in it.

    Args:
        robot_alone: The first scene of the group's model: pairs that it allows stay allowed where
            the matrix of the scene has neither an entry of them nor a default of a name.
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


@contextmanager
def _refused() -> Iterator[None]:
    """Give refusals of the scene the code that MoveIt has for them."""
    try:
        yield
    except LinkNameError as error:
        raise PlanningError(PlanningCode.INVALID_LINK_NAME, str(error)) from error
    except ObjectNameError as error:
        raise PlanningError(PlanningCode.INVALID_OBJECT_NAME, str(error)) from error
    except SceneError as error:
        raise PlanningError(PlanningCode.FAILURE, str(error)) from error


def _check_meshes(messages: Iterable[Any]) -> None:
    for message in messages:
        for mesh in message.meshes:
            check_mesh(mesh, f'object {message.id!r}')


def _frame_of(snapshot: SceneSnapshot, positions: Array) -> FrameOf:
    return lambda frame: snapshot.frame(frame, positions)


def _described(
    before: SceneSnapshot, scene: PlanningScene, objects: Iterable[Any], bodies: Sequence[Any]
) -> SceneSnapshot:
    """Return the next version of a scene, with what messages say of objects besides."""
    details, attached = dict(before.details), dict(before.attached_details)
    for message in (*objects, *(body.object for body in bodies)):
        if message.primitives or message.meshes or message.planes:
            read = _details(message)
            is_more = message.operation == ObjectMessage.APPEND and message.id in details
            details[message.id] = _joined(details[message.id], read) if is_more else read
    for body in bodies:
        attached[body.object.id] = AttachedDetails(body.detach_posture, body.weight)
    things = {*scene.objects, *scene.attached_bodies}
    return replace(
        before,
        scene=scene,
        version=before.version + 1,
        details={name: details.get(name, ObjectDetails()) for name in things},
        attached_details={name: attached[name] for name in scene.attached_bodies},
        colors={name: color for name, color in before.colors.items() if name in things},
    )


def _details(message: Any) -> ObjectDetails:  # noqa: ANN401
    what = f'object {message.id!r}'
    if len(message.subframe_names) != len(message.subframe_poses):
        raise PlanningError(
            PlanningCode.FAILURE,
            f'{what}: {len(message.subframe_names)} names of subframes and'
            f' {len(message.subframe_poses)} poses',
        )
    subframes = {
        name: pose_of(each, f'subframe {name!r} of {what}')
        for name, each in zip(message.subframe_names, message.subframe_poses, strict=True)
    }
    solid, whole = (
        sum(each) for each in zip((0.0, 0.0), *map(volumes, message.meshes), strict=True)
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


def _without_settings(snapshot: SceneSnapshot) -> SceneSnapshot:
    """Return a scene without what a whole scene replaces besides its objects."""
    return replace(snapshot, colors={}, fixed_frames={}, octomap=None)


def _octomap(snapshot: SceneSnapshot, message: Any, positions: Array) -> Any:  # noqa: ANN401
    """Return the octomap after a octomap_msgs/OctomapWithPose, in the root link; None for none."""
    if not message.octomap.id:
        return snapshot.octomap
    if not message.octomap.data:
        return None
    frame = snapshot.frame(message.header.frame_id, positions)
    place = combined(frame, pose_of(message.origin, 'origin of the octomap'))
    header = Header(frame_id=snapshot.root, stamp=message.header.stamp)
    return OctomapWithPose(header=header, origin=pose_message(place), octomap=message.octomap)


def _fixed(
    snapshot: SceneSnapshot, transforms: Iterable[Any], positions: Array
) -> Mapping[str, Pose]:
    found = dict(snapshot.fixed_frames)
    frame_of = _frame_of(snapshot, positions)
    for each in transforms:
        name, place = each.child_frame_id.removeprefix('/'), each.transform
        pose = placement(xyz(place.translation), xyzw(place.rotation), f'frame {name!r}')
        found[name] = combined(frame_of(each.header.frame_id), pose)
    return found

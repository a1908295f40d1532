# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes of moveit_msgs: what they add, attach, move, remove and allow, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence

from geometry_msgs.msg import Point, Point32, Polygon, Pose
from model_robots import chain, ready, robot
from moveit_msgs.msg import (
    AllowedCollisionEntry,
    AllowedCollisionMatrix,
    AttachedCollisionObject,
    CollisionObject,
    PlanningScene,
    PlanningSceneWorld,
    RobotState,
)
import numpy as np
import pytest
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import Plane as PlaneMessage
from shape_msgs.msg import SolidPrimitive

from arm_model import Array, Box, Cone, Cylinder, Mesh, Plane, SceneError, Shape, Sphere
from arm_model import PlanningScene as Scene
from arm_model.ros import apply_planning_scene, FrameOf, scene_change

MODEL = chain('zyyp')
AT = np.array([0.4, -0.3, 0.5, 0.1])


def thing(
    name: str = 'box',
    place: Sequence[float] = (0.5, 0.0, 0.2),
    *,
    frame: str = '',
    operation: bytes = CollisionObject.ADD,
    primitive: SolidPrimitive | None = None,
) -> CollisionObject:
    """Return a box at a place, or another primitive."""
    x, y, z = map(float, place)
    shape = primitive or SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.2, 0.3])
    message = CollisionObject(id=name, operation=operation)
    message.header.frame_id = frame
    message.pose = Pose(position=Point(x=x, y=y, z=z))
    if operation in {CollisionObject.ADD, CollisionObject.APPEND}:
        message.primitives = [shape]
    return message


def attached(
    name: str, link: str, *, operation: bytes, bare: bool = True
) -> AttachedCollisionObject:
    """Return what attaches or detaches an object."""
    message = AttachedCollisionObject(link_name=link, touch_links=['link_3'])
    message.object = thing(name, frame=link, operation=operation)
    if bare:
        message.object.primitives = []
    return message


def changed(
    scene: Scene,
    message: CollisionObject | AttachedCollisionObject,
    positions: Array,
    frame_of: FrameOf | None = None,
) -> Scene:
    """Return a scene after a message of an object or an attached body."""
    return apply_planning_scene(scene, scene_change(message), positions, frame_of)


@pytest.mark.parametrize(
    ('kind', 'dimensions', 'shape'),
    [
        (SolidPrimitive.BOX, [0.1, 0.2, 0.3], Box(0.1, 0.2, 0.3)),
        (SolidPrimitive.SPHERE, [0.1], Sphere(0.1)),
        (SolidPrimitive.CYLINDER, [0.4, 0.1], Cylinder(0.1, 0.4)),
        (SolidPrimitive.CONE, [0.4, 0.1], Cone(0.1, 0.4)),
    ],
)
def test_primitives_have_their_lengths(kind: int, dimensions: list[float], shape: Shape) -> None:
    """The height of a cylinder comes first in the message."""
    primitive = SolidPrimitive(type=kind, dimensions=dimensions)
    scene = changed(MODEL.scene, thing(primitive=primitive), AT)
    assert [each.shape for each in scene.objects['box'].shapes] == [shape]
    assert scene.objects['box'].pose.position.tolist() == [0.5, 0.0, 0.2]


def test_prisms_meshes_and_planes() -> None:
    """A prism and a mesh are their hulls, a plane is solid below."""
    corners = [Point32(x=x, y=y) for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))]
    message = thing(
        primitive=SolidPrimitive(
            type=SolidPrimitive.PRISM, dimensions=[0.5], polygon=Polygon(points=corners)
        )
    )
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    message.meshes = [MeshMessage(vertices=[Point(x=x, y=y, z=z) for x, y, z in points])]
    message.planes = [PlaneMessage(coef=[0.0, 0.0, 2.0, 0.2])]
    shapes = [each.shape for each in changed(MODEL.scene, message, AT).objects['box'].shapes]
    prism, mesh, plane = shapes
    assert isinstance(prism, Mesh)
    assert min(map(tuple, prism.points.round(6).tolist())) == (0.0, 0.0, -0.25)
    assert len(prism.points) == 6
    assert mesh == Mesh(points)
    assert plane == Plane((0.0, 0.0, 2.0), -0.1)


def test_a_pose_is_in_its_frame() -> None:
    """A link of the robot where the arm is, or what the caller knows; else it is refused."""
    turned = changed(MODEL.scene, thing(frame='link_2'), AT)
    link = MODEL.scene.kinematics.link_pose('link_2', AT)
    there = link.position + link.rotation @ (0.5, 0.0, 0.2)
    assert turned.objects['box'].pose.position == pytest.approx(there)
    known = changed(MODEL.scene, thing(frame='camera'), AT, lambda _: link)
    assert known.objects['box'].pose.position == pytest.approx(there)
    with pytest.raises(SceneError, match="'box': no frame 'camera'; links: base"):
        changed(MODEL.scene, thing(frame='camera'), AT)


def test_an_object_is_moved_extended_and_removed() -> None:
    """APPEND keeps the shapes that are there, MOVE all of them, REMOVE without an id nothing."""
    scene = changed(MODEL.scene, thing(), AT)
    scene = changed(scene, thing(place=(0.5, 0.0, 0.9), operation=CollisionObject.APPEND), AT)
    first, second = scene.objects['box'].shapes
    assert second.pose.position - first.pose.position == pytest.approx([0.0, 0.0, 0.7])
    moved = changed(scene, thing(place=(1.0, 0.0, 0.0), operation=CollisionObject.MOVE), AT)
    assert moved.objects['box'].shapes == scene.objects['box'].shapes
    assert moved.objects['box'].pose.position.tolist() == [1.0, 0.0, 0.0]
    assert scene.objects['box'].pose.position.tolist() == [0.5, 0.0, 0.2]
    gone = changed(moved, thing('', operation=CollisionObject.REMOVE), AT)
    assert not gone.objects
    with pytest.raises(SceneError, match="no object 'box' in the world; there are: none"):
        changed(gone, thing(operation=CollisionObject.REMOVE), AT)
    with pytest.raises(SceneError, match="no object 'box' in the world"):
        changed(gone, thing(operation=CollisionObject.MOVE), AT)


def test_the_pose_of_the_only_shape_is_that_of_the_object() -> None:
    """As in MoveIt, where the object's own is left out: MOVE, frames and clients count on it."""
    alone = thing(place=(0.0, 0.0, 0.0))
    alone.primitive_poses = [Pose(position=Point(x=0.5, y=0.1, z=0.3))]
    scene = changed(MODEL.scene, alone, AT)
    (shape,) = scene.objects['box'].shapes
    assert scene.objects['box'].pose.position.tolist() == [0.5, 0.1, 0.3]
    assert shape.pose.position.tolist() == [0.0, 0.0, 0.0]
    moved = changed(scene, thing(place=(0.5, -0.1, 0.3), operation=CollisionObject.MOVE), AT)
    assert moved.objects['box'].pose.position.tolist() == [0.5, -0.1, 0.3]
    assert moved.objects['box'].shapes == scene.objects['box'].shapes
    alone.pose.position.x = 1.0
    both = changed(MODEL.scene, alone, AT).objects['box']
    assert both.pose.position.tolist() == [1.0, 0.0, 0.0]
    assert both.shapes[0].pose.position.tolist() == [0.5, 0.1, 0.3]


def place_of(scene: Scene, name: str, positions: Array) -> Array:
    """Return where an object is."""
    return scene.pose(name, positions).position


def test_an_object_is_taken_up_carried_and_laid_down() -> None:
    """It keeps its place when it is attached, and moves with the link."""
    scene = changed(MODEL.scene, thing(), AT)
    held = changed(scene, attached('box', 'link_4', operation=b'\0'), AT)
    assert not held.objects
    assert held.attached_bodies['box'].touch_links == {'link_3'}
    assert place_of(held, 'box', AT) == pytest.approx([0.5, 0.0, 0.2])
    later = AT + 0.3
    down = changed(held, attached('box', '', operation=b'\1'), later)
    assert place_of(down, 'box', AT) == pytest.approx(place_of(held, 'box', later))
    assert not down.attached_bodies
    with_shapes = attached('cup', 'link_4', operation=b'\0', bare=False)
    cup = changed(scene, with_shapes, AT)
    assert cup.attached_bodies['cup'].object.pose.position == pytest.approx([0.5, 0.0, 0.2])
    for message, words in (
        (attached('cup', 'link_4', operation=b'\0'), 'has no shapes'),
        (attached('box', 'link_9', operation=b'\0'), "no link 'link_9'"),
        (attached('cup', '', operation=b'\1'), "no attached object 'cup'"),
    ):
        with pytest.raises(SceneError, match=words):
            changed(scene, message, AT)


def matrix(names: Sequence[str], *allowed: tuple[str, str]) -> AllowedCollisionMatrix:
    """Return a matrix in which some pairs may touch."""
    pairs = set(map(frozenset, allowed))
    rows = [
        AllowedCollisionEntry(enabled=[frozenset((one, other)) in pairs for other in names])
        for one in names
    ]
    return AllowedCollisionMatrix(entry_names=names, entry_values=rows)


def scene_message(
    *objects: CollisionObject, held: Sequence[AttachedCollisionObject] = (), is_diff: bool = False
) -> PlanningScene:
    """Return a message."""
    state = RobotState(attached_collision_objects=list(held), is_diff=is_diff)
    world = PlanningSceneWorld(collision_objects=list(objects))
    return PlanningScene(world=world, robot_state=state, is_diff=is_diff)


def test_a_whole_scene_replaces_and_a_diff_changes() -> None:
    """An attach comes as a body and the removal of its object, as MoveIt sends it."""
    scene = apply_planning_scene(MODEL.scene, scene_message(thing(), thing('cup')), AT)
    assert set(scene.objects) == {'box', 'cup'}
    grasp = scene_message(
        thing(operation=CollisionObject.REMOVE),
        held=[attached('box', 'link_4', operation=b'\0', bare=False)],
        is_diff=True,
    )
    grasp.allowed_collision_matrix = matrix(['cup', 'link_2'], ('cup', 'link_2'))
    held = apply_planning_scene(scene, grasp, AT)
    assert set(held.objects) == {'cup'}
    assert set(held.attached_bodies) == {'box'}
    assert held.allowed.allows('cup', 'link_2')
    assert ('link_1', 'link_3') in {*held.pairs}
    same = apply_planning_scene(held, PlanningScene(is_diff=True), AT)
    assert set(same.attached_bodies) == {'box'}
    again = apply_planning_scene(held, scene_message(thing('post')), AT)
    assert (set(again.objects), set(again.attached_bodies)) == ({'post'}, set())


def test_links_that_a_matrix_does_not_name_keep_what_they_had() -> None:
    """The SRDF and what touches by design; entries of objects that are gone do not come back."""
    panda, at = robot('panda'), ready('panda')
    links = set(panda.frames)
    before = {pair for pair in panda.scene.allowed.entries if pair <= links}
    assert before
    message = scene_message(thing(place=(2.0, 0.0, 0.0)))
    message.allowed_collision_matrix = matrix(['box', 'panda_hand'], ('box', 'panda_hand'))
    scene = apply_planning_scene(panda.scene, message, at)
    assert scene.allowed.allows('box', 'panda_hand')
    assert all(scene.allowed.allows(*pair) for pair in before)
    message.allowed_collision_matrix = matrix(['cup', 'panda_hand'])
    assert not apply_planning_scene(scene, message, at).allowed.allows('box', 'panda_hand')

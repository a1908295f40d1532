# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes from MoveIt's messages and back: nothing is lost, and what is wrong is refused."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from geometry_msgs.msg import Point32
from hypothesis import given, settings
from hypothesis import strategies as st
from moveit_msgs.msg import (
    AllowedCollisionEntry,
    AttachedCollisionObject,
    LinkPadding,
    LinkScale,
    ObjectColor,
    PlanningScene,
    PlanningSceneComponents,
    RobotState,
)
from moveit_msgs.msg import AllowedCollisionMatrix as MatrixMessage
from moveit_msgs.msg import CollisionObject as ObjectMessage
import numpy as np
from planning_messages import (
    box,
    numbers_of,
    objects,
    panda,
    pose_at,
    poses,
    tetrahedron,
    texts_of,
)
import pytest
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive

from arm_model import AllowedCollisionMatrix, Clearances
from arm_model.ros import allowed_collisions, apply_planning_scene
from arm_planning import PlanningCode, PlanningError
from arm_planning.ros.scene_changes import apply_attached, apply_object, apply_scene, scene_for
from arm_planning.ros.scene_messages import (
    collision_message,
    matrix_message,
    object_message,
    scene_message,
)
from arm_planning.ros.scene_snapshot import SceneSnapshot

READY = panda().positions(
    dict(zip(panda().joints, [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], strict=False))
)
EMPTY = SceneSnapshot(panda().scene)
NAMES = ['table', 'cup', 'panda_link1', 'panda_link5', 'tool']
TIP = 'panda_link8'


def edited(message: PlanningScene, snapshot: SceneSnapshot = EMPTY) -> SceneSnapshot:
    """Return a scene after a message."""
    return apply_scene(snapshot, message, READY)


def with_objects(*messages: Any, snapshot: SceneSnapshot = EMPTY) -> SceneSnapshot:
    """Return a scene after messages of objects."""
    for message in messages:
        snapshot = apply_object(snapshot, message, READY)
    return snapshot


def attached(
    name: str, link: str = TIP, *, snapshot: SceneSnapshot = EMPTY, **fields: Any
) -> SceneSnapshot:
    """Return a scene in which an object of the world is attached."""
    message = AttachedCollisionObject(link_name=link, object=ObjectMessage(id=name), **fields)
    return apply_attached(snapshot, message, READY)


@settings(deadline=None, max_examples=40)
@given(message=objects())
def test_an_object_comes_back_as_it_was(message: ObjectMessage) -> None:
    """Shapes, poses, planes, meshes with their triangles, subframes and type."""
    snapshot = with_objects(message)
    back = object_message(
        snapshot.scene.objects['thing'], snapshot.details['thing'], snapshot.root
    )
    assert numbers_of(back) == pytest.approx(numbers_of(message), abs=1e-9)
    assert texts_of(back) == texts_of(message)


def test_a_mesh_beside_a_prism_comes_back_as_it_was() -> None:
    """A prism, which counts as its hull, does not take its place."""
    message = box('thing', 0.5, 0.0, 0.2)
    corners = [Point32(x=x, y=y) for x, y in ((0.0, 0.0), (0.1, 0.0), (0.0, 0.1))]
    prism = SolidPrimitive(type=SolidPrimitive.PRISM, dimensions=[0.2])
    prism.polygon.points = corners
    message.primitives.append(prism)
    message.primitive_poses.append(pose_at(0.3))
    message.meshes, message.mesh_poses = [tetrahedron(0.1)], [pose_at(0.6)]
    snapshot = with_objects(message)
    back = object_message(
        snapshot.scene.objects['thing'], snapshot.details['thing'], snapshot.root
    )
    assert [len(each.vertices) for each in back.meshes] == [6, 4]
    assert back.meshes[1] == message.meshes[0]
    assert back.mesh_poses[1] == message.mesh_poses[0]


@pytest.mark.slow
@settings(deadline=None, max_examples=20)
@given(first=objects('table'), second=objects('cup'), held=objects('tool'), data=st.data())
def test_a_whole_scene_comes_back_as_it_was(
    first: ObjectMessage, second: ObjectMessage, held: ObjectMessage, data: st.DataObject
) -> None:
    """What get_planning_scene answers makes the same scene elsewhere."""
    message = PlanningScene(name='lab', link_padding=[LinkPadding(link_name=TIP, padding=0.0)])
    message.link_padding.append(LinkPadding(link_name='panda_link5', padding=0.01))
    message.link_scale = [LinkScale(link_name='panda_link5', scale=1.1)]
    message.world.collision_objects = [first, second]
    message.object_colors = [ObjectColor(id='cup')]
    message.object_colors[0].color.r = 0.5
    held.pose = data.draw(poses())
    message.robot_state.attached_collision_objects = (
        [
            AttachedCollisionObject(
                link_name=TIP, object=held, touch_links=['panda_hand'], weight=0.5
            )
        ]
        if 'panda_hand' in panda().kinematics.frames
        else [AttachedCollisionObject(link_name=TIP, object=held, weight=0.5)]
    )
    once = edited(message)
    sent = scene_message(once, panda().name, RobotState())
    assert not sent.is_diff
    twice = edited(sent)
    back = scene_message(twice, panda().name, RobotState())
    assert numbers_of(back) == pytest.approx(numbers_of(sent), abs=1e-9)
    assert texts_of(back) == texts_of(sent)
    assert list(twice.scene.pairs) == list(once.scene.pairs)


@settings(deadline=None, max_examples=20)
@given(thing=objects('thing'), held=objects('held'))
def test_controllers_make_the_scene_that_the_planner_has(
    thing: ObjectMessage, held: ObjectMessage
) -> None:
    """Of what is published for them; objects with meshes, attached ones too."""
    message = PlanningScene(link_padding=[LinkPadding(link_name=TIP, padding=0.01)])
    message.world.collision_objects = [thing]
    message.robot_state.attached_collision_objects = [
        AttachedCollisionObject(link_name=TIP, object=held)
    ]
    planned = edited(message)
    sent = collision_message(planned, panda().name)
    assert not any(mesh.triangles for each in sent.world.collision_objects for mesh in each.meshes)
    made = apply_planning_scene(panda().scene, sent, READY)
    assert made.pairs == planned.scene.pairs
    one, other = (Clearances(each).least(READY, math.inf) for each in (planned.scene, made))
    apart = one > 1e-3  # of shapes deep in each other, two ways out may be found
    assert one[apart] == pytest.approx(other[apart], abs=1e-4)


@given(
    entries=st.dictionaries(
        st.lists(st.sampled_from(NAMES), min_size=2, max_size=2, unique=True).map(frozenset),
        st.booleans(),
    ),
    defaults=st.dictionaries(st.sampled_from(NAMES), st.booleans()),
)
def test_a_matrix_allows_the_same_after_a_message(
    entries: dict[frozenset[str], bool], defaults: dict[str, bool]
) -> None:
    """For every pair of its names, and for those with a name that it does not have."""
    matrix = AllowedCollisionMatrix(entries, defaults)
    back = allowed_collisions(matrix_message(matrix))
    for first in NAMES:
        for second in (*NAMES, 'new'):
            assert back.allows(first, second) == matrix.allows(first, second)
    assert back.defaults == matrix.defaults
    assert not any(back.entries[pair] for pair in back.entries.keys() - entries.keys())
    assert allowed_collisions(matrix_message(back)) == back


def test_a_change_changes_what_it_names() -> None:
    """ADD, MOVE, APPEND and REMOVE; each is a new version, and the one before stays as it was."""
    first = with_objects(box('box', 0.5, 0.0, 0.2), box('other', 0.0, 0.8, 0.2))
    assert (first.version, set(first.scene.objects)) == (2, {'box', 'other'})
    moved = with_objects(
        ObjectMessage(id='box', pose=pose_at(0.0, 0.6, 0.0), operation=ObjectMessage.MOVE),
        snapshot=first,
    )
    assert moved.scene.objects['box'].pose.position == pytest.approx([0.0, 0.6, 0.0])
    assert first.scene.objects['box'].pose.position == pytest.approx([0.5, 0.0, 0.2])
    larger = with_objects(
        box('box', 1.0, 0.0, 0.0, operation=ObjectMessage.APPEND), snapshot=first
    )
    shapes = larger.scene.objects['box'].shapes
    assert [list(each.pose.position) for each in shapes] == [
        pytest.approx([0.0, 0.0, 0.0]),
        pytest.approx([0.5, 0.0, -0.2]),
    ]
    without = with_objects(ObjectMessage(id='box', operation=ObjectMessage.REMOVE), snapshot=first)
    assert set(without.scene.objects) == set(without.details) == {'other'}
    empty = with_objects(ObjectMessage(operation=ObjectMessage.REMOVE), snapshot=first)
    assert not empty.scene.objects


def test_a_grasp_takes_an_object_out_of_the_world_and_lays_it_down() -> None:
    """It stays where it is while its frame changes."""
    world = with_objects(box('box', 0.5, 0.0, 0.2))
    held = attached('box', snapshot=world, touch_links=['panda_link7'], weight=0.3)
    assert not held.scene.objects
    assert held.frame('box', READY).position == pytest.approx([0.5, 0.0, 0.2])
    assert held.scene.attached_bodies['box'].touch_links == {'panda_link7'}
    release = AttachedCollisionObject(object=ObjectMessage(operation=ObjectMessage.REMOVE))
    laid = apply_attached(held, release, READY)
    assert laid.scene.objects['box'].pose.position == pytest.approx([0.5, 0.0, 0.2])
    assert not laid.attached_details


def test_poses_are_in_the_frame_of_the_header() -> None:
    """A link, another object, or a subframe of one, of the same message too."""
    table = box('table', 0.5, 0.0, 0.2)
    table.subframe_names, table.subframe_poses = ['corner'], [pose_at(0.1, 0.2, 0.3)]
    on_corner, on_tip = box('cup', 0.0, 0.0, 0.1), box('cap', 0.0, 0.0, 0.2)
    on_corner.header.frame_id, on_tip.header.frame_id = 'table/corner', TIP
    snapshot = with_objects(box('none', 0.0, 0.9, 0.0), table)
    snapshot = with_objects(on_corner, on_tip, snapshot=snapshot)
    assert snapshot.frame('cup', READY).position == pytest.approx([0.6, 0.2, 0.6])
    tip = panda().kinematics.link_pose(TIP, READY)
    above = tip.position + 0.2 * tip.rotation[:, 2]
    assert snapshot.frame('cap', READY).position == pytest.approx(above)


def test_a_whole_scene_replaces_the_world_and_keeps_the_matrix() -> None:
    """Clients that send their objects as a whole scene know nothing of neighbouring links."""
    before = with_objects(box('box', 0.5, 0.0, 0.2))
    message = PlanningScene()
    message.world.collision_objects = [box('new', 0.0, 0.5, 0.2)]
    after = edited(message, before)
    assert set(after.scene.objects) == {'new'}
    assert after.scene.allowed == before.scene.allowed


def test_padding_reaches_the_groups() -> None:
    """A link with a padding is nearer to what is beside it, by that much at most."""
    message = PlanningScene(is_diff=True)
    message.world.collision_objects = [box('box', 0.55, 0.0, 0.2)]
    bare = edited(message)
    message.link_padding = [LinkPadding(link_name='panda_link7', padding=0.02)]
    thick = edited(message)
    model = panda().model('panda_arm')
    positions = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    near = []
    for snapshot in (bare, thick):
        scene = scene_for(snapshot, model.scene)
        distances = Clearances(scene).least(positions, math.inf)
        near.append(
            min(
                distance
                for pair, distance in zip(scene.pairs, distances, strict=True)
                if set(pair) == {'panda_link7', 'box'}
            )
        )
    assert near[0] - 0.0201 <= near[1] < near[0] - 0.01


def test_an_answer_has_the_parts_that_are_asked_for() -> None:
    """Names alone have no shapes; a part is a change, and everything is none."""
    snapshot = with_objects(box('box', 0.5, 0.0, 0.2))
    names = scene_message(
        snapshot, 'panda', RobotState(), PlanningSceneComponents.WORLD_OBJECT_NAMES
    )
    assert names.is_diff
    assert [each.id for each in names.world.collision_objects] == ['box']
    assert not names.world.collision_objects[0].primitives
    assert not names.allowed_collision_matrix.entry_names


def _box_with(**fields: Any) -> ObjectMessage:
    message = box('box', 0.5, 0.0, 0.2)
    for name, value in fields.items():
        setattr(message, name, value)
    return message


NAN = pose_at(math.nan)
FLAT = Mesh(
    vertices=tetrahedron(0.1).vertices[:3], triangles=[MeshTriangle(vertex_indices=[0, 1, 2])]
)
BEYOND = Mesh(
    vertices=tetrahedron(0.1).vertices, triangles=[MeshTriangle(vertex_indices=[0, 1, 9])]
)
REFUSED: dict[str, tuple[Any, PlanningCode, str]] = {
    'no name': (box(''), PlanningCode.INVALID_OBJECT_NAME, 'name'),
    'name of a link': (box('panda_link3'), PlanningCode.INVALID_OBJECT_NAME, 'link'),
    'no shape': (ObjectMessage(id='a'), PlanningCode.FAILURE, 'no shapes'),
    'frame': (
        _box_with(header=ObjectMessage().header.__class__(frame_id='moon')),
        PlanningCode.FRAME_TRANSFORM_FAILURE,
        'moon',
    ),
    'NaN pose': (_box_with(pose=NAN), PlanningCode.FAILURE, 'nan'),
    'prism': (_box_with(primitives=[SolidPrimitive(type=5)]), PlanningCode.FAILURE, 'prism'),
    'empty mesh': (_box_with(meshes=[Mesh()]), PlanningCode.FAILURE, 'volume'),
    'flat mesh': (_box_with(meshes=[FLAT]), PlanningCode.FAILURE, 'flat'),
    'corner of a mesh': (_box_with(meshes=[BEYOND]), PlanningCode.FAILURE, 'vertex 9'),
    'subframe': (_box_with(subframe_names=['tip']), PlanningCode.FAILURE, 'subframes'),
    'remove unknown': (
        ObjectMessage(id='cup', operation=ObjectMessage.REMOVE),
        PlanningCode.INVALID_OBJECT_NAME,
        'no object',
    ),
    'move unknown': (
        ObjectMessage(id='cup', operation=ObjectMessage.MOVE),
        PlanningCode.INVALID_OBJECT_NAME,
        'no object',
    ),
    'operation': (_box_with(operation=b'\x07'), PlanningCode.FAILURE, 'operation 7'),
}


@pytest.mark.parametrize(('message', 'code', 'words'), REFUSED.values(), ids=REFUSED)
def test_objects_that_are_wrong_are_refused(message: Any, code: PlanningCode, words: str) -> None:
    """With MoveIt's code, and with what is wrong."""
    with pytest.raises(PlanningError, match=words) as refusal:
        with_objects(message)
    assert refusal.value.code is code


def _scene(**fields: Any) -> Callable[[], SceneSnapshot]:
    return lambda: edited(PlanningScene(is_diff=True, **fields))


CHANGES: dict[str, tuple[Callable[[], SceneSnapshot], PlanningCode, str]] = {
    'attach unknown': (lambda: attached('cup'), PlanningCode.INVALID_OBJECT_NAME, 'no object'),
    'attach to unknown': (
        lambda: attached('cup', 'hand'),
        PlanningCode.INVALID_LINK_NAME,
        "'hand'",
    ),
    'touch unknown': (
        lambda: attached(
            'box', snapshot=with_objects(box('box', 0.5, 0.0, 0.2)), touch_links=['finger']
        ),
        PlanningCode.INVALID_LINK_NAME,
        "'finger'",
    ),
    'padding of unknown': (
        _scene(link_padding=[LinkPadding(link_name='moon')]),
        PlanningCode.INVALID_LINK_NAME,
        'moon',
    ),
    'negative padding': (
        _scene(link_padding=[LinkPadding(link_name=TIP, padding=-0.1)]),
        PlanningCode.FAILURE,
        '-0.1',
    ),
    'zero scale': (
        _scene(link_scale=[LinkScale(link_name=TIP, scale=0.0)]),
        PlanningCode.FAILURE,
        'scale',
    ),
    'matrix': (
        _scene(
            allowed_collision_matrix=MatrixMessage(
                entry_names=['a', 'b'], entry_values=[AllowedCollisionEntry()] * 2
            )
        ),
        PlanningCode.FAILURE,
        'entry_values',
    ),
}


@pytest.mark.parametrize(('change', 'code', 'words'), CHANGES.values(), ids=CHANGES)
def test_changes_that_are_wrong_are_refused(
    change: Callable[[], SceneSnapshot], code: PlanningCode, words: str
) -> None:
    """With MoveIt's code, and with what is wrong."""
    with pytest.raises(PlanningError, match=words) as refusal:
        change()
    assert refusal.value.code is code


def test_a_body_that_is_attached_cannot_be_added_to_the_world() -> None:
    """One name is one thing."""
    held = attached('box', snapshot=with_objects(box('box', 0.5, 0.0, 0.2)))
    with pytest.raises(PlanningError, match='attached to panda_link8'):
        with_objects(box('box', 0.0, 0.5, 0.2), snapshot=held)

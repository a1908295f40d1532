# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes from MoveIt's messages and back: nothing is lost; refusals: test_planning_bad_input."""

from __future__ import annotations

import math
from typing import Any

from geometry_msgs.msg import Point32
from hypothesis import given, settings
from hypothesis import strategies as st
from moveit_msgs.msg import (
    AttachedCollisionObject,
    LinkPadding,
    LinkScale,
    ObjectColor,
    PlanningScene,
    RobotState,
)
from moveit_msgs.msg import CollisionObject as ObjectMessage
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
from shape_msgs.msg import SolidPrimitive

from arm_model import AllowedCollisionMatrix, Clearances
from arm_model.ros import allowed_collisions, apply_planning_scene, scene_change
from arm_planning.ros.scene import (
    collision_message,
    matrix_message,
    object_message,
    scene_message,
    SceneSnapshot,
)
from arm_planning.ros.scene_changes import apply_scene

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
        snapshot = apply_scene(snapshot, scene_change(message), READY)
    return snapshot


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
    message.robot_state.attached_collision_objects = [
        AttachedCollisionObject(link_name=TIP, object=held, touch_links=['panda_hand'], weight=0.5)
    ]
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

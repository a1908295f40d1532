# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be planned for, what was planned, and where links are; the scene in messages."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from geometry_msgs.msg import Point, Pose
from hypothesis import given
from hypothesis import strategies as st
from moveit_msgs.msg import (
    AttachedCollisionObject,
    CollisionObject,
    MoveItErrorCodes,
    PlanningScene,
)
import numpy as np
import pytest
from shape_msgs.msg import Mesh, MeshTriangle, SolidPrimitive
from test_viewer_kinematics import pose_in_root, published
from urdf_reader import about, DescriptionError, link_poses, read_urdf, Transform
from urdf_robots import ARM, POSITIONS, random_urdfs

from robot_viewer.nodes.motion_plan import (
    box_message,
    changed,
    LINE_POINTS,
    moved_message,
    PAUSE,
    plan_groups,
    PlannedMotion,
    pose_message,
    refusal,
    removed_message,
    SceneObject,
    SHOWINGS,
    tip_line,
)
from robot_viewer.nodes.planning_scene import draw_object
from robot_viewer.page.robot_scene import links_beyond, moved

TREE = read_urdf(ARM)
SRDF = """
<robot name="arm">
  <group name="hand"><joint name="finger_joint"/></group>
  <group name="whole"><chain base_link="base" tip_link="wheel"/></group>
  <group name="broken"><joint name="cart_joint"/></group>
  <group_state name="up" group="whole">
    <joint name="shoulder" value="0.5"/><joint name="elsewhere" value="1"/>
  </group_state>
  <end_effector name="tool" group="hand" parent_link="wheel" parent_group="whole"/>
</robot>
"""
TURNED = Transform((0.1, 0.2, 0.3), about((0.0, 0.0, 1.0), 0.5))


class Drawn:
    """A scene of the page that keeps what is drawn in it.

    Attributes:
        nodes: Kind of each, and what it is made of.
    """

    def __init__(self) -> None:
        self.nodes: list[tuple[str, Any]] = []

    def __getattr__(self, name: str) -> Any:
        """Return what adds a node of a kind."""

        def add(_path: str, *shape: object, **_options: object) -> Any:
            self.nodes.append(
                (name.removeprefix('add_'), SimpleNamespace(shape=shape, position=()))
            )
            return self.nodes[-1][1]

        return add


@given(random_urdfs(), st.floats(-3.0, 3.0))
def test_links_are_where_tf_has_them(urdf: str, position: float) -> None:
    """Of random robots, each joint at the same place."""
    tree = read_urdf(urdf)
    positions = {joint.name: position for joint in tree.movable() if joint.mimic is None}
    frames = published(tree, positions)
    for link in tree.links:
        pose = link_poses(tree, positions)[link]
        expected = pose_in_root(link, tree.root, frames)
        assert np.allclose(pose.translation, expected[:3, 3], atol=1e-9)


def test_a_joint_that_follows_moves_what_hangs_on_it() -> None:
    """By its factor and offset, and its link belongs to what the other joint moves."""
    pose = link_poses(TREE, POSITIONS)['thumb']
    expected = pose_in_root('thumb', 'base', published(TREE, POSITIONS))
    assert np.allclose(pose.translation, expected[:3, 3], atol=1e-9)
    assert links_beyond(TREE, frozenset({'finger_joint'})) == {'finger', 'thumb'}
    assert links_beyond(TREE, frozenset({'roll'})) == {'wheel', 'finger', 'thumb'}


def test_a_joint_that_follows_has_one_position() -> None:
    """Where it was measured, for the page as for tf; it goes along with a goal of its source."""
    followers = {joint.name: 0.3 for joint in TREE.movable() if joint.mimic}
    measured = POSITIONS | followers
    expected = pose_in_root('thumb', 'base', published(TREE, measured))
    assert np.allclose(link_poses(TREE, measured)['thumb'].translation, expected[:3, 3], atol=1e-9)
    goal = moved(TREE, measured, {'finger_joint': 0.1})
    expected = pose_in_root('thumb', 'base', published(TREE, POSITIONS | {'finger_joint': 0.1}))
    assert np.allclose(link_poses(TREE, goal)['thumb'].translation, expected[:3, 3], atol=1e-9)


def test_groups_with_their_states_arms_first() -> None:
    """Of groups that can move; a state has the joints of its group."""
    groups = plan_groups(TREE, SRDF)
    assert list(groups) == ['whole', 'hand']
    assert groups['whole'].joints == ('shoulder', 'lift', 'roll')
    assert groups['whole'].tip == 'wheel'
    assert groups['whole'].states == {'up': {'shoulder': 0.5}}
    with pytest.raises(DescriptionError, match='no groups'):
        plan_groups(TREE, '<robot name="arm"/>')
    with pytest.raises(DescriptionError, match='cart_joint'):
        plan_groups(
            TREE, '<robot name="arm"><group name="g"><joint name="cart_joint"/></group></robot>'
        )


def test_a_motion_is_shown_a_few_times() -> None:
    """It goes through its points, rests at its ends, and pauses in between."""
    motion = PlannedMotion(('a',), (0.0, 1.0, 3.0), ((0.0,), (2.0,), (-2.0,)))
    assert motion.duration == 3.0
    places = [motion.at(time)['a'] for time in (-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0)]
    assert places == [0.0, 0.0, 1.0, 2.0, 0.0, -2.0, -2.0]
    cycle = motion.duration + PAUSE
    assert motion.shown(cycle + 0.5) == pytest.approx({'a': 1.0})
    assert motion.shown(cycle - 0.1) == {'a': -2.0}
    assert motion.shown(SHOWINGS * cycle + 0.1) is None
    assert PlannedMotion((), (), ()).at(1.0) == {}


def test_the_line_of_the_tip_goes_from_start_to_goal() -> None:
    """Joints beside the motion stand where they are."""
    motion = PlannedMotion(('shoulder',), (0.0, 2.0), ((-0.5,), (0.5,)))
    line = tip_line(TREE, 'wheel', {'lift': 0.3, 'shoulder': 9.0}, motion)
    assert len(line) == LINE_POINTS
    for place, angle in ((line[0], -0.5), (line[-1], 0.5)):
        expected = link_poses(TREE, {'lift': 0.3, 'shoulder': angle})['wheel'].translation
        assert place == pytest.approx(expected)


def test_a_box_comes_moves_and_goes() -> None:
    """By changes that name no other object; a whole scene replaces everything."""
    objects = changed({}, box_message('box1', (0.1, 0.2, 0.3), TURNED, 'base'))
    objects = changed(objects, box_message('box2', (1.0, 1.0, 1.0), Transform(), 'base'))
    (box,) = objects['box1'].message.primitives
    assert (box.type, list(box.dimensions)) == (SolidPrimitive.BOX, [0.1, 0.2, 0.3])
    assert objects['box1'].pose == TURNED
    moved = changed(objects, moved_message(objects['box1'].message, Transform((1.0, 0.0, 0.0))))
    assert moved['box1'].pose.translation == (1.0, 0.0, 0.0)
    assert moved['box1'].message.primitives == [box]
    assert set(changed(moved, removed_message(moved['box1'].message))) == {'box2'}
    assert changed(moved, PlanningScene(is_diff=False)) == {}
    everything = CollisionObject(operation=CollisionObject.REMOVE)
    change = PlanningScene(is_diff=True)
    change.robot_state.is_diff = True
    change.world.collision_objects.append(everything)
    assert changed(moved, change) == {}


def test_what_is_held_and_all_shapes_are_read() -> None:
    """An attached body is gone when a state without it comes."""
    thing = CollisionObject(id='part')
    thing.header.frame_id = 'wheel'
    kind = SolidPrimitive
    for shape, lengths in (
        (kind.SPHERE, [0.1]),
        (kind.CYLINDER, [0.2, 0.1]),
        (kind.CONE, [1.0, 0.5]),
    ):
        thing.primitives.append(kind(type=shape, dimensions=lengths))
        thing.primitive_poses.append(pose_message(TURNED))
    scene = PlanningScene(is_diff=True)
    scene.robot_state.attached_collision_objects.append(AttachedCollisionObject(object=thing))
    objects = changed({'kept': SceneObject(CollisionObject(id='kept'))}, scene)
    assert objects['part'].attached
    drawn = Drawn()
    draw_object(drawn, 'part', objects['part'])  # type: ignore[arg-type]
    assert [kind for kind, _ in drawn.nodes] == ['frame', 'icosphere', 'cylinder', 'mesh_simple']
    assert drawn.nodes[1][1].position == TURNED.translation
    scene.robot_state.attached_collision_objects.clear()
    assert set(changed(objects, scene)) == {'kept'}
    mesh = CollisionObject(id='mesh', operation=CollisionObject.ADD)
    corners = [Point(), Point(x=1.0), Point(y=1.0)]
    triangle = MeshTriangle(vertex_indices=[0, 1, 2])
    mesh.meshes.append(Mesh(vertices=corners, triangles=[triangle]))
    mesh.mesh_poses.append(pose_message(Transform()))
    scene.world.collision_objects.append(mesh)
    more = CollisionObject(id='mesh', operation=CollisionObject.APPEND)
    for shape in (99, kind.BOX):
        more.primitives.append(kind(type=shape, dimensions=[1.0, 1.0, 1.0]))
        more.primitive_poses.append(Pose())
    scene.world.collision_objects.append(more)
    drawn = Drawn()
    draw_object(drawn, 'mesh', changed({}, scene)['mesh'])  # type: ignore[arg-type]
    assert [kind for kind, _ in drawn.nodes] == ['frame', 'box', 'mesh_simple']
    vertices, faces = drawn.nodes[2][1].shape
    assert vertices[1].tolist() == [1.0, 0.0, 0.0]
    assert faces.tolist() == [[0, 1, 2]]


def test_refusals_have_the_words_of_move_group() -> None:
    """With the code by its name."""
    code = MoveItErrorCodes(val=MoveItErrorCodes.GOAL_IN_COLLISION, message='a touches b')
    assert refusal(code) == 'GOAL_IN_COLLISION: a touches b'
    assert refusal(MoveItErrorCodes(val=MoveItErrorCodes.PREEMPTED)) == 'PREEMPTED'
    assert refusal(MoveItErrorCodes(val=-4711)) == 'code -4711'
    assert not refusal(MoveItErrorCodes(val=MoveItErrorCodes.SUCCESS))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of TF; scenes of moveit_msgs: what they add, attach, move, remove, allow and refuse."""

from __future__ import annotations

from collections.abc import Sequence
import math
from types import SimpleNamespace
from typing import Any, cast, TYPE_CHECKING

from geometry_msgs.msg import Point, Point32, TransformStamped
from geometry_msgs.msg import Pose as PoseMessage
from hypothesis import given
from hypothesis import strategies as st
from model_robots import chain, ready, robot
from moveit_msgs import msg
import numpy as np
import pinocchio as pin
import pytest
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import Plane as PlaneMessage
from shape_msgs.msg import SolidPrimitive
from tf2_msgs.msg import TFMessage

import arm_model as am
from arm_model.ros import apply_planning_scene, FrameOf, FrameTree, scene_change, TfListener

if TYPE_CHECKING:
    from rclpy.node import Node


ANGLES = st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6)


def pose(numbers: list[float]) -> am.Pose:
    """Return the pose with a rotation vector and a position."""
    return am.Pose(pin.exp3(np.array(numbers[:3])), np.array(numbers[3:]))


@given(ANGLES, ANGLES, ANGLES)
def test_a_frame_is_found_up_and_down_the_tree(
    table: list[float], base: list[float], tool: list[float]
) -> None:
    """The pose of a frame on another branch is that through the common ancestor.

    A transform that is not renewed, another tree and a loop lead nowhere.
    """
    tree = FrameTree()
    tree.learn('table', 'world', pose(table), math.inf)
    tree.learn('base', 'world', pose(base), math.inf)
    tree.learn('cup', 'table', pose(tool), 5.0)
    found = tree.pose('cup', 'base', 5.5)
    assert found is not None
    wanted = am.combined(am.inverse(pose(base)), am.combined(pose(table), pose(tool)))
    assert found.position == pytest.approx(wanted.position, abs=1e-9)
    assert found.rotation == pytest.approx(wanted.rotation, abs=1e-9)
    assert tree.pose('cup', 'base', 7.0) is None
    for child, parent in ('ab', 'ba'):
        tree.learn(child, parent, pose(tool), math.inf)
    assert tree.pose('a', 'base', 5.5) is None


class TfNode:
    """What a TfListener needs of a node, with a clock that stands at 100 s."""

    def __init__(self) -> None:
        self.subscribed: dict[str, Any] = {}
        now = SimpleNamespace(nanoseconds=100_000_000_000)
        self.get_clock = lambda: SimpleNamespace(now=lambda: now)

    def create_subscription(self, _kind: object, topic: str, take: object, _qos: object) -> None:
        """Remember it."""
        self.subscribed[topic] = take

    def publish(self, sec: int, x: float) -> None:
        """Publish where the cup is."""
        transform = TransformStamped(child_frame_id='cup')
        transform.header.frame_id = 'base_link'
        transform.header.stamp.sec = sec
        transform.transform.translation.x = x
        self.subscribed['/tf'](TFMessage(transforms=[transform]))

    def listener(self, **fields: Any) -> TfListener:
        """Return a listener of an arm."""
        node = cast('Node', self)
        return TfListener(node, robot('gp110').kinematics, base='base_link', **fields)


def test_transforms_that_come_late_or_are_no_numbers_do_not_count() -> None:
    """A frame is where a fresh message says; the stamp counts, not the arrival."""
    node = TfNode()
    frames = node.listener()
    with pytest.raises(am.CommandError, match="Unknown frame: 'cup'"):
        frames.pose('cup')
    node.publish(90, 0.1)
    with pytest.raises(am.CommandError, match=r"'cup' to frame 'base_link': .* 10\.0 s old"):
        frames.pose('cup')
    node.publish(100, 0.2)
    node.publish(100, math.nan)
    assert frames.pose('cup').position.tolist() == [0.2, 0.0, 0.0]
    node.publish(101, 0.3)  # of a clock a little ahead
    assert frames.pose('cup').position.tolist() == [0.3, 0.0, 0.0]


def test_a_world_that_tf_has_placed_is_no_other_name_of_the_root() -> None:
    """Also while its publisher pauses: the arm does not jump to another frame."""
    node = TfNode()
    frames = node.listener(world_frames=['cup'])
    assert frames.link('cup') == robot('gp110').kinematics.root
    node.publish(90, 0.1)
    assert frames.link('cup') is None
    with pytest.raises(am.CommandError, match=r'10\.0 s old'):
        frames.pose('cup')


MODEL = chain('zyyp')
AT = np.array([0.4, -0.3, 0.5, 0.1])


def thing(
    name: str = 'box',
    place: Sequence[float] = (0.5, 0.0, 0.2),
    *,
    frame: str = '',
    operation: bytes = msg.CollisionObject.ADD,
    primitive: SolidPrimitive | None = None,
) -> msg.CollisionObject:
    """Return a box at a place, or another primitive."""
    x, y, z = map(float, place)
    shape = primitive or SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.2, 0.3])
    message = msg.CollisionObject(id=name, operation=operation)
    message.header.frame_id = frame
    message.pose = PoseMessage(position=Point(x=x, y=y, z=z))
    if operation in {msg.CollisionObject.ADD, msg.CollisionObject.APPEND}:
        message.primitives = [shape]
    return message


def attached(
    name: str, link: str, *, operation: bytes, bare: bool = True
) -> msg.AttachedCollisionObject:
    """Return what attaches or detaches an object."""
    message = msg.AttachedCollisionObject(link_name=link, touch_links=['link_3'])
    message.object = thing(name, frame=link, operation=operation)
    if bare:
        message.object.primitives = []
    return message


def changed(
    scene: am.PlanningScene,
    message: msg.CollisionObject | msg.AttachedCollisionObject,
    positions: am.Array,
    frame_of: FrameOf | None = None,
) -> am.PlanningScene:
    """Return a scene after a message of an object or an attached body."""
    return apply_planning_scene(scene, scene_change(message), positions, frame_of)


def test_shapes_of_messages() -> None:
    """The height of a cylinder comes first; prism and mesh are hulls, a plane is solid below."""
    for kind, dimensions, shape in (
        (SolidPrimitive.BOX, [0.1, 0.2, 0.3], am.Box(0.1, 0.2, 0.3)),
        (SolidPrimitive.SPHERE, [0.1], am.Sphere(0.1)),
        (SolidPrimitive.CYLINDER, [0.4, 0.1], am.Cylinder(0.1, 0.4)),
        (SolidPrimitive.CONE, [0.4, 0.1], am.Cone(0.1, 0.4)),
    ):
        primitive = SolidPrimitive(type=kind, dimensions=dimensions)
        found = changed(MODEL.scene, thing(primitive=primitive), AT).objects['box']
        assert [each.shape for each in found.shapes] == [shape]
        assert found.pose.position.tolist() == [0.5, 0.0, 0.2]
    prism = SolidPrimitive(type=SolidPrimitive.PRISM, dimensions=[0.5])
    prism.polygon.points = [Point32(x=x, y=y) for x, y in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))]
    message = thing(primitive=prism)
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    message.meshes = [MeshMessage(vertices=[Point(x=x, y=y, z=z) for x, y, z in points])]
    message.planes = [PlaneMessage(coef=[0.0, 0.0, 2.0, 0.2])]
    shapes = [each.shape for each in changed(MODEL.scene, message, AT).objects['box'].shapes]
    hull, mesh, plane = shapes
    assert isinstance(hull, am.Mesh)
    assert min(map(tuple, hull.points.round(6).tolist())) == (0.0, 0.0, -0.25)
    assert len(hull.points) == 6
    assert mesh == am.Mesh(points)
    assert plane == am.Plane((0.0, 0.0, 2.0), -0.1)


def test_a_pose_is_in_its_frame() -> None:
    """A link of the robot where the arm is, or what the caller knows; else it is refused."""
    turned = changed(MODEL.scene, thing(frame='link_2'), AT)
    link = MODEL.scene.kinematics.link_pose('link_2', AT)
    there = link.position + link.rotation @ (0.5, 0.0, 0.2)
    assert turned.objects['box'].pose.position == pytest.approx(there)
    known = changed(MODEL.scene, thing(frame='camera'), AT, lambda _: link)
    assert known.objects['box'].pose.position == pytest.approx(there)
    with pytest.raises(am.SceneError, match="'box': no frame 'camera'; links: base"):
        changed(MODEL.scene, thing(frame='camera'), AT)


def test_an_object_is_moved_extended_and_removed() -> None:
    """APPEND keeps the shapes that are there, MOVE all of them, REMOVE without an id nothing."""
    scene = changed(MODEL.scene, thing(), AT)
    scene = changed(scene, thing(place=(0.5, 0.0, 0.9), operation=msg.CollisionObject.APPEND), AT)
    first, second = scene.objects['box'].shapes
    assert second.pose.position - first.pose.position == pytest.approx([0.0, 0.0, 0.7])
    moved = changed(scene, thing(place=(1.0, 0.0, 0.0), operation=msg.CollisionObject.MOVE), AT)
    assert moved.objects['box'].shapes == scene.objects['box'].shapes
    assert moved.objects['box'].pose.position.tolist() == [1.0, 0.0, 0.0]
    assert scene.objects['box'].pose.position.tolist() == [0.5, 0.0, 0.2]
    gone = changed(moved, thing('', operation=msg.CollisionObject.REMOVE), AT)
    assert not gone.objects
    nothing = "no object 'box' in the world; there are: none"
    for words, message in (
        (nothing, thing(operation=msg.CollisionObject.REMOVE)),
        (nothing, thing(operation=msg.CollisionObject.MOVE)),
        ('has no shapes', attached('cup', 'link_4', operation=b'\0')),
        ("no link 'link_9'", attached('box', 'link_9', operation=b'\0', bare=False)),
        ("no attached object 'cup'", attached('cup', '', operation=b'\1')),
    ):
        with pytest.raises(am.SceneError, match=words):
            changed(gone, message, AT)


def test_the_pose_of_the_only_shape_is_that_of_the_object() -> None:
    """As in MoveIt, where the object's own is left out: MOVE, frames and clients count on it."""
    alone = thing(place=(0.0, 0.0, 0.0))
    alone.primitive_poses = [PoseMessage(position=Point(x=0.5, y=0.1, z=0.3))]
    scene = changed(MODEL.scene, alone, AT)
    (shape,) = scene.objects['box'].shapes
    assert scene.objects['box'].pose.position.tolist() == [0.5, 0.1, 0.3]
    assert shape.pose.position.tolist() == [0.0, 0.0, 0.0]
    moved = changed(scene, thing(place=(0.5, -0.1, 0.3), operation=msg.CollisionObject.MOVE), AT)
    assert moved.objects['box'].pose.position.tolist() == [0.5, -0.1, 0.3]
    assert moved.objects['box'].shapes == scene.objects['box'].shapes
    alone.pose.position.x = 1.0
    both = changed(MODEL.scene, alone, AT).objects['box']
    assert both.pose.position.tolist() == [1.0, 0.0, 0.0]
    assert both.shapes[0].pose.position.tolist() == [0.5, 0.1, 0.3]


def test_an_object_is_taken_up_carried_and_laid_down() -> None:
    """It keeps its place when it is attached, and moves with the link."""
    scene, later = changed(MODEL.scene, thing(), AT), AT + 0.3
    held = changed(scene, attached('box', 'link_4', operation=b'\0'), AT)
    assert not held.objects
    assert held.attached_bodies['box'].touch_links == {'link_3'}
    assert held.pose('box', AT).position == pytest.approx([0.5, 0.0, 0.2])
    down = changed(held, attached('box', '', operation=b'\1'), later)
    assert down.pose('box', AT).position == pytest.approx(held.pose('box', later).position)
    assert not down.attached_bodies
    cup = changed(scene, attached('cup', 'link_4', operation=b'\0', bare=False), AT)
    assert cup.attached_bodies['cup'].object.pose.position == pytest.approx([0.5, 0.0, 0.2])


def matrix(names: Sequence[str], *allowed: tuple[str, str]) -> msg.AllowedCollisionMatrix:
    """Return a matrix in which some pairs may touch."""
    pairs = set(map(frozenset, allowed))
    rows = [[frozenset((one, other)) in pairs for other in names] for one in names]
    entries = [msg.AllowedCollisionEntry(enabled=row) for row in rows]
    return msg.AllowedCollisionMatrix(entry_names=names, entry_values=entries)


def scene_message(
    *objects: msg.CollisionObject,
    held: Sequence[msg.AttachedCollisionObject] = (),
    is_diff: bool = False,
) -> msg.PlanningScene:
    """Return a message."""
    state = msg.RobotState(attached_collision_objects=list(held), is_diff=is_diff)
    world = msg.PlanningSceneWorld(collision_objects=list(objects))
    return msg.PlanningScene(world=world, robot_state=state, is_diff=is_diff)


def test_a_whole_scene_replaces_and_a_diff_changes() -> None:
    """An attach comes as a body and the removal of its object, as MoveIt sends it."""
    scene = apply_planning_scene(MODEL.scene, scene_message(thing(), thing('cup')), AT)
    assert set(scene.objects) == {'box', 'cup'}
    grasp = scene_message(
        thing(operation=msg.CollisionObject.REMOVE),
        held=[attached('box', 'link_4', operation=b'\0', bare=False)],
        is_diff=True,
    )
    grasp.allowed_collision_matrix = matrix(['cup', 'link_2'], ('cup', 'link_2'))
    held = apply_planning_scene(scene, grasp, AT)
    assert set(held.objects) == {'cup'}
    assert set(held.attached_bodies) == {'box'}
    assert held.allowed.allows('cup', 'link_2')
    assert ('link_1', 'link_3') in {*held.pairs}
    same = apply_planning_scene(held, msg.PlanningScene(is_diff=True), AT)
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

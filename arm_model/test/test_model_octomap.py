# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Octomaps against streams that OctoMap wrote, as objects of scenes, and broken ones."""

from __future__ import annotations

import base64
from functools import cache
import json
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion
from hypothesis import given
from hypothesis import strategies as st
from model_robots import chain
from moveit_msgs.msg import AttachedCollisionObject, CollisionObject, PlanningScene
import numpy as np
from octomap_msgs.msg import OctomapWithPose
import pytest
from shape_msgs.msg import SolidPrimitive

from arm_model import octomap_boxes, OCTOMAP_NAME, PlacedShape, SceneError
from arm_model import PlanningScene as Scene
from arm_model.ros import apply_attached_object, apply_collision_object, apply_planning_scene
from arm_model.scene.octomap import merged

MODEL = chain('zyyp')
AT = np.array([0.4, -0.3, 0.5, 0.1])


@cache
def written() -> dict[str, Any]:
    """Return what OctoMap wrote."""
    text = (Path(__file__).parent / 'octomap.json').read_text(encoding='utf-8')
    found: dict[str, Any] = json.loads(text)
    return found


def stream(*, binary: bool) -> bytes:
    """Return one of its streams."""
    return base64.b64decode(written()['binary' if binary else 'full'])


def edges(box: PlacedShape) -> Any:
    """Return the edges of a box in [m]."""
    shape: Any = box.shape
    return np.array([shape.x, shape.y, shape.z])


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'full'])
def test_boxes_fill_what_octomap_has_occupied(binary: bool) -> None:
    """Each leaf is in one box, and boxes hold no more than the leaves; they are fewer."""
    resolution = written()['resolution']
    boxes = octomap_boxes('OcTree', stream(binary=binary), resolution, binary=binary)
    leaves = np.array(written()['leaves'])
    for *middle, _edge in leaves.tolist():
        inside = [
            box
            for box in boxes
            if (np.abs(np.array(middle) - box.pose.position) < 0.5 * edges(box)).all()
        ]
        assert len(inside) == 1
    assert sum(np.prod(edges(box)) for box in boxes) == pytest.approx((leaves[:, 3] ** 3).sum())
    assert len(boxes) < len(leaves)


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'full'])
def test_streams_that_are_cut_or_too_long_are_refused(binary: bool) -> None:
    """Wherever they end; never a part of the map."""
    data = stream(binary=binary)
    for length in range(1, len(data), 7):
        with pytest.raises(SceneError, match='data end within a node, at byte'):
            octomap_boxes('OcTree', data[:length], 0.05, binary=binary)
    with pytest.raises(SceneError, match='the tree ends at byte'):
        octomap_boxes('OcTree', data + b'\0', 0.05, binary=binary)
    with pytest.raises(SceneError, match='octomap'):
        octomap_boxes('OcTree', data, 0.05, binary=not binary)


@pytest.mark.parametrize(
    ('kind', 'data', 'resolution', 'words'),
    [
        ('SemanticOcTree', b'\0\0', 0.05, "a tree 'SemanticOcTree'; send OcTree"),
        ('OcTree', b'\0\0', 0.0, 'resolution is 0'),
        ('OcTree', b'\0\0', float('nan'), 'resolution is nan'),
        ('OcTree', b'\xff\xff' * 100, 0.05, 'smallest cell has children'),
        ('OcTree', b'\0' * 2_000_001, 0.05, 'send a coarser map'),
    ],
)
def test_what_is_no_map_is_refused(kind: str, data: bytes, resolution: float, words: str) -> None:
    """With what is wrong and what to send."""
    with pytest.raises(SceneError, match=words):
        octomap_boxes(kind, data, resolution, binary=True)


def test_a_cell_without_a_probability_is_refused() -> None:
    """NaN is neither free nor occupied."""
    with pytest.raises(SceneError, match='occupied by nan'):
        octomap_boxes('OcTree', np.float32(np.nan).tobytes() + b'\0', 0.05, binary=False)


@given(
    st.sets(st.tuples(*[st.integers(0, 5)] * 3), max_size=80),
    st.sets(st.tuples(*[st.integers(4, 7)] * 3), max_size=4),
)
def test_merging_neither_adds_nor_loses_a_cell(
    cells: set[tuple[int, int, int]], large: set[tuple[int, int, int]]
) -> None:
    """Of cells, and of larger cubes among them."""
    cubes = [(*cell, 1) for cell in cells]
    cubes += [(4 * x, 4 * y, 4 * z, 4) for x, y, z in large]
    wanted = {
        (x + i, y + j, z + k)
        for x, y, z, edge in cubes
        for i in range(edge)
        for j in range(edge)
        for k in range(edge)
    }
    spans = merged(np.array(cubes, dtype=np.int64).reshape(-1, 4))
    found = [
        (x, y, z)
        for (x0, y0, z0), (x1, y1, z1) in spans.tolist()
        for x in range(x0, x1)
        for y in range(y0, y1)
        for z in range(z0, z1)
    ]
    assert len(found) == len(set(found))
    assert set(found) == wanted


def test_a_solid_block_is_one_box() -> None:
    """Of leaves of different sizes too."""
    cubes = [(0, 0, 0, 2), *((2, y, z, 1) for y in range(2) for z in range(2))]
    assert merged(np.array(cubes)).tolist() == [[[0, 0, 0], [3, 2, 2]]]


def with_map(scene: Scene, message: OctomapWithPose, *, diff: bool = True) -> Scene:
    """Return a scene after a message with an octomap."""
    change = PlanningScene(is_diff=diff)
    change.robot_state.is_diff = diff
    change.world.octomap = message
    return apply_planning_scene(scene, change, AT)


def octomap(frame: str = '') -> OctomapWithPose:
    """Return a message: turned about z by a quarter, 1 m in front."""
    message = OctomapWithPose()
    message.header.frame_id = frame
    half = 0.5**0.5
    message.origin = Pose(position=Point(x=1.0), orientation=Quaternion(z=half, w=half))
    message.octomap.id, message.octomap.resolution = 'OcTree', written()['resolution']
    message.octomap.binary = True
    message.octomap.data = np.frombuffer(stream(binary=True), dtype=np.int8).tolist()
    return message


def test_a_map_is_an_object_of_the_scene_where_its_origin_is() -> None:
    """In the frame of its header; the next one replaces it, one without data ends it."""
    scene = with_map(MODEL.scene, octomap('link_2'))
    found = scene.objects[OCTOMAP_NAME]
    link = MODEL.scene.kinematics.link_pose('link_2', AT)
    assert found.pose.position == pytest.approx(link.position + link.rotation @ (1.0, 0.0, 0.0))
    assert found.pose.rotation[:, 0] == pytest.approx(link.rotation[:, 1])
    assert with_map(scene, OctomapWithPose()).objects[OCTOMAP_NAME] == found
    assert with_map(scene, octomap()).objects[OCTOMAP_NAME].pose.position[0] == pytest.approx(1.0)
    empty = OctomapWithPose()
    empty.octomap.id = 'OcTree'
    assert OCTOMAP_NAME not in with_map(scene, empty).objects
    assert OCTOMAP_NAME not in with_map(scene, OctomapWithPose(), diff=False).objects


def test_the_name_of_the_map_is_reserved() -> None:
    """No object may have it; removing all objects keeps the map, as in MoveIt."""
    scene = with_map(MODEL.scene, octomap())
    everything = CollisionObject(operation=CollisionObject.REMOVE)
    assert OCTOMAP_NAME in apply_collision_object(scene, everything, AT).objects
    thing = CollisionObject(id=OCTOMAP_NAME, operation=CollisionObject.ADD)
    thing.primitives = [SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[0.1])]
    with pytest.raises(SceneError, match='name reserved'):
        apply_collision_object(scene, thing, AT)
    body = AttachedCollisionObject(link_name='link_3', object=thing)
    with pytest.raises(SceneError, match='name reserved'):
        apply_attached_object(scene, body, AT)

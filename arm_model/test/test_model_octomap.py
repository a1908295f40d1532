# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Octomaps against streams that OctoMap wrote, as objects of scenes, and broken ones."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import cache
from itertools import product
import json
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion
from hypothesis import example, given, settings
from hypothesis import strategies as st
from model_robots import chain
from moveit_msgs.msg import AttachedCollisionObject, CollisionObject, PlanningScene
import numpy as np
from octomap_msgs.msg import OctomapWithPose
import pytest
from shape_msgs.msg import SolidPrimitive

import arm_model as am
from arm_model.ros import apply_planning_scene, scene_change
from arm_model.scene.octomap import _blocks

MODEL = chain('zyyp')
AT = np.array([0.4, -0.3, 0.5, 0.1])
CUBE = list(product((-0.05, 0.05), repeat=3))


@cache
def written() -> dict[str, Any]:
    """Return what OctoMap wrote."""
    text = (Path(__file__).parent / 'octomap.json').read_text(encoding='utf-8')
    found: dict[str, Any] = json.loads(text)
    return found


def stream(*, binary: bool) -> bytes:
    """Return one of its streams."""
    return base64.b64decode(written()['binary' if binary else 'full'])


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'full'])
def test_cells_are_what_octomap_has_occupied(binary: bool) -> None:
    """Each leaf is in one cell, and cells hold no more than the leaves."""
    data, resolution = stream(binary=binary), written()['resolution']
    found = cells_of(am.octomap_shapes('OcTree', data, resolution, binary=binary))
    leaves = np.array(written()['leaves'])
    away = np.abs(leaves[:, None, :3] - found[:, :3]).max(axis=2)
    assert ((away < 0.5 * found[:, 3]).sum(axis=1) == 1).all()
    assert (found[:, 3] ** 3).sum() == pytest.approx((leaves[:, 3] ** 3).sum())


def cells_of(shapes: Sequence[am.PlacedShape]) -> am.Array:
    """Return middle and edge of each cell (n, 4) in [m]."""
    rows = []
    for each in shapes:
        assert isinstance(each.shape, am.Cells)
        rows += [[*middle, each.shape.edge] for middle in each.shape.middles.tolist()]
    return np.array(rows, dtype=np.float64)


@settings(max_examples=30, deadline=None)
@given(
    st.sets(st.tuples(*[st.integers(-3, 3)] * 3), min_size=1, max_size=40),
    st.sampled_from([am.Box(0.1, 0.2, 0.1), am.Sphere(0.1), am.Capsule(0.05, 0.2), am.Mesh(CUBE)]),
    st.tuples(*[st.integers(-8, 8)] * 3),
)
@example({(0, -2, -2), (1, -2, -2)}, am.Box(0.1, 0.2, 0.1), (3, -1, -2))
@example({(-1, 1, 0), (0, -1, 0)}, am.Sphere(0.1), (0, 2, 2))
def test_cells_count_as_boxes(
    cells: set[tuple[int, int, int]], shape: am.Shape, place: tuple[int, int, int]
) -> None:
    """As near as the nearest; one that is only touched hides none that is overlapped."""
    edge = 0.1
    middles = edge * (np.array(sorted(cells)) + 0.5)
    thing = am.CollisionObject('thing', shape, pose=am.Pose(np.eye(3), 0.05 * np.array(place)))
    boxes = [
        am.PlacedShape(am.Box(edge, edge, edge), am.Pose(np.eye(3), each)) for each in middles
    ]
    near = []
    for parts in (boxes, [am.Cells(middles, edge)]):
        scene = MODEL.scene.with_object(am.CollisionObject(am.OCTOMAP_NAME, *parts)).with_object(
            thing
        )
        scene = scene.attached('thing', 'link_4', AT)
        found = am.Clearances(scene).least(AT, np.inf)
        pairs = [{'thing', am.OCTOMAP_NAME} == {*pair} for pair in scene.pairs]
        near.append(found[pairs].min())
    by_box, by_cell = near
    if by_box > 1e-6:
        assert by_cell == pytest.approx(by_box, abs=1e-5)
    elif by_box < -1e-6:
        assert by_cell < -1e-4  # which checks of paths let pass


def test_a_large_map_is_taken() -> None:
    """Of 20,000 cells that no larger ones join."""
    side = np.arange(40)
    grid = np.array([(x, y, z) for x in side for y in side for z in side if (x + y + z) % 3 == 0])
    cubes = np.column_stack([grid + (1 << 15), np.ones(len(grid), dtype=int)])
    blocks = list(_blocks(cubes, 0.02))
    assert len(grid) > 20_000
    assert sum(len(each.middles) for each in blocks) == len(grid)
    scene = MODEL.scene.with_object(am.CollisionObject(am.OCTOMAP_NAME, *blocks))
    assert am.Clearances(scene).contacts(AT)


@pytest.mark.parametrize('binary', [True, False], ids=['binary', 'full'])
def test_streams_that_are_cut_or_too_long_are_refused(binary: bool) -> None:
    """Wherever they end; never a part of the map."""
    data = stream(binary=binary)
    for length in range(1, len(data), 7):
        with pytest.raises(am.SceneError, match='data end within a node, at byte'):
            am.octomap_shapes('OcTree', data[:length], 0.05, binary=binary)
    with pytest.raises(am.SceneError, match='the tree ends at byte'):
        am.octomap_shapes('OcTree', data + b'\0', 0.05, binary=binary)
    with pytest.raises(am.SceneError, match='octomap'):
        am.octomap_shapes('OcTree', data, 0.05, binary=not binary)


@pytest.mark.parametrize(
    ('kind', 'data', 'resolution', 'words'),
    [
        ('SemanticOcTree', b'\0\0', 0.05, "a tree 'SemanticOcTree'; send OcTree"),
        ('OcTree', b'\0\0', 0.0, 'resolution is 0'),
        ('OcTree', b'\0\0', float('nan'), 'resolution is nan'),
        ('OcTree', b'\xff\xff' * 100, 0.05, 'smallest cell has children'),
        ('OcTree', b'\0' * 2_000_001, 0.05, 'send a coarser map'),
        ('OcTree', np.float32(np.nan).tobytes() + b'\0', 0.05, 'occupied by nan'),
    ],
)
def test_what_is_no_map_is_refused(kind: str, data: bytes, resolution: float, words: str) -> None:
    """With what is wrong and what to send; NaN is neither free nor occupied."""
    with pytest.raises(am.SceneError, match=words):
        am.octomap_shapes(kind, data, resolution, binary='occupied' not in words)


def with_map(
    scene: am.PlanningScene, message: OctomapWithPose, *, diff: bool = True
) -> am.PlanningScene:
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
    found = scene.objects[am.OCTOMAP_NAME]
    link = MODEL.scene.kinematics.link_pose('link_2', AT)
    assert found.pose.position == pytest.approx(link.position + link.rotation @ (1.0, 0.0, 0.0))
    assert found.pose.rotation[:, 0] == pytest.approx(link.rotation[:, 1])
    assert with_map(scene, OctomapWithPose()).objects[am.OCTOMAP_NAME] == found
    assert with_map(scene, octomap()).objects[am.OCTOMAP_NAME].pose.position[0] == pytest.approx(
        1.0
    )
    empty = OctomapWithPose()
    empty.octomap.id = 'OcTree'
    assert am.OCTOMAP_NAME not in with_map(scene, empty).objects
    assert am.OCTOMAP_NAME not in with_map(scene, OctomapWithPose(), diff=False).objects


def test_the_name_of_the_map_is_reserved() -> None:
    """No object may have it; removing all objects keeps the map, as in MoveIt."""
    scene = with_map(MODEL.scene, octomap())
    everything = CollisionObject(operation=CollisionObject.REMOVE)
    assert am.OCTOMAP_NAME in apply_planning_scene(scene, scene_change(everything), AT).objects
    thing = CollisionObject(id=am.OCTOMAP_NAME, operation=CollisionObject.ADD)
    thing.primitives = [SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[0.1])]
    for message in (thing, AttachedCollisionObject(link_name='link_3', object=thing)):
        with pytest.raises(am.SceneError, match='name reserved'):
            apply_planning_scene(scene, scene_change(message), AT)

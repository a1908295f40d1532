# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Scenes and messages of MoveIt for the tests."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from ament_index_python.packages import get_package_share_directory
from geometry_msgs.msg import Point, Quaternion
from geometry_msgs.msg import Pose as PoseMessage
from hypothesis import strategies as st
from moveit_msgs.msg import CollisionObject as ObjectMessage
import numpy as np
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import MeshTriangle, SolidPrimitive
from shape_msgs.msg import Plane as PlaneMessage
from std_msgs.msg import Header
from urdf_reader import expand_xacro

from arm_model import load_limits
from arm_planning.ros.robot_groups import RobotGroups

LENGTHS = st.floats(0.02, 0.3)
NUMBERS = st.floats(-1.0, 1.0)


class QuietNode:
    """A node without a graph."""

    def __getattr__(self, name: str) -> Any:
        """Return what does nothing."""
        if name == 'resolve_topic_name':
            return lambda topic: f'/{topic}'
        return lambda *_, **__: SimpleNamespace(publish=lambda _message: None)


@cache
def panda() -> RobotGroups:
    """Return the Panda."""
    folder = Path(get_package_share_directory('arm_bringup')) / 'robots' / 'panda'
    srdf = (folder / 'panda.srdf').read_text(encoding='utf-8')
    limits = load_limits(folder / 'limits.yaml')
    return RobotGroups(expand_xacro(folder / 'panda.urdf.xacro'), srdf, limits)


def pose_at(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> PoseMessage:
    """Return a pose without a turn."""
    return PoseMessage(position=Point(x=x, y=y, z=z))


def box(name: str, *at: float, edge: float = 0.1, operation: bytes = ObjectMessage.ADD) -> Any:
    """Return a cube in the root link."""
    return ObjectMessage(
        header=Header(frame_id='panda_link0'),
        id=name,
        pose=pose_at(*at),
        primitives=[SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[edge] * 3)],
        primitive_poses=[pose_at()],
        operation=operation,
    )


def tetrahedron(size: float) -> MeshMessage:
    """Return a mesh of four triangles."""
    corners = [(0.0, 0.0, 0.0), (size, 0.0, 0.0), (0.0, size, 0.0), (0.0, 0.0, size)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    return MeshMessage(
        vertices=[Point(x=x, y=y, z=z) for x, y, z in corners],
        triangles=[MeshTriangle(vertex_indices=list(face)) for face in faces],
    )


@st.composite
def poses(draw: Any) -> PoseMessage:
    """Any pose near the robot."""
    numbers = np.array([draw(NUMBERS) for _ in range(4)])
    if np.linalg.norm(numbers) < 0.1:
        numbers = np.array([0.0, 0.0, 0.0, 1.0])
    x, y, z, w = (numbers / np.linalg.norm(numbers)).tolist()
    pose = pose_at(draw(NUMBERS), draw(NUMBERS), draw(NUMBERS))
    pose.orientation = Quaternion(x=x, y=y, z=z, w=w)
    return pose


def _primitives(kind: int, count: int) -> st.SearchStrategy[SolidPrimitive]:
    lengths = st.lists(LENGTHS, min_size=count, max_size=count)
    return lengths.map(lambda numbers: SolidPrimitive(type=kind, dimensions=numbers))


PRIMITIVES = st.one_of(
    _primitives(SolidPrimitive.BOX, 3),
    _primitives(SolidPrimitive.SPHERE, 1),
    _primitives(SolidPrimitive.CYLINDER, 2),
    _primitives(SolidPrimitive.CONE, 2),
)
PLANES = st.tuples(NUMBERS, NUMBERS, st.floats(0.2, 1.0), NUMBERS).map(
    lambda numbers: PlaneMessage(coef=list(numbers))
)


@st.composite
def objects(draw: Any, name: str = 'thing') -> ObjectMessage:
    """Any object of several shapes, with subframes."""
    message = ObjectMessage(header=Header(frame_id='panda_link0'), id=name, pose=draw(poses()))
    message.primitives = draw(st.lists(PRIMITIVES, max_size=3))
    message.meshes = [tetrahedron(size) for size in draw(st.lists(LENGTHS, max_size=2))]
    message.planes = draw(st.lists(PLANES, min_size=0 if message.primitives else 1, max_size=2))
    for shapes, places in (
        (message.primitives, message.primitive_poses),
        (message.meshes, message.mesh_poses),
        (message.planes, message.plane_poses),
    ):
        places.extend(draw(poses()) for _ in shapes)
    message.subframe_names = draw(st.lists(st.sampled_from(['tip', 'handle']), unique=True))
    message.subframe_poses = [draw(poses()) for _ in message.subframe_names]
    message.type.key, message.type.db = draw(st.sampled_from([('', ''), ('cup', '{"x": 1}')]))
    return message


def leaves(message: Any) -> Iterator[float | str]:
    """Yield all numbers and texts of a message, quaternions without their sign."""
    if isinstance(message, Quaternion):
        numbers = np.array([message.x, message.y, message.z, message.w])
        clear = numbers[np.abs(numbers) > 0.123]  # rounding turns the sign of none of these
        yield from (numbers * np.sign(clear[0])).tolist()
    elif hasattr(message, 'get_fields_and_field_types'):
        for field in message.get_fields_and_field_types():
            yield from leaves(getattr(message, field))
    elif isinstance(message, str):
        yield message
    elif isinstance(message, (bool, int, float, np.number)):
        yield float(message)
    elif not isinstance(message, bytes):
        for each in message:
            yield from leaves(each)


def numbers_of(message: Any) -> list[float]:
    """Return all numbers of a message."""
    return [each for each in leaves(message) if not isinstance(each, str)]


def texts_of(message: Any) -> list[str]:
    """Return all texts of a message."""
    return [each for each in leaves(message) if isinstance(each, str)]

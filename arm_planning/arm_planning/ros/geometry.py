# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Poses and shapes as messages; :mod:`arm_model.ros` reads shapes.

A message's quaternion of zeros is no turn, as in MoveIt.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import Point
from geometry_msgs.msg import Pose as PoseMessage
import numpy as np
import pinocchio as pin
from shape_msgs.msg import Mesh as MeshMessage
from shape_msgs.msg import MeshTriangle, SolidPrimitive
from shape_msgs.msg import Plane as PlaneMessage

from arm_model import (
    Array,
    Box,
    Capsule,
    checked,
    CommandError,
    Cone,
    Cylinder,
    Mesh,
    ORIGIN,
    PlacedShape,
    Places,
    Plane,
    Pose,
    rotation_of,
    Sphere,
)
from arm_model.ros import hull_of, xyz, xyzw

from ..exceptions import PlanningCode, PlanningError

MIN_THICKNESS = 1e-6  # least extent of a mesh along its thinnest axis in [m] that is a volume


def pose_of(
    message: Any,  # noqa: ANN401  # message classes have no type
    what: str,
    code: PlanningCode = PlanningCode.FAILURE,
) -> Pose:
    """Return a geometry_msgs/Pose.

    Raises:
        PlanningError: A number is not finite, or the quaternion is none.
    """
    return placement(xyz(message.position), xyzw(message.orientation), what, code)


def placement(
    position: Array,
    quaternion: Sequence[float],
    what: str,
    code: PlanningCode = PlanningCode.FAILURE,
) -> Pose:
    """Return a pose.

    Args:
        quaternion: x, y, z, w.

    Raises:
        PlanningError: A number is not finite, or the quaternion is none.
    """
    try:
        rotation = rotation_of(quaternion) if any(quaternion) else ORIGIN.rotation
        return Pose(rotation, checked(position, 3, 'position'))
    except CommandError as error:
        raise PlanningError(code, f'{what}: {error}') from error


def pose_message(pose: Pose) -> PoseMessage:
    """Return a pose as a geometry_msgs/Pose."""
    message = PoseMessage(position=point_message(pose.position))
    numbers = pin.Quaternion(pose.rotation).normalized().coeffs().tolist()
    turn = message.orientation
    turn.x, turn.y, turn.z, turn.w = numbers
    return message


def point_message(position: Array) -> Point:
    """Return a position as a geometry_msgs/Point."""
    x, y, z = (float(number) for number in position)
    return Point(x=x, y=y, z=z)


def primitive_message(shape: Box | Sphere | Cylinder | Cone) -> SolidPrimitive:
    """Return a shape as a shape_msgs/SolidPrimitive."""
    match shape:
        case Box(x, y, z):
            return SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[x, y, z])
        case Sphere(radius):
            return SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[radius])
        case Cylinder(radius, length):
            return SolidPrimitive(type=SolidPrimitive.CYLINDER, dimensions=[length, radius])
        case Cone(radius, length):
            return SolidPrimitive(type=SolidPrimitive.CONE, dimensions=[length, radius])


def as_primitives(placed: PlacedShape) -> Sequence[PlacedShape]:
    """Return shapes that a message has: a capsule is a cylinder with a sphere on either end."""
    shape, pose = placed.shape, placed.pose
    if not isinstance(shape, Capsule):
        return (placed,)
    half = 0.5 * shape.length * pose.rotation[:, 2]
    ends = (Pose(pose.rotation, pose.position + side * half) for side in (-1, 1))
    caps = (PlacedShape(Sphere(shape.radius), end) for end in ends)
    return (PlacedShape(Cylinder(shape.radius, shape.length), pose), *caps)


def plane_message(plane: Plane) -> PlaneMessage:
    """Return a plane as a shape_msgs/Plane."""
    length = float(np.linalg.norm(plane.normal))
    return PlaneMessage(coef=[*plane.normal, -plane.offset * length])


def check_mesh(message: Any, what: str) -> None:  # noqa: ANN401
    """Make sure that a shape_msgs/Mesh is a body.

    Raises:
        PlanningError: It has no triangle or no volume, or names a corner that there is not.
    """
    problem = _problem(*_arrays(message))
    if problem:
        raise PlanningError(PlanningCode.FAILURE, f'{what}: {problem}')


def volumes(message: Any) -> tuple[float, float]:  # noqa: ANN401
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


def mesh_message(mesh: Mesh) -> MeshMessage:
    """Return the surface of a hull as a shape_msgs/Mesh."""
    hull = mesh.hull
    faces = (hull.polygons(number) for number in range(hull.num_polygons))
    triangles = [MeshTriangle(vertex_indices=[face[0], face[1], face[2]]) for face in faces]
    return MeshMessage(triangles=triangles, vertices=[point_message(each) for each in mesh.points])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A robot as entities of Rerun: its links below one another, numbers as lines, texts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math

import numpy as np
from numpy.typing import NDArray
import rerun
from rerun import blueprint
from trimesh import Trimesh
from trimesh.visual import TextureVisuals
from urdf_reader import KinematicTree, MeshFileError, Transform, UrdfShape

from .link_poses import joint_position, joint_transform, link_paths
from .shapes import Meshes, PLAIN, shapes_of

TIMELINE = 'ros_time'
BASE = 'robot'
"""Entity of the robot's base; its links are below it."""
LOG, DIAGNOSTICS = 'log', 'diagnostics'
"""Entities of texts."""
LEVELS = {10: 'DEBUG', 20: 'INFO', 30: 'WARN', 40: 'ERROR', 50: 'CRITICAL'}
"""Of rcl_interfaces/Log, in the words of Rerun."""


def layout() -> blueprint.Blueprint:
    """Return what the viewer shows where nobody has arranged it otherwise."""
    lines = [
        blueprint.TimeSeriesView(origin=name, name=name)
        for name in ('position', 'velocity', 'effort')
    ]
    texts = [blueprint.TextLogView(origin=name, name=name) for name in (LOG, DIAGNOSTICS)]
    return blueprint.Blueprint(
        blueprint.Horizontal(
            blueprint.Spatial3DView(origin='/', name='robot', contents=[f'{BASE}/**']),
            blueprint.Vertical(*lines, blueprint.Tabs(*texts)),
        )
    )


class RobotLog:
    """Writes what is known of a robot into a recording."""

    def __init__(self, stream: rerun.RecordingStream) -> None:
        """Know no robot yet.

        Args:
            stream: The recording.
        """
        self._stream = stream
        self._tree: KinematicTree | None = None
        self._paths: dict[str, str] = {}
        self._shown: dict[str, type[rerun.AsComponents]] = {}
        self._is_placed = False
        stream.log('/', rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)

    def describe(self, tree: KinematicTree) -> list[str]:
        """Show a robot; return what of it cannot be shown, in words."""
        for path, kind in self._shown.items():  # what is of all times is not cleared otherwise
            self._stream.log(path, kind.cleared(), static=True)
        self._shown.clear()
        self._tree, self._paths, self._is_placed = tree, link_paths(tree, BASE), False
        movable = {joint.name for joint in tree.movable()}
        for joint in tree.joints:
            if joint.name not in movable:
                place = joint_transform(joint, 0.0)
                self._put(self._paths[joint.child], place, static=True)
        meshes, missing = Meshes(), dict[str, list[str]]()
        for number, shape in enumerate(shapes_of(tree)):
            try:
                self._add_shape(f'{self._paths[shape.link]}/shape{number}', shape, meshes)
            except (OSError, ValueError) as error:  # noqa: PERF203  # the others are shown
                missing.setdefault(str(error), []).append(shape.link)
        return [f'{", ".join(links)}: {reason}' for reason, links in missing.items()]

    def at(self, stamp: int) -> None:
        """Let what is written next be of a time in [ns] since the epoch."""
        self._stream.set_time(TIMELINE, timestamp=np.datetime64(stamp, 'ns'))

    def joints(self, positions: Mapping[str, float]) -> None:
        """Move the joints that are named, and those that follow one of them; at first, all.

        Args:
            positions: In [rad] or [m] by name.
        """
        for joint in () if self._tree is None else self._tree.movable():
            position = joint_position(joint, positions, None if self._is_placed else 0.0)
            if position is not None and math.isfinite(position):
                place = joint_transform(joint, position)
                self._put(self._paths[joint.child], place)
        self._is_placed = self._tree is not None

    def base(self, pose: Transform) -> None:
        """Move the whole robot: pose of its root link in the world."""
        self._put(BASE, pose)

    def numbers(self, quantity: str, values: Iterable[tuple[str, float]]) -> None:
        """Write numbers, a line each.

        Args:
            quantity: What they are.
            values: By name.
        """
        for name, value in values:
            if math.isfinite(value):
                self._stream.log(f'{quantity}/{name}', rerun.Scalars(value))

    def text(self, entity: str, level: str, text: str) -> None:
        """Write a line.

        Args:
            entity: Where.
            level: As Rerun names it.
            text: What is said.
        """
        self._stream.log(entity, rerun.TextLog(text, level=level))

    def _put(self, path: str, place: Transform, *, static: bool = False) -> None:
        self._stream.log(
            path,
            rerun.Transform3D(
                translation=place.translation, quaternion=rerun.Quaternion(xyzw=place.rotation)
            ),
            static=static,
        )

    def _add_shape(self, path: str, shape: UrdfShape, meshes: Meshes) -> None:
        color = [round(255 * part) for part in shape.color or PLAIN]
        seen: rerun.AsComponents
        match shape.shape:
            case 'box':
                size = shape.lengths('size')
                seen = rerun.Boxes3D(sizes=[size], colors=[color], fill_mode='solid')
            case 'cylinder':
                radius, length = shape.lengths('radius', 'length')
                seen = rerun.Cylinders3D(
                    lengths=[length], radii=[radius], colors=[color], fill_mode='solid'
                )
            case 'sphere':
                (radius,) = shape.lengths('radius')
                seen = rerun.Ellipsoids3D(radii=[radius], colors=[color], fill_mode='solid')
            case 'mesh':
                mesh, scale = meshes.read(shape)
                colors = _colors(mesh) if shape.color is None else None
                seen = rerun.Mesh3D(
                    vertex_positions=np.asarray(mesh.vertices) * scale,
                    triangle_indices=mesh.faces,
                    vertex_normals=mesh.vertex_normals,
                    vertex_colors=colors,
                    albedo_factor=color if colors is None else None,
                )
            case _:
                raise MeshFileError(f'<{shape.shape}> is no box, cylinder, sphere or mesh')
        self._shown[path] = type(seen)
        self._stream.log(path, seen, static=True)
        self._stream.log(
            path,
            rerun.InstancePoses3D(
                translations=[shape.origin.translation],
                quaternions=[rerun.Quaternion(xyzw=shape.origin.rotation)],
            ),
            static=True,
        )


def _colors(mesh: Trimesh) -> NDArray[np.uint8] | None:
    """Return the color of each vertex; None where the file has none."""
    visual = mesh.visual
    if visual is None or not visual.defined:
        return None
    if isinstance(visual, TextureVisuals):
        visual = visual.to_color()  # type: ignore[no-untyped-call]
    return np.asarray(visual.vertex_colors, np.uint8)

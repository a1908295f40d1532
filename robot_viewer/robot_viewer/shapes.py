# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the links of a robot look like."""

from __future__ import annotations

from pathlib import Path

import trimesh
from urdf_reader import find_mesh, KinematicTree, mesh_unit, MeshFileError, UrdfShape

PLAIN = (0.7, 0.72, 0.75, 1.0)
"""Color of what the description gives none: red, green, blue and opacity from 0 to 1."""


def shapes_of(tree: KinematicTree) -> list[UrdfShape]:
    """Return the visual shapes, and those of collision of links that have no other."""
    visuals = list(tree.visuals())
    shown = {each.link for each in visuals}
    return visuals + [each for each in tree.collisions() if each.link not in shown]


class Meshes:
    """Files of triangles, each of which is read once."""

    def __init__(self, folder: Path | None = None) -> None:
        """Begin without shapes."""
        self._folder = folder
        self._read: dict[Path, trimesh.Trimesh] = {}

    def read(self, shape: UrdfShape) -> tuple[trimesh.Trimesh, tuple[float, float, float]]:
        """Return the triangles of a mesh and the scale of its axes, which leads to [m].

        Raises:
            OSError: The file cannot be read.
            ValueError: It has no triangles, or is of an unknown format.
        """
        path = find_mesh(shape.attributes.get('filename', ''), self._folder)
        mesh = self._read.get(path) or _load(path)
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            raise MeshFileError(f'{path}: no triangles')
        self._read[path] = mesh
        scale = shape.lengths('scale') if 'scale' in shape.attributes else (1.0, 1.0, 1.0)
        unit = mesh_unit(path)  # trimesh leaves it to us
        x, y, z = (unit * each for each in scale)
        return mesh, (x, y, z)


def _load(path: Path) -> object:
    try:
        return trimesh.load(path, force='mesh')
    except ModuleNotFoundError as error:
        package = {'collada': 'pycollada'}.get(error.name or '', error.name)
        raise MeshFileError(
            f'{path}: it takes the Python package {package} to read it; install that, or export '
            'the mesh as STL or OBJ'
        ) from error

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Files that a viewer fetches by the names that a URDF gives them."""

from __future__ import annotations

from pathlib import PurePosixPath
import re
from urllib.parse import unquote

from urdf_reader import find_mesh

MESHES = re.compile(
    r'package://(?:[-\w%]+/)+[-.\w%]+\.(?:dae|fbx|glb|gltf|jpeg|jpg|mtl|obj|png|stl|tif|tiff'
    r'|urdf|webp|xacro)'
)
"""Meshes and what belongs to them, of installed packages."""


class AssetError(ValueError):
    """A file that is not sent."""


def read_asset(uri: str) -> bytes:
    """Read a mesh of a package, or what belongs to one.

    Raises:
        AssetError: It is something else, or leaves its package.
        MeshFileError: There is no such package or file.
        OSError: It cannot be read.
    """
    if not MESHES.fullmatch(uri):
        raise AssetError(f'{uri} is no mesh or image of a package (package://)')
    # also as %2e%2e, which is decoded before the file is looked for
    if '..' in PurePosixPath(unquote(uri)).parts:
        raise AssetError(f'{uri} leaves its package; write it without ..')
    return find_mesh(uri).read_bytes()

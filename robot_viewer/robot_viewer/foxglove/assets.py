# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Files that a viewer fetches by the names that a URDF gives them."""

from __future__ import annotations

from pathlib import PurePosixPath
from urllib.parse import unquote

from urdf_reader import find_mesh

from .names import NameFilter

MESHES = (
    r'package://(?:[-\w%]+/)+[-.\w%]+\.(?:dae|fbx|glb|gltf|jpeg|jpg|mtl|obj|png|stl|tif|tiff'
    r'|urdf|webp|xacro)'
)
"""Meshes and what belongs to them, of installed packages."""


class AssetError(ValueError):
    """A file that is not sent."""


class Assets:
    """Reads files whose names are allowed."""

    def __init__(self, allowed: NameFilter) -> None:
        """Take what is allowed.

        Args:
            allowed: Which URIs.
        """
        self._allowed = allowed

    def read(self, uri: str) -> bytes:
        """Read a file.

        Args:
            uri: ``package://`` or ``file://``.

        Raises:
            AssetError: It is not allowed.
            MeshFileError: There is no such package or file.
            OSError: It cannot be read.
        """
        if not self._allowed.accepts(uri):
            raise AssetError(f'{uri} is not in asset_uri_allowlist; add an expression for it')
        # also as %2e%2e, which is decoded before the file is looked for
        if '..' in PurePosixPath(unquote(uri)).parts:
            raise AssetError(f'{uri} leaves its package; write it without ..')
        return find_mesh(uri).read_bytes()

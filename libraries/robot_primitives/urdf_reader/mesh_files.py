# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The file of a mesh, found by the name that a URDF gives it."""

from __future__ import annotations

import os
from pathlib import Path
import re
from urllib.parse import unquote

from .exceptions import MeshFileError

COLLADA_UNIT = re.compile(rb'<unit\b[^>]*\bmeter\s*=\s*["\']([^"\']+)["\']')
"""Where a COLLADA file says how many metres its unit has."""


def find_mesh(name: str, folder: Path | None = None) -> Path:
    """Find the file of a mesh.

    Args:
        name: How the URDF names it: ``package://``, ``file://``, an absolute or a relative path.
        folder: Folder of the description: relative paths begin here, and a package may lie in it.

    Raises:
        MeshFileError: There is no such package or file, or a relative name without a folder.
    """
    scheme, separator, rest = name.partition('://')
    if separator and scheme not in {'package', 'file'}:
        raise MeshFileError(f'{name}: not a file; use package:// or file://')
    rest = unquote(rest) if separator else name
    if scheme == 'package' and separator:
        package, _, inside = rest.partition('/')
        path = find_package(package, folder) / inside
    elif Path(rest).is_absolute():
        path = Path(rest)
    elif folder is None:
        raise MeshFileError(f'{name}: the folder of a relative path is unknown; use package://')
    else:
        path = folder / rest
    if not path.is_file():
        raise MeshFileError(f'{name}: no file {path}; correct the name, or add the file')
    return path


def mesh_unit(path: Path) -> float:
    """Return the unit of a mesh in [m]: COLLADA names it, the others are in [m] by convention."""
    if path.suffix.lower() != '.dae':
        return 1.0
    found = COLLADA_UNIT.search(path.read_bytes())
    try:
        return float(found[1]) if found else 1.0
    except ValueError:
        return 1.0


def find_package(name: str, folder: Path | None = None) -> Path:
    """Find the folder of a package: beside the description, or installed.

    Raises:
        MeshFileError: There is no such package.
    """
    if not name:
        raise MeshFileError('a mesh file without a package; write package://PACKAGE/FILE')
    for above in (folder, *folder.parents) if folder else ():
        if above.name == name:
            return above
        if (above / name / 'package.xml').is_file():
            return above / name
    installed = [Path(prefix, 'share', name) for prefix in _folders('AMENT_PREFIX_PATH')]
    sources = [Path(each, name) for each in _folders('ROS_PACKAGE_PATH')]
    found = next((path for path in (*installed, *sources) if path.is_dir()), None)
    if found is None:
        raise MeshFileError(
            f'package {name} is not installed; install it, or lay it beside the description'
        )
    return found


def _folders(variable: str) -> list[str]:
    return [folder for folder in os.environ.get(variable, '').split(os.pathsep) if folder]

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Expands third-party xacro files without changes to them.

Includes for ros2_control or Gazebo that are not installed are skipped: they serve other drivers
and simulators.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
from html import escape
import io
import os
from pathlib import Path
import re
import tempfile
from typing import Any
from urllib.parse import unquote

from .exceptions import MeshFileError, XacroError

OTHER_HARDWARE = ('ros2_control', 'gazebo')
"""Files and macros with these words in their names are for other drivers and simulators."""
NOT_FOUND = re.compile(r"package '(?P<package>[^']+)' not found")
UNDEFINED = re.compile(r'Undefined substitution argument (?P<argument>\S+)')


def expand_xacro(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    packages: Mapping[str, Path] | None = None,
) -> str:
    """Expand a xacro file to XML text.

    Raises:
        XacroError: The file cannot be expanded; the message is xacro's own, or names the package
            or argument that is missing and the remedy.
    """
    import xacro

    packages = packages or {}
    complaints = io.StringIO()  # xacro writes to stderr where in the file it was
    try:
        with (
            contextlib.redirect_stderr(complaints),
            _package_overlay(packages) as overlay,
            _without_other_hardware(xacro),
        ):
            document = xacro.process_file(str(path), mappings=dict(arguments or {}))
    except Exception as error:  # an expression in the file may raise anything
        place = ' '.join(complaints.getvalue().split())
        if refusal := _missing(path, str(error)):
            raise refusal from error
        reason = f'{type(error).__name__}: {error} {place}'.strip()
        raise XacroError(f'{path}: {reason}') from error
    expanded = str(document.toprettyxml(indent='  '))
    # the overlay is gone: files in it are named where they are
    inside = re.compile(re.escape(f'{overlay}/') + r'([\w-]+)')
    return inside.sub(lambda found: escape(str(packages[found[1]]), quote=False), expanded)


def _missing(path: Path, words: str) -> XacroError | None:
    """Return what is missing and the remedy, if xacro's message is long or has no remedy."""
    if found := NOT_FOUND.search(words):
        name = found['package']
        reason = f'package {name!r} is not found: source the workspace that has it'
        return XacroError(f'{path}: {reason}', package=name)
    if found := UNDEFINED.search(words):
        name = found['argument']
        reason = f'xacro argument {name!r} has no value: give it with --xacro-arg {name}:=VALUE'
        return XacroError(f'{path}: {reason}', argument=name)
    return None


@contextlib.contextmanager
def _package_overlay(packages: Mapping[str, Path]) -> Iterator[Path]:
    """Make ``$(find ...)`` resolve to the given folders while the block runs.

    Yields:
        The temporary share folder that links to them.
    """
    with tempfile.TemporaryDirectory(prefix='packages-') as prefix:
        share = Path(prefix, 'share')
        index = share / 'ament_index' / 'resource_index' / 'packages'
        index.mkdir(parents=True)
        for name, folder in packages.items():
            (index / name).touch()
            (share / name).symlink_to(folder)
        before = os.environ.get('AMENT_PREFIX_PATH', '')
        os.environ['AMENT_PREFIX_PATH'] = f'{prefix}{os.pathsep}{before}'
        try:
            yield share
        finally:
            os.environ['AMENT_PREFIX_PATH'] = before


@contextlib.contextmanager
def _without_other_hardware(xacro: Any) -> Iterator[None]:  # noqa: ANN401  # it has no types
    """Drop includes for other drivers that are not installed, and calls of their macros."""
    include, call = xacro.process_include, xacro.handle_macro_call

    def process_include(element: Any, *rest: Any) -> None:  # noqa: ANN401
        files = list(xacro.filestack)
        try:
            include(element, *rest)
        except xacro.XacroException as error:
            lacking = isinstance(error.exc, (LookupError, OSError))
            if not lacking or not _of_other_hardware(element.getAttribute('filename')):
                raise
            xacro.filestack[:] = files
            xacro.replace_node(element, by=None)

    def handle_macro_call(node: Any, *rest: Any) -> bool:  # noqa: ANN401
        try:
            return bool(call(node, *rest))
        except xacro.XacroException as error:
            unknown = str(error).startswith('unknown macro name')
            if not unknown or not _of_other_hardware(node.tagName):
                raise
            xacro.replace_node(node, by=None)
            return True

    xacro.process_include, xacro.handle_macro_call = process_include, handle_macro_call
    try:
        yield
    finally:
        xacro.process_include, xacro.handle_macro_call = include, call


def _of_other_hardware(name: str) -> bool:
    return any(word in name for word in OTHER_HARDWARE)


COLLADA_UNIT = re.compile(rb'<unit\b[^>]*\bmeter\s*=\s*["\']([^"\']+)["\']')
"""Matches the unit of a COLLADA file in metres."""


def find_mesh(name: str, folder: Path | None = None) -> Path:
    """Find the file of a mesh.

    Args:
        name: Name in the URDF: ``package://``, ``file://``, an absolute or a relative path.
        folder: Folder of the description: the base of relative paths; it may contain packages.

    Raises:
        MeshFileError: There is no such package or file, or the name is relative and no folder is
            given.
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
    """Return the unit of a mesh in [m]: COLLADA states it, other formats use [m] by convention."""
    if path.suffix.lower() != '.dae':
        return 1.0
    found = COLLADA_UNIT.search(path.read_bytes())
    try:
        return float(found[1]) if found else 1.0
    except ValueError:
        return 1.0


def find_package(name: str, folder: Path | None = None) -> Path:
    """Find the folder of a package: beside the description, else installed.

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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""URDF and SRDF of a robot folder, of plain or xacro files, and the limits of the joints.

Files of others are taken as they are: what a xacro file includes for ros2_control or Gazebo is
left out where it is not installed, because the drives are on a CANopen bus here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import contextlib
import io
import os
from pathlib import Path
import re
import tempfile
from typing import Any

import urdf_reader
from urdf_reader import JointRange, read_urdf

from .exceptions import DescriptionError
from .robots import Robot, SETTINGS

OTHER_HARDWARE = ('ros2_control', 'gazebo')
"""Files and macros with these words in their names are for other drivers and simulators."""
NOT_FOUND = re.compile(r"package '(?P<package>[^']+)' not found")
RELATIVE_MESH = re.compile(r'(<mesh\b[^>]*\bfilename\s*=\s*["\'])(?![a-z]+://|/)([^"\']+)')
"""Meshes beside the description, which the nodes that read it would not find."""
UNDEFINED = re.compile(r'Undefined substitution argument (?P<argument>\S+)')


def read_description(robot: Robot) -> str:
    """Return the URDF of a robot as XML text.

    Args:
        robot: The robot.

    Raises:
        DescriptionError: The file cannot be read or expanded.
    """
    urdf = _located(_read(robot.description, robot), robot.packages)
    return RELATIVE_MESH.sub(
        lambda found: found[1] + (robot.description.parent / found[2]).resolve().as_uri(), urdf
    )


def read_semantic(robot: Robot) -> str:
    """Return the SRDF of a robot as XML text.

    Args:
        robot: The robot.

    Raises:
        DescriptionError: The file cannot be read or expanded.
    """
    return _read(robot.semantic, robot)


def _read(path: Path, robot: Robot) -> str:
    if path.suffix == '.xacro':
        return expand_xacro(path, robot.xacro_args, robot.packages)
    try:
        return path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise DescriptionError(f'{path}: {error}') from error


def _located(urdf: str, packages: Mapping[str, Path]) -> str:
    """Replace ``package://`` of packages that only this robot folder knows by their folders."""
    for name, folder in packages.items():
        urdf = urdf.replace(f'package://{name}/', f'{folder.as_uri()}/')
    return urdf


def expand_xacro(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    packages: Mapping[str, Path] | None = None,
) -> str:
    """Expand a xacro file.

    Args:
        path: The xacro file.
        arguments: Values for its xacro arguments.
        packages: Folders of packages that are not in AMENT_PREFIX_PATH, by name.

    Returns:
        What it makes, as XML text.

    Raises:
        DescriptionError: The file cannot be expanded; the message is xacro's own, or names the
            package or argument that is missing and the remedy.
    """
    import xacro

    complaints = io.StringIO()  # xacro writes to stderr where in the file it was
    try:
        with (
            contextlib.redirect_stderr(complaints),
            _package_overlay(packages or {}),
            _without_other_hardware(xacro),
        ):
            document = xacro.process_file(str(path), mappings=dict(arguments or {}))
    except Exception as error:  # an expression in the file may raise anything
        place = ' '.join(complaints.getvalue().split())
        reason = _missing(str(error)) or f'{type(error).__name__}: {error} {place}'.strip()
        raise DescriptionError(f'{path}: {reason}') from error
    return str(document.toprettyxml(indent='  '))


def _missing(words: str) -> str:
    """Return what is missing and the remedy, where xacro's words are long or have none."""
    if found := NOT_FOUND.search(words):
        name = found['package']
        return (
            f'package {name!r} is not found: source the workspace that has it, or give its folder '
            f'in {SETTINGS} (packages: {{{name}: FOLDER}})'
        )
    if found := UNDEFINED.search(words):
        name = found['argument']
        return (
            f'xacro argument {name!r} has no value: give it with --xacro-arg {name}:=VALUE, or in '
            f'{SETTINGS} (xacro_args: {{{name}: VALUE}})'
        )
    return ''


@contextlib.contextmanager
def _package_overlay(packages: Mapping[str, Path]) -> Iterator[None]:
    """Let ``$(find ...)`` find folders as if they were installed, as long as the block runs."""
    with contextlib.ExitStack() as stack:
        if packages:
            prefix = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix='packages-')))
            index = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages'
            index.mkdir(parents=True)
            for name, folder in packages.items():
                (index / name).touch()
                (prefix / 'share' / name).symlink_to(folder)
            before = os.environ.get('AMENT_PREFIX_PATH', '')
            os.environ['AMENT_PREFIX_PATH'] = f'{prefix}{os.pathsep}{before}'
            stack.callback(os.environ.__setitem__, 'AMENT_PREFIX_PATH', before)
        yield


@contextlib.contextmanager
def _without_other_hardware(xacro: Any) -> Iterator[None]:  # noqa: ANN401  # it has no types
    """Leave out includes for other drivers that are not installed, and calls of their macros."""
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


def joint_limits(urdf: str) -> dict[str, JointRange]:
    """Read the limits of all joints that move by themselves, in the order of the URDF.

    Args:
        urdf: A URDF as XML text.

    Raises:
        DescriptionError: The text is no URDF, or a joint lacks its limits.
    """
    try:
        return read_urdf(urdf).ranges()
    except urdf_reader.DescriptionError as error:
        raise DescriptionError(str(error)) from error

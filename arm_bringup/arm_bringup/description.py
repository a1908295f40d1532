# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From a xacro file to a URDF, and from a URDF to the limits of its joints."""

from __future__ import annotations

from collections.abc import Mapping
import contextlib
import io
from pathlib import Path

import urdf_reader
from urdf_reader import JointRange, read_urdf

from .exceptions import DescriptionError


def expand_xacro(path: Path, arguments: Mapping[str, str] | None = None) -> str:
    """Expand a xacro file to a URDF.

    Args:
        path: The xacro file.
        arguments: Values for its xacro arguments.

    Returns:
        The URDF as XML text.

    Raises:
        DescriptionError: The file cannot be expanded; the message is xacro's own.
    """
    import xacro

    complaints = io.StringIO()  # xacro tells on stderr where in the file it was
    try:
        with contextlib.redirect_stderr(complaints):
            document = xacro.process_file(str(path), mappings=dict(arguments or {}))
    except Exception as error:  # an expression in the file may raise anything
        place = ' '.join(complaints.getvalue().split())
        text = f'{path}: {type(error).__name__}: {error} {place}'
        raise DescriptionError(text.strip()) from error
    return str(document.toprettyxml(indent='  '))


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

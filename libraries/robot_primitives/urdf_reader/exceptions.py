# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of urdf_reader."""

from __future__ import annotations


class DescriptionError(ValueError):
    """A robot description cannot be used; the message names the element.

    Scenarios: it is empty or no XML, a joint names a link that does not exist, two links have the
    same name, the joints make a loop, a number is no number, a group is unknown.
    """


class MeshFileError(DescriptionError):
    """The file of a mesh cannot be found; the message names the remedy."""


class XacroError(DescriptionError):
    """A xacro file cannot be expanded.

    Scenarios: malformed XML, an undefined property, a package that is not installed.

    Attributes:
        package: Name of the package that is missing; empty for none.
        argument: Name of the xacro argument that has no value; empty for none.
    """

    def __init__(self, reason: str, *, package: str = '', argument: str = '') -> None:
        super().__init__(reason)
        self.package, self.argument = package, argument

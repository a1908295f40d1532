# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Packages and their executables, from the ament index (`AMENT_PREFIX_PATH`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import os
from pathlib import Path
import sys

from ..cli.errors import FrontendError, UnknownNameError
from ..cli.suggest import hint


def package_prefixes() -> Mapping[str, str]:
    """All packages that are installed.

    Returns:
        The prefix path of each package by its name, sorted by name; the first prefix in
        `AMENT_PREFIX_PATH` that has a package counts.

    Raises:
        FrontendError: When the environment is not set up.
    """
    from ament_index_python.packages import get_packages_with_prefixes

    try:
        prefixes: dict[str, str] = get_packages_with_prefixes()
    except OSError as error:  # AMENT_PREFIX_PATH is missing or empty
        raise FrontendError(f'{error}\nSource env.sh in this shell first.') from error
    return dict(sorted(prefixes.items()))


def prefix_of(package: str, message: str = "Package '{0}' not found") -> Path:
    """Where a package is installed.

    Args:
        package: Its name.
        message: The error when it is not there; `{0}` stands for the name.

    Returns:
        Its prefix path.

    Raises:
        UnknownNameError: When there is none of that name; it names the nearest, or what makes
            one of this workspace known.
    """
    prefixes = package_prefixes()
    if package not in prefixes:
        remedy = _remedy(package, Path(sys.prefix).parent) or hint(package, prefixes)
        raise UnknownNameError(message.format(package) + remedy)
    return Path(prefixes[package])


def _remedy(package: str, workspace: Path) -> str:
    """Say what is to be done about a package whose sources are in the workspace."""
    folders = ('.', 'libraries', 'interfaces')
    if not any((workspace / folder / package / 'package.xml').is_file() for folder in folders):
        return ''
    if (workspace / 'install' / package).is_dir():
        return '\nIt was built after this shell was set up: source env.sh'
    return '\nIt may not be built yet: make build, then source env.sh'


def executables(package: str) -> list[Path]:
    """The executables of a package, as `ros2 run` finds them: files in `lib/<package>`.

    Args:
        package: Its name.

    Returns:
        Their paths, sorted.

    Raises:
        UnknownNameError: When there is no such package.
    """
    return sorted(_executable_files(prefix_of(package) / 'lib' / package))


def _executable_files(folder: Path) -> Iterator[Path]:
    for base, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith('.')]
        for name in files:
            path = Path(base, name)
            if os.access(path, os.X_OK):
                yield path

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Packages and their executables, from the ament index (`AMENT_PREFIX_PATH`)."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
import sys

from ..cli.errors import FrontendError, UnknownNameError
from ..cli.suggest import hint


def package_prefixes() -> Mapping[str, str]:
    """Return the prefix path of each installed package by its name, sorted.

    Raises:
        FrontendError: The environment is not set up.
    """
    from ament_index_python.packages import get_packages_with_prefixes

    try:
        prefixes: dict[str, str] = get_packages_with_prefixes()
    except OSError as error:  # AMENT_PREFIX_PATH is missing or empty
        raise FrontendError(f'{error}\nSource env.sh in this shell first.') from error
    return dict(sorted(prefixes.items()))


def prefix_of(package: str, message: str = "Package '{0}' not found") -> Path:
    """Return the prefix path of a package.

    Raises:
        UnknownNameError: There is none of that name; it names the nearest, or what makes one of
            this workspace known. The message may hold `{0}` for the name.
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
    install = workspace / 'install'
    if (install / package).is_dir() or (install / 'share' / package).is_dir():
        return '\nIt was built after this shell was set up: source env.sh'
    return '\nIt may not be built yet: make build, then source env.sh'


def executables(package: str) -> list[Path]:
    """Return the executables of a package, as `ros2 run` finds them: files in `lib/<package>`."""
    found: list[Path] = []
    for base, folders, files in os.walk(prefix_of(package) / 'lib' / package):
        folders[:] = [name for name in folders if not name.startswith('.')]
        found += [Path(base, name) for name in files if os.access(Path(base, name), os.X_OK)]
    return sorted(found)

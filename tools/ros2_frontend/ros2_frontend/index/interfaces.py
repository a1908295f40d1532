# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Interface types: which are installed, where they are defined, and their Python classes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum
import importlib
from pathlib import Path

from ..aliases import InterfaceClass
from ..cli.errors import BadTypeError, UnknownNameError
from ..cli.suggest import hint

_RESOURCE = 'rosidl_interfaces'


class Kind(Enum):
    """A kind of interface; the value is its folder, and the middle part of a type's name."""

    MESSAGE = 'msg'
    SERVICE = 'srv'
    ACTION = 'action'


def interfaces_of(package: str, kinds: Iterable[Kind] = Kind) -> list[str]:
    """Return the interfaces of one package, e.g. `std_msgs/msg/String`, sorted.

    Those that the generators derive from a service or an action are left out.

    Raises:
        UnknownNameError: The package defines none; it names the nearest.
    """
    from ament_index_python import get_resource, get_resources

    try:
        listing, _ = get_resource(_RESOURCE, package)
    except (LookupError, ValueError):
        near = hint(package, get_resources(_RESOURCE))
        raise UnknownNameError(f"Unknown package '{package}'{near}") from None
    folders = {kind.value for kind in kinds}
    # the files that a package lists; the generated .idl stand beside their sources
    suffixes = {'.idl', *(f'.{kind.value}' for kind in Kind)}
    files = [Path(line) for line in listing.splitlines() if line.strip()]
    return sorted(
        {
            f'{package}/{file.parent}/{file.stem}'
            for file in files
            if str(file.parent) in folders and file.suffix in suffixes
        }
    )


def all_interfaces(kinds: Iterable[Kind] = Kind) -> Mapping[str, list[str]]:
    """Return the names of all interfaces by package, both sorted; no package without any."""
    from ament_index_python import get_resources

    wanted = tuple(kinds)
    by_package = {name: interfaces_of(name, wanted) for name in sorted(get_resources(_RESOURCE))}
    return {package: names for package, names in by_package.items() if names}


def _near(name: str, kinds: Iterable[Kind] = Kind) -> str:
    return hint(name, [each for names in all_interfaces(kinds).values() for each in names])


def class_of(name: str, kind: Kind, refusal: str) -> InterfaceClass:
    """Import the Python class of `package/kind/Name`, or `package/Name`.

    Raises:
        BadTypeError: It cannot be imported; after the refusal of ros2cli, it names the nearest.
    """
    parts = name.split('/')
    if len(parts) == 2:
        parts.insert(1, kind.value)
    try:
        package, folder, base = parts
        found = getattr(importlib.import_module(f'{package}.{folder}'), base)
    except (AttributeError, ImportError, ValueError):
        raise BadTypeError(refusal + _near(name, [kind])) from None
    if folder != kind.value:
        raise BadTypeError(f'{refusal}: {name} is no {kind.name.lower()}')
    return found


def definition_path(name: str) -> Path:
    """Return the file that defines `package/kind/Name`: `.idl` only where it was written in that.

    Raises:
        UnknownNameError: The name is malformed or not installed; it names the nearest.
    """
    from ament_index_python import get_package_share_directory

    parts = name.split('/')
    if len(parts) != 3:
        raise UnknownNameError(
            f"Invalid name '{name}'. Expected three parts separated by '/'{_near(name)}"
        )
    package, folder, base = parts
    known = interfaces_of(package)
    if name not in known:
        raise UnknownNameError(f"Could not find the interface '{name}'{hint(name, known)}")
    share = Path(get_package_share_directory(package), folder)
    source = share / f'{base}.{folder}'
    return source if source.is_file() else share / f'{base}.idl'

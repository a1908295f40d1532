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


# the files that a package lists; the generated .idl stand beside their sources
_SUFFIXES = {Kind.MESSAGE: '.msg', Kind.SERVICE: '.srv', Kind.ACTION: '.action'}


def interface_packages() -> list[str]:
    """The packages that define interfaces.

    Returns:
        Their names, sorted.
    """
    from ament_index_python import get_resources

    return sorted(get_resources(_RESOURCE))


def interfaces_of(package: str, kinds: Iterable[Kind] = Kind) -> list[str]:
    """The interfaces of one package.

    Args:
        package: Its name.
        kinds: The wanted kinds.

    Returns:
        Names such as `std_msgs/msg/String`, sorted. Those that the generators derive from a
        service or an action are left out.

    Raises:
        UnknownNameError: When the package defines none; it names the nearest.
    """
    from ament_index_python import get_resource

    try:
        listing, _ = get_resource(_RESOURCE, package)
    except (LookupError, ValueError):
        near = hint(package, interface_packages())
        raise UnknownNameError(f"Unknown package '{package}'{near}") from None
    folders = {kind.value for kind in kinds}
    files = [Path(line) for line in listing.splitlines() if line.strip()]
    names = {
        f'{file.parent}/{file.stem}'
        for file in files
        if str(file.parent) in folders and file.suffix in {'.idl', *_SUFFIXES.values()}
    }
    return sorted(f'{package}/{name}' for name in names)


def all_interfaces(kinds: Iterable[Kind] = Kind) -> Mapping[str, list[str]]:
    """The interfaces of all packages.

    Args:
        kinds: The wanted kinds.

    Returns:
        The names by package, both sorted; packages without any are left out.
    """
    wanted = tuple(kinds)
    by_package = {name: interfaces_of(name, wanted) for name in interface_packages()}
    return {package: names for package, names in by_package.items() if names}


def class_of(name: str, kind: Kind, refusal: str) -> InterfaceClass:
    """Import the Python class of an interface.

    Args:
        name: `package/kind/Name`, or `package/Name`.
        kind: The wanted kind.
        refusal: Message of ros2cli when the type is not good, e.g. `The passed message type is
            invalid`.

    Returns:
        The generated class.

    Raises:
        BadTypeError: When it cannot be imported; it names the nearest types.
    """
    parts = name.split('/')
    if len(parts) == 2:
        parts.insert(1, kind.value)
    try:
        package, folder, base = parts
        found = getattr(importlib.import_module(f'{package}.{folder}'), base)
    except (AttributeError, ImportError, ValueError):
        raise BadTypeError(refusal + _near(name, kind)) from None
    if folder != kind.value:
        raise BadTypeError(f'{refusal}: {name} is no {kind.name.lower()}')
    return found


def _near(name: str, kind: Kind) -> str:
    known = [entry for names in all_interfaces([kind]).values() for entry in names]
    return hint(name, known)


def definition_path(name: str) -> Path:
    """The file that defines an interface.

    Args:
        name: `package/kind/Name`.

    Returns:
        Its `.msg`, `.srv` or `.action` file, or the `.idl` where it was written in that.

    Raises:
        UnknownNameError: When the name is malformed or not installed; it names the nearest.
    """
    parts = name.split('/')
    if len(parts) != 3:
        known = [entry for names in all_interfaces().values() for entry in names]
        raise UnknownNameError(
            f"Invalid name '{name}'. Expected three parts separated by '/'{hint(name, known)}"
        )
    package, folder, base = parts
    known = interfaces_of(package)
    if name not in known:
        raise UnknownNameError(f"Could not find the interface '{name}'{hint(name, known)}")
    return _source_file(package, Kind(folder), base)


def _source_file(package: str, kind: Kind, base: str) -> Path:
    from ament_index_python import get_package_share_directory

    folder = Path(get_package_share_directory(package), kind.value)
    source = folder / f'{base}{_SUFFIXES[kind]}'
    return source if source.is_file() else folder / f'{base}.idl'

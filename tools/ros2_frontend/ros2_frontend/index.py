# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finds installed packages, executables, and interfaces with their definitions and classes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import Enum
import importlib
import os
from pathlib import Path
import sys

from message_definitions import nested_type

from .cli.commands import FrontendError, hint, UnknownNameError
from .names import InterfaceClass

_RESOURCE = 'rosidl_interfaces'


def package_prefixes() -> Mapping[str, str]:
    """Return the prefix path of each installed package by its name, sorted."""
    from ament_index_python.packages import get_packages_with_prefixes

    try:
        prefixes: dict[str, str] = get_packages_with_prefixes()
    except OSError as error:  # AMENT_PREFIX_PATH is missing or empty
        raise FrontendError(f'{error}\nSource env.sh in this shell first.') from error
    return dict(sorted(prefixes.items()))


def prefix_of(package: str, message: str = "Package '{0}' not found") -> Path:
    """Return the prefix path of a package.

    Raises:
        UnknownNameError: There is no such package; the error names the nearest, or how to source
            one of this workspace. `message` may contain `{0}` for the name.
    """
    prefixes = package_prefixes()
    if package not in prefixes:
        remedy = _remedy(package, Path(sys.executable).parents[2]) or hint(package, prefixes)
        raise UnknownNameError(message.format(package) + remedy)
    return Path(prefixes[package])


def _remedy(package: str, workspace: Path) -> str:
    """Return the remedy for a package that is in the workspace but not found."""
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


class Kind(Enum):
    """A kind of interface; the value is its folder, and the middle part of a type's name."""

    MESSAGE = 'msg'
    SERVICE = 'srv'
    ACTION = 'action'


def interfaces_of(package: str, kinds: Iterable[Kind] = Kind) -> list[str]:
    """Return the interfaces of one package, e.g. `std_msgs/msg/String`, sorted.

    Those that the generators derive from a service or an action are left out.
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
    """Return the names of all interfaces by package, both sorted; omit packages without any."""
    from ament_index_python import get_resources

    wanted = tuple(kinds)
    by_package = {name: interfaces_of(name, wanted) for name in sorted(get_resources(_RESOURCE))}
    return {package: names for package, names in by_package.items() if names}


def _near(name: str, kinds: Iterable[Kind] = Kind) -> str:
    return hint(name, [each for names in all_interfaces(kinds).values() for each in names])


def class_of(name: str, kind: Kind, refusal: str) -> InterfaceClass:
    """Import the Python class of `package/kind/Name`, or `package/Name`.

    Raises:
        FrontendError: It cannot be imported; the message is `refusal` (as in ros2cli) and the
            nearest name.
    """
    parts = name.split('/')
    if len(parts) == 2:
        parts.insert(1, kind.value)
    try:
        package, folder, base = parts
        found = getattr(importlib.import_module(f'{package}.{folder}'), base)
    except (AttributeError, ImportError, ValueError):
        raise FrontendError(refusal + _near(name, [kind])) from None
    if folder != kind.value:
        raise FrontendError(f'{refusal}: {name} is no {kind.name.lower()}')
    return found


def definition_path(name: str) -> Path:
    """Return the file that defines `package/kind/Name`: `.idl` only if it is the source."""
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


def expand(
    name: str, read: Callable[[str], str], comments: bool, nested_comments: bool, depth: int = 0
) -> Iterator[str]:
    """Yield the lines of `package/kind/Name`, each field of a message type followed by its lines.

    `comments` keeps comments and blank lines of the type, `nested_comments` those of its fields'
    types. Each level is indented by one more tab.
    """
    shown = nested_comments if depth else comments
    for line in read(name).splitlines():
        # rosidl, too, starts a comment at the first #
        text = line.rstrip() if shown else line.partition('#')[0].strip()
        if text or shown:
            yield '\t' * depth + text if text else ''
        nested = nested_type(line, name.partition('/')[0])
        if nested is not None:
            yield from expand(nested, read, comments, nested_comments, depth + 1)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Packages of the workspace: their manifests, dependencies, and fingerprints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
import os
from pathlib import Path
import xml.etree.ElementTree as ET

from .layout import fingerprint, WorkspaceError
from .underlay import Underlay

SEARCH_DEPTH = 2  # packages stand in the checkout, or in one folder of it
INTERFACE_GROUP = 'rosidl_interface_packages'
COPIES_FOLDER = 'interfaces'  # public packages that an underlay may have
_NOT_SOURCE = {'__pycache__', 'build', 'install', 'log'}
_PYTHON_BUILD_FILES = ('package.xml', 'setup.py', 'setup.cfg')
_SHARED_SETUP = Path(__file__).parents[1] / 'setup_package.py'  # which every setup.py runs


@dataclass(frozen=True, slots=True)
class Package:
    """A colcon package."""

    name: str  # its name
    folder: Path  # where it is
    build_type: str  # `ament_cmake` or `ament_python`
    dependencies: frozenset[str]  # all packages that it needs to be built and to run
    test_dependencies: frozenset[str]  # those that only its tests need
    is_interface: bool  # whether it consists of messages, services and actions
    is_copy: bool  # whether it stands in for a public package

    @property
    def modules(self) -> list[Path]:
        """Folders of its Python packages; usually one, with its name."""
        return [path.parent for path in sorted(self.folder.glob('*/__init__.py'))]


def read_package(manifest: Path) -> Package:
    """Read a package.xml (REP 149)."""
    root = ET.parse(manifest).getroot()  # noqa: S314  # our own file
    names = [(element.tag, (element.text or '').strip()) for element in root.iter()]
    needed = {name for tag, name in names if tag.endswith('depend') and tag != 'test_depend'}
    groups = {name for tag, name in names if tag == 'member_of_group'}
    return Package(
        name=root.findtext('name', '').strip(),
        folder=manifest.parent,
        build_type=root.findtext('export/build_type', 'ament_cmake').strip(),
        dependencies=frozenset(needed),
        test_dependencies=frozenset(name for tag, name in names if tag == 'test_depend'),
        is_interface=INTERFACE_GROUP in groups,
        is_copy=manifest.parent.parent.name == COPIES_FOLDER,
    )


def find_packages(root: Path) -> dict[str, Package]:
    """Find the packages of a checkout by their manifests."""
    patterns = ('*/' * depth + 'package.xml' for depth in range(1, SEARCH_DEPTH + 1))
    manifests = (path for pattern in patterns for path in sorted(root.glob(pattern)))
    found = {}
    for manifest in manifests:
        parts = manifest.relative_to(root).parts
        hidden = any(part.startswith('.') or part in _NOT_SOURCE for part in parts)
        if not hidden and not (manifest.parent / 'COLCON_IGNORE').exists():
            package = read_package(manifest)
            found[package.name] = package
    return found


def needed_packages(
    packages: Mapping[str, Package],
    targets: Iterable[str],
    underlay: Underlay,
    *,
    tests: bool = False,
) -> dict[str, Package]:
    """Return the targets (default: all) and their dependencies, in build order.

    Our copies of public packages that the underlay has are omitted. `tests` adds test
    dependencies.

    Raises:
        WorkspaceError: A target is not in the workspace.
    """
    ordered: dict[str, Package] = {}
    visited: set[str] = set()

    def visit(name: str) -> None:
        package = packages.get(name)
        if package is None or name in visited:
            return
        visited.add(name)
        if package.is_copy and underlay.has_package(name):
            return
        wanted = package.dependencies | (package.test_dependencies if tests else frozenset())
        for dependency in sorted(wanted):
            visit(dependency)
        ordered[name] = package

    for target in sorted(targets) or sorted(packages):
        if target not in packages:
            raise WorkspaceError(
                f'There is no package {target} in this workspace.',
                f'It has: {", ".join(sorted(packages))}',
            )
        visit(target)
    return ordered


def _files(folder: Path) -> Iterator[Path]:
    for parent, folders, names in os.walk(folder):
        folders[:] = sorted(
            name
            for name in folders
            if name not in _NOT_SOURCE
            and not name.startswith('.')
            and not name.endswith('.egg-info')
        )
        yield from (Path(parent, name) for name in sorted(names))


def source_fingerprint(package: Package) -> str:
    """Hash everything that affects the build result.

    Modules and data files of a Python package are linked, not copied: their contents do not count,
    but their location does, and the names of data files (which setup.py lists).
    """
    linked = package.build_type == 'ament_python'
    parts: list[str | bytes] = []
    if linked:
        parts = [str(package.folder), _SHARED_SETUP.read_bytes()]
    for path in _files(package.folder):
        name = str(path.relative_to(package.folder))
        if not linked or name in _PYTHON_BUILD_FILES:
            parts += [name, path.read_bytes()]
        elif path.suffix not in {'.py', '.pyc'}:
            # a link into another package may have led nowhere when this one was built
            parts += [name, str(path.exists())]
    return fingerprint(*parts)

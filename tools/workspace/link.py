# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Links a Python package into an installation, as `colcon build --symlink-install` does.

colcon starts an interpreter two times for each package, which takes seconds; this takes none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import configparser
import fnmatch
import os
from pathlib import Path
import runpy
import sys
from types import ModuleType
from typing import Any
from unittest import mock

from .layout import WorkspaceError
from .packages import Package

PYTHON = Path('lib') / 'python'  # folder of an installation that stands in PYTHONPATH

_PROGRAM = """\
#!{python}
# Written by the set-up: {target}
import sys

if __name__ == '__main__':
    from {module} import {name}

    sys.exit({attribute}())
"""


def read_setup(folder: Path) -> dict[str, Any]:
    """Return the arguments with which the setup.py of a package calls setuptools.

    Raises:
        WorkspaceError: setup.py ends with an error.
    """
    arguments: dict[str, Any] = {}
    setuptools = ModuleType('setuptools')
    vars(setuptools).update(setup=arguments.update, find_packages=_find_packages)
    before = Path.cwd()
    os.chdir(folder)
    try:
        with (
            mock.patch.dict(sys.modules, {'setuptools': setuptools}),
            mock.patch.object(sys, 'argv', ['setup.py', 'develop']),
            mock.patch.object(sys, 'path', [*sys.path]),
        ):
            runpy.run_path('setup.py')
    except (Exception, SystemExit) as error:
        raise WorkspaceError(
            f'{folder / "setup.py"}: {type(error).__name__}: {error}', 'Correct it and run again.'
        ) from error
    finally:
        os.chdir(before)
    return arguments


def _find_packages(
    where: str = '.', exclude: Sequence[str] = (), include: Sequence[str] = ('*',)
) -> list[str]:
    """Find top-level packages, as setuptools does."""
    found = sorted(path.parent.name for path in Path(where).glob('*/__init__.py'))
    return [
        name
        for name in found
        if any(fnmatch.fnmatchcase(name, pattern) for pattern in include)
        and not any(fnmatch.fnmatchcase(name, pattern) for pattern in exclude)
    ]


def link_package(package: Package, install: Path, python: Path) -> None:
    """Link modules and data files, and write programs.

    Args:
        package: A Python package.
        install: The installation.
        python: The interpreter for the programs.

    Raises:
        WorkspaceError: Its setup.py ends with an error, or names a missing file.
    """
    arguments = read_setup(package.folder)
    manifest = install / 'share' / package.name / 'package.xml'
    links = {
        install / PYTHON / name: package.folder / name
        for name in {each.partition('.')[0] for each in arguments.get('packages', ())}
    }
    for target, files in arguments.get('data_files', ()):
        links |= {install / target / Path(file).name: package.folder / file for file in files}
    links.pop(manifest, None)
    for source in links.values():
        if not source.exists():
            raise WorkspaceError(
                f'{source} is not there, and setup.py installs it.', 'Correct one of them.'
            )
    setup = configparser.ConfigParser()
    setup.read(package.folder / 'setup.cfg')
    programs = setup.get('install', 'install_scripts', fallback=f'lib/{package.name}')
    entry_points: Mapping[str, Sequence[str]] = arguments.get('entry_points', {})
    for line in entry_points.get('console_scripts', ()):
        program, target = (part.strip() for part in line.split('=', 1))
        module, _, attribute = target.partition(':')
        text = _PROGRAM.format(
            python=python,
            target=target,
            module=module,
            name=attribute.partition('.')[0],
            attribute=attribute,
        )
        path = install / programs.removeprefix('$base/') / program
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)
    version = arguments.get('version', '0')
    information = install / PYTHON / f'{package.name}-{version}.dist-info'
    information.mkdir(parents=True, exist_ok=True)
    metadata = f'Metadata-Version: 2.1\nName: {package.name}\nVersion: {version}\n'
    (information / 'METADATA').write_text(metadata)
    groups = ('\n'.join([f'[{group}]', *lines]) for group, lines in entry_points.items())
    (information / 'entry_points.txt').write_text('\n\n'.join(groups) + '\n')
    # with the manifest, the last one, the package counts as built
    for link, source in {**links, manifest: package.folder / 'package.xml'}.items():
        link.parent.mkdir(parents=True, exist_ok=True)
        link.unlink(missing_ok=True)
        link.symlink_to(source)

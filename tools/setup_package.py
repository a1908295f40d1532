# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What setup.py of every Python package has in common; each runs this file.

colcon links setup.py into its build folder, and pip builds in a place without our packages, so
setup.py finds this file by its own resolved path.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
import sys
import xml.etree.ElementTree as ET

import setuptools

CHECKOUT = Path(__file__).resolve().parents[1]


def setup_package(
    *,
    requires: Sequence[str] = (),
    extras: Mapping[str, Sequence[str]] | None = None,
    programs: Sequence[str] = (),
    commands: Sequence[str] = (),
    package_data: Sequence[str] = (),
    folders: Sequence[str] = (),
    entry_points: Mapping[str, Sequence[str]] | None = None,
) -> None:
    """Describe the package whose package.xml is in the working directory; that has name and texts.

    Args:
        requires: What it needs without ROS: lines of pip; `./name` is a package of this checkout.
        extras: The same for each extra; `ros` is what its nodes need besides.
        programs: Entry points of `ros2 run`.
        commands: Entry points that pip installs.
        package_data: Patterns of files beside its modules.
        folders: Patterns of folders whose files are installed in its share folder.
        entry_points: Other groups.
    """
    manifest = ET.parse('package.xml').getroot()  # noqa: S314  # our own file
    name = manifest.findtext('name', '')
    maintainer = manifest.find('maintainer')
    # colcon runs one of these commands; pip asks for a wheel: what needs `ros2 run` is not in it
    for_ros = not {'develop', 'install'}.isdisjoint(sys.argv)
    marks = sorted(str(path) for path in Path().glob('resource/*'))
    tops = [path.parent.name for path in sorted(Path().glob('*/__init__.py'))]
    setuptools.setup(
        name=name,
        version=manifest.findtext('version', ''),
        description=manifest.findtext('description', ''),
        license=manifest.findtext('license', ''),
        maintainer=manifest.findtext('maintainer', ''),
        maintainer_email='' if maintainer is None else maintainer.get('email', ''),
        python_requires='>=3.10',
        packages=setuptools.find_packages(include=[*tops, *(f'{top}.*' for top in tops)]),
        package_data={top: ['py.typed', *package_data] for top in tops},
        data_files=[
            ('share/ament_index/resource_index/packages', marks),
            (f'share/{name}', ['package.xml']),
            *_data_files(name, folders),
        ],
        install_requires=[*map(_requirement, requires)],
        extras_require={
            'test': ['pytest'],  # colcon test runs pytest where it is named
            **{extra: [*map(_requirement, lines)] for extra, lines in (extras or {}).items()},
        },
        entry_points={
            **(entry_points or {}),
            'console_scripts': [*(programs if for_ros else commands)],
        },
        zip_safe=False,
    )


def _data_files(name: str, patterns: Iterable[str]) -> list[tuple[str, list[str]]]:
    folders = [folder for pattern in patterns for folder in sorted(Path().glob(pattern))]
    # a link whose target is missing must fail the build, not be passed over
    return [
        (
            f'share/{name}/{str(folder).removeprefix(f"{name}/")}',
            sorted(str(path) for path in folder.iterdir() if not path.is_dir()),
        )
        for folder in folders
    ]


def _requirement(line: str) -> str:
    """Require a package of this checkout as it stands here, and never one of that name on PyPI.

    A wheel is for the machine that built it: it names the folder. An sdist has no neighbours.
    """
    if not line.startswith('./'):
        return line
    name = line.removeprefix('./')
    for path in (CHECKOUT / name, CHECKOUT / 'libraries' / name):
        if path.is_dir():
            return f'{name} @ {path.as_uri()}'
    raise SystemExit(f'{name} is missing: install from a checkout of the whole repository')

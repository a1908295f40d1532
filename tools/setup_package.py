# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Common part of all setup.py files; each runs this file.

colcon links setup.py into its build folder, and pip builds in a folder without our packages, so
setup.py finds this file by its own resolved path.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
import sys
import xml.etree.ElementTree as ET

CHECKOUT = Path(__file__).resolve().parents[1]
REQUIREMENTS: Mapping[str, Sequence[str]] = {
    'coal': ['coal>=3'],
    'pinocchio': ['pin>=3.3'],
    'python3-can': ['python-can>=4.3'],
    'python3-coacd-pip': ['coacd>=1.0.7'],
    'python3-daqp-pip': ['daqp>=0.5'],
    'python3-evdev': ['evdev>=1.6; sys_platform == "linux"'],
    'python3-gymnasium-pip': ['gymnasium>=1.1'],
    'python3-mcap-pip': ['mcap>=1.6'],
    'python3-msgpack': ['msgpack>=1.0.3'],
    'python3-mujoco-pip': [
        "mujoco-core; python_version >= '3.11'",
        "mujoco<4; python_version < '3.11'",
    ],
    'python3-numpy': ['numpy>=1.26'],
    'python3-onnxruntime-pip': ['onnxruntime>=1.19'],
    'python3-protobuf': ['protobuf>=4.21'],
    'python3-rich': ['rich>=13'],
    'python3-ruckig-pip': ['ruckig>=0.19'],
    'python3-serial': ['pyserial>=3.5'],
    'python3-pycollada-pip': ['pycollada'],
    'python3-trimesh-pip': ['trimesh'],
    'python3-viser-pip': ['viser'],
    'python3-websockets': ['websockets'],
    'python3-yaml': ['PyYAML>=6'],
    'python3-zstandard': ['zstandard>=0.21'],
    'xacro': ['xacro>=2'],
}
"""The pip requirements of each rosdep key in our package.xml files."""


def setup_package(
    *,
    extras: Mapping[str, Sequence[str]] | None = None,
    programs: Sequence[str] = (),
    commands: Sequence[str] = (),
    package_data: Sequence[str] = (),
    folders: Sequence[str] = (),
    entry_points: Mapping[str, Sequence[str]] | None = None,
) -> None:
    """Describe the package whose package.xml is in the working directory.

    It provides name, texts and dependencies: pip installs the packages for the keys of
    `exec_depend`, without those of ROS.

    Args:
        extras: Packages by extra: rosdep keys, packages of this checkout, or pip requirements;
            `ros` has those of the nodes.
        programs: Entry points for `ros2 run`.
        commands: Entry points that pip installs.
        package_data: Patterns of files beside its modules.
        folders: Patterns of folders whose files are installed in its share folder.
        entry_points: Entry points of other groups.
    """
    import setuptools

    manifest = ET.parse('package.xml').getroot()  # noqa: S314  # our own file
    name = manifest.findtext('name', '')
    maintainer = manifest.find('maintainer')
    # colcon runs one of these commands; pip asks for a wheel: what needs `ros2 run` is not in it
    for_ros = not {'develop', 'install'}.isdisjoint(sys.argv)
    marks = sorted(str(path) for path in Path().glob('resource/*'))
    if not (CHECKOUT / 'libraries').is_dir():
        raise SystemExit(f'{name}: install it from a checkout of the whole repository')
    needed = {element.text or '' for element in manifest.iter('exec_depend')}
    needed -= {key for keys in (extras or {}).values() for key in keys}
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
        install_requires=_requirements(key for key in sorted(needed) if _is_for_pip(key)),
        extras_require={
            'test': ['pytest'],  # colcon test runs pytest where it is named
            **{extra: _requirements(keys) for extra, keys in (extras or {}).items()},
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


def _is_for_pip(key: str) -> bool:
    return key in REQUIREMENTS or _folder(key) is not None


def _folder(name: str) -> Path | None:
    """Return the folder of a Python package of this checkout."""
    places = (CHECKOUT / name, CHECKOUT / 'libraries' / name)
    return next((path for path in places if (path / 'setup.py').is_file()), None)


def _requirements(keys: Iterable[str]) -> list[str]:
    """Return pip requirements; packages of this checkout by path, never by name from PyPI.

    So a wheel works only on the machine that built it, as it names the folder.
    """
    lines: list[str] = []
    for key in keys:
        folder = _folder(key)
        lines += [f'{key} @ {folder.as_uri()}'] if folder else REQUIREMENTS.get(key, [key])
    return lines

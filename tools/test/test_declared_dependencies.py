# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What package.xml of each package declares is what its modules import, and what is pinned."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from pathlib import Path
import re
import runpy
import shutil
import sys
from typing import Any
import xml.etree.ElementTree as ET

import pytest
import yaml

from workspace.layout import this_checkout
from workspace.packages import find_packages

LAYOUT = this_checkout()
PACKAGES = {
    name: package
    for name, package in find_packages(LAYOUT.root).items()
    if package.build_type == 'ament_python'
}
DISTRIBUTIONS = {'can': 'python-can', 'pinocchio': 'pin', 'serial': 'pyserial', 'yaml': 'PyYAML'}
DISTRIBUTIONS |= {'google': 'protobuf', 'mujoco': 'mujoco-core'}
"""Names on PyPI of what is imported under another one."""
REQUIREMENTS: dict[str, list[str]] = runpy.run_path(str(LAYOUT.root / 'tools/setup_package.py'))[
    'REQUIREMENTS'
]
ROSDEP = {re.split('[^\\w-]', lines[0])[0]: key for key, lines in REQUIREMENTS.items()}
"""Keys of rosdep for what is on PyPI."""
ON_PYPI = {*DISTRIBUTIONS, *ROSDEP}
OF_TESTS = {
    'canopen': 'canopen-pip',
    'hypothesis': 'python3-hypothesis',
    'mcap_ros2': 'mcap-ros2-support',
    'onnx': 'python3-onnx-pip',
    'pytest': 'python3-pytest',
    'rosbags': 'python3-rosbags-pip',
}
"""Keys of rosdep for what only tests import."""
PROGRAMS = {'iproute2', 'tmux'}  # keys of rosdep for programs that tests start
STARTED = {'arm_bringup': {'canopen_sim', 'robot_viewer'}}
STARTED |= {'quad_bringup': {'quad_hardware', 'quad_sim', 'quad_teleop', 'robot_viewer'}}
"""Packages whose executables a bring-up starts; it imports nothing of them."""
OPTIONAL = {
    'arm_bringup': {
        *('arm_model', 'arm_planning', 'arm_servo', 'arm_trajectory', 'python3-numpy'),
        *('control_msgs', 'moveit_msgs', 'pinocchio', 'shape_msgs'),
    },
    'quad_sim': {'python3-gymnasium-pip'},
}
"""Packages that are used where they are built, and that colcon need not build for this one."""
FOR_PEOPLE = {'arm_bringup': {'canopen_tools'}}
"""Packages whose commands look at what a bring-up started."""
READERS = {'robot_viewer': {'python3-pycollada-pip'}}
"""What a library imports that is imported, for one format of a file."""
OF_MODULES = {
    module.name: name for name, package in PACKAGES.items() for module in package.modules
}
"""Package of each module at the top."""
PHYSICS = {'mujoco'}  # mujoco-core, or below Python 3.11 mujoco


def described(folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Return what the setup.py of a folder says for a wheel."""
    keywords: dict[str, Any] = {}
    monkeypatch.setattr('setuptools.setup', keywords.update)
    monkeypatch.chdir(folder)
    monkeypatch.setattr(sys, 'argv', ['setup.py', 'bdist_wheel'])
    runpy.run_path('setup.py')
    return keywords


def declared(name: str, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Return the requirements of a package, extras included: name and versions."""
    keywords = described(PACKAGES[name].folder, monkeypatch)
    extras = (
        lines for name, lines in keywords.get('extras_require', {}).items() if name != 'test'
    )
    lines = [*keywords.get('install_requires', []), *(line for lines in extras for line in lines)]
    split = (re.match(r'([\w-]+)\s*(.*)', line) for line in lines)
    return {match[1]: match[2] for match in split if match is not None}


def imported(*folders: Path) -> Iterator[str]:
    """Yield the packages that modules import, but for those that only type checkers do."""
    for folder in folders:
        for path in folder.rglob('*.py'):
            yield from (OF_MODULES.get(module, module) for module in modules_of(path))


def modules_of(path: Path) -> Iterator[str]:
    """Yield the packages that one module imports."""
    todo: list[ast.AST] = [ast.parse(path.read_text(encoding='utf-8'))]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.If) and getattr(node.test, 'id', '') == 'TYPE_CHECKING':
            todo += node.orelse
            continue
        if isinstance(node, ast.Import):
            yield from (alias.name.partition('.')[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield (node.module or '').partition('.')[0]
        todo += ast.iter_child_nodes(node)


@pytest.mark.slow
@pytest.mark.parametrize('name', OPTIONAL)
def test_what_is_imported_is_declared(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is missing after `pip install`, in extras either; the rest is in package.xml."""
    used = {*imported(*PACKAGES[name].modules)} - {name}
    needed = {DISTRIBUTIONS.get(each, each) for each in used & {*ON_PYPI, *PACKAGES}}
    needed |= STARTED.get(name, set())
    found = {*declared(name, monkeypatch)} - PHYSICS
    assert not needed - found, f'add to package.xml, or to extras in {name}/setup.py'


def keys(name: str, *tags: str) -> set[str]:
    """Return what package.xml names under these tags."""
    elements = ET.parse(PACKAGES[name].folder / 'package.xml').getroot()  # noqa: S314
    return {(element.text or '').strip() for element in elements if element.tag in tags}


def keys_of_imports(modules: Iterable[str]) -> set[str]:
    """Return the keys of what is imported, but for Python's own library."""
    names = {each for each in modules if each not in sys.stdlib_module_names}
    distributions = {DISTRIBUTIONS.get(each, each) for each in names}
    return {{**ROSDEP, **OF_TESTS}.get(each, each) for each in distributions}


def helpers() -> set[str]:
    """Return the modules beside all tests, which tests import by their name."""
    beside = ('test', 'bench', 'training')
    folders = [each.folder / name for each in PACKAGES.values() for name in beside]
    folders += [LAYOUT.root / 'tests']
    return {path.stem for folder in folders for path in folder.rglob('*.py')}


@pytest.mark.slow
@pytest.mark.parametrize('name', PACKAGES)
def test_what_is_imported_has_its_key(name: str) -> None:
    """`rosdep install` and colcon find in package.xml what the modules import, and no more."""
    folder = PACKAGES[name].folder
    modules = {*imported(*PACKAGES[name].modules, folder / 'launch')} - {name}
    found = keys(name, 'exec_depend', 'depend')
    others = (table.get(name, set()) for table in (STARTED, FOR_PEOPLE, READERS))
    needed = keys_of_imports(modules).union(*others)
    missing = needed - found - OPTIONAL.get(name, set())
    assert not missing, f'add an exec_depend to {name}/package.xml'
    assert not found - needed, f'{name} imports none of these: remove them from its package.xml'


@pytest.mark.slow
@pytest.mark.parametrize('name', PACKAGES)
def test_what_tests_import_has_its_key(name: str) -> None:
    """As a test_depend, unless the modules need it, too."""
    own, found = keys(name, 'exec_depend', 'depend'), keys(name, 'test_depend')
    modules = {*imported(PACKAGES[name].folder / 'test')} - helpers() - {name}
    missing = keys_of_imports(modules) - own - found - OPTIONAL.get(name, set())
    assert not missing, f'add a test_depend to {name}/package.xml'
    assert not found & own, f'{name}/package.xml names these twice'


def test_every_key_is_known_to_rosdep() -> None:
    """A key is of this checkout or of ROS, or stands in one of the lists above."""
    ours = yaml.safe_load((LAYOUT.root / 'tools' / 'rosdep.yaml').read_text())
    public = {*ROSDEP.values(), *OF_TESTS.values(), *PROGRAMS} - ours.keys()
    named = {key for name in PACKAGES for key in keys(name, 'exec_depend', 'test_depend')}
    python = {key for key in named if key.startswith('python3-') or key.endswith('-pip')}
    assert python <= public | ours.keys()
    assert ours.keys() <= named
    for key, systems in ours.items():
        assert systems['ubuntu'] == systems['debian']
        (distribution,) = systems['ubuntu']['pip']['packages']
        assert {**ROSDEP, **OF_TESTS}[distribution] == key


def test_every_key_that_the_container_skips_is_used() -> None:
    """A key that no package names would hide one that is misspelt."""
    named = {key for name in PACKAGES for key in keys(name, 'exec_depend')}
    assert REQUIREMENTS.keys() - named == {'python3-gymnasium-pip'}  # of an extra


@pytest.mark.parametrize('name', PACKAGES)
def test_what_setup_py_asks_for_is_there(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests by pytest, packages of the checkout from it, versions and a Python that are tested.

    Where setup.py does not name pytest, colcon runs no test and reports success. A package of the
    name of a neighbour on PyPI is never installed.
    """
    keywords = described(PACKAGES[name].folder, monkeypatch)
    assert (PACKAGES[name].folder / 'test').is_dir()
    assert 'pytest' in keywords.get('extras_require', {}).get('test', [])
    assert 'python3-pytest' in keys(name, 'test_depend')
    settings = (LAYOUT.root / 'pyproject.toml').read_text()
    (checked,) = re.findall("\npython_version = '(.*)'", settings)
    assert keywords['python_requires'] == f'>={checked}'
    text = ''.join(path.read_text() for path in LAYOUT.requirements.glob('*.txt'))
    for other, versions in declared(name, monkeypatch).items():
        if other in PACKAGES:
            assert versions == f'@ {PACKAGES[other].folder.as_uri()}'
            continue
        pinned = re.findall(rf'^{other}==([\d.]+)', text, re.MULTILINE | re.IGNORECASE)
        assert pinned, f'{other} is in no file of tools/requirements'
        oldest = re.match(r'>=([\d.]+)(;|$)', versions)
        if oldest is not None:
            assert all(number(version) >= number(oldest[1]) for version in pinned)


def test_what_only_linux_has_is_required_there_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rest of teleop works elsewhere, and evdev cannot be built there."""
    assert declared('teleop', monkeypatch)['evdev'].endswith('; sys_platform == "linux"')


def test_without_its_neighbours_a_package_is_not_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of that name on PyPI would be anybody's."""
    folder, tools = tmp_path / 'arm_trajectory', tmp_path / 'tools'
    folder.mkdir()
    tools.mkdir()
    shutil.copy(LAYOUT.root / 'tools' / 'setup_package.py', tools)
    for name in ('setup.py', 'package.xml'):
        shutil.copy(PACKAGES['arm_trajectory'].folder / name, folder)
    with pytest.raises(SystemExit, match='arm_trajectory: install it from a checkout'):
        described(folder, monkeypatch)


def number(version: str) -> tuple[int, ...]:
    """Return a version as numbers that compare."""
    return tuple(map(int, version.split('.')))

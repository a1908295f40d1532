# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What setup.py of each package declares is what its modules import, and what is pinned."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path
import re
import runpy
import shutil
import sys
from typing import Any

import pytest

from workspace.layout import this_checkout
from workspace.packages import find_packages

LAYOUT = this_checkout()
PACKAGES = {
    name: package
    for name, package in find_packages(LAYOUT.root).items()
    if package.build_type == 'ament_python'
}
DISTRIBUTIONS = {'can': 'python-can', 'pinocchio': 'pin', 'serial': 'pyserial', 'yaml': 'PyYAML'}
DISTRIBUTIONS |= {'mujoco': 'mujoco-core'}
"""Names on PyPI of what is imported under another one."""
ON_PYPI = {*DISTRIBUTIONS, 'coal', 'daqp', 'evdev', 'msgpack', 'numpy', 'onnxruntime', 'psutil'}
ON_PYPI |= {'rich', 'ruckig', 'xacro'}
ROSDEP = {
    'PyYAML': 'python3-yaml',
    'evdev': 'python3-evdev',
    'msgpack': 'python3-msgpack',
    'numpy': 'python3-numpy',
    'onnxruntime': 'python3-onnxruntime-pip',
    'pyserial': 'python3-serial',
    'python-can': 'python3-can',
    'rich': 'python3-rich',
    'xacro': 'xacro',
}
"""Keys of rosdep for those that have one."""
STARTED = {'arm_bringup': {'canopen_sim', 'robot_viewer'}}
STARTED |= {'quad_bringup': {'quad_hardware', 'quad_sim', 'quad_teleop', 'robot_viewer'}}
"""Packages whose executables a bring-up starts; it imports nothing of them."""
OPTIONAL = {
    'arm_bringup': {'arm_model', 'arm_planning', 'arm_servo', 'arm_trajectory', 'python3-numpy'}
}
"""Packages that are used where they are built, and that colcon need not build for this one."""
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
    extras = keywords.get('extras_require', {}).values()
    lines = [*keywords.get('install_requires', []), *(line for lines in extras for line in lines)]
    split = (re.match(r'([\w-]+)\s*(.*)', line) for line in lines)
    return {match[1]: match[2] for match in split if match is not None}


def imported(folder: Path) -> Iterator[str]:
    """Yield the packages that modules import, but for those that only type checkers do."""
    for path in folder.rglob('*.py'):
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
@pytest.mark.parametrize('name', PACKAGES)
def test_what_is_imported_is_declared(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is missing after `pip install`, and nothing is installed for no use."""
    used = {each for each in imported(PACKAGES[name].folder / name) if each != name}
    needed = {DISTRIBUTIONS.get(each, each) for each in used & {*ON_PYPI, *PACKAGES}}
    needed |= STARTED.get(name, set())
    found = {*declared(name, monkeypatch)} - PHYSICS
    assert not needed - found, f'add to install_requires or extras_require of {name}/setup.py'
    assert not found - needed, f'{name} imports none of these: remove them from its setup.py'


@pytest.mark.parametrize('name', PACKAGES)
def test_what_pip_installs_is_declared_for_colcon_and_rosdep(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What setup.py names package.xml names, too, but for what is optional or has no key."""
    named = {*declared(name, monkeypatch)}
    keys = named & PACKAGES.keys() | {ROSDEP[each] for each in named & ROSDEP.keys()}
    missing = keys - PACKAGES[name].dependencies - OPTIONAL.get(name, set())
    assert not missing, f'add an exec_depend to {name}/package.xml'


@pytest.mark.parametrize('name', PACKAGES)
def test_packages_of_the_checkout_are_taken_from_it(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody gets a package of the same name from PyPI."""
    for other, where in declared(name, monkeypatch).items():
        if other in PACKAGES:
            assert where == f'@ {PACKAGES[other].folder.as_uri()}'


@pytest.mark.parametrize('name', PACKAGES)
def test_what_is_pinned_is_new_enough(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The environment in which all is tested has versions that setup.py takes."""
    text = ''.join(path.read_text() for path in LAYOUT.requirements.glob('*.txt'))
    for other, versions in declared(name, monkeypatch).items():
        if other in PACKAGES:
            continue
        pinned = re.findall(rf'^{other}==([\d.]+)', text, re.MULTILINE | re.IGNORECASE)
        assert pinned, f'{other} is in no file of tools/requirements'
        oldest = re.match(r'>=([\d.]+)(;|$)', versions)
        if oldest is not None:
            assert all(number(version) >= number(oldest[1]) for version in pinned)


@pytest.mark.parametrize('name', PACKAGES)
def test_what_runs_on_older_python_than_the_code_is_refused(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The code is checked for the Python that setup.py asks for."""
    checked = re.search("\npython_version = '(.*)'", (LAYOUT.root / 'pyproject.toml').read_text())
    assert checked is not None
    keywords = described(PACKAGES[name].folder, monkeypatch)
    assert keywords['python_requires'] == f'>={checked[1]}'


def test_what_only_linux_has_is_required_there_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rest of operator_input works elsewhere, and evdev cannot be built there."""
    assert declared('operator_input', monkeypatch)['evdev'].endswith('; sys_platform == "linux"')


def test_without_its_neighbours_a_package_is_not_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of that name on PyPI would be anybody's."""
    shutil.copy(PACKAGES['arm_trajectory'].folder / 'setup.py', tmp_path)
    with pytest.raises(SystemExit, match='arm_model is missing: install from a checkout'):
        described(tmp_path, monkeypatch)


@pytest.mark.parametrize('copied', [r'def sibling\((?:.|\n)*?\n\n\n', r'.*\n\n?FOR_ROS = .*'])
def test_what_every_setup_py_has_to_repeat_is_the_same_everywhere(copied: str) -> None:
    """Nothing of ours can be imported where pip builds a package."""
    texts = [(package.folder / 'setup.py').read_text() for package in PACKAGES.values()]
    copies = [copy for text in texts for copy in re.findall(copied, text)]
    assert len(copies) > 10
    assert len(set(copies)) == 1


def number(version: str) -> tuple[int, ...]:
    """Return a version as numbers that compare."""
    return tuple(map(int, version.split('.')))

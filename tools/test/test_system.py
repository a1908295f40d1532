# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the system has: interpreter, programs, packages of apt, ROS."""

from dataclasses import replace
from pathlib import Path
import re
import sys

import pytest

from workspace.layout import WorkspaceError
from workspace.system import (
    check,
    check_supported,
    Interpreter,
    missing_packages,
    probe,
    SYSTEM_ROS_PACKAGES,
)
from workspace.underlay import find_underlay, PREFIX_VARIABLE, Underlay, UnderlayKind

PYTHON = Interpreter('/usr/bin/python3.11', (3, 11), 'x86_64', has_headers=True, has_venv=True)
WHEELS = Underlay(UnderlayKind.WHEELS, Path('/checkout/.venv'))
ROOT = Path('/checkout')


BARE = replace(PYTHON, has_headers=False, has_venv=False)


@pytest.mark.parametrize(
    ('python', 'absent', 'missing'),
    [
        (PYTHON, '', ()),
        (BARE, '.*', ('g++', 'git', 'python3.11-venv', 'python3.11-dev')),
        (PYTHON, '.*g[+][+]', ()),  # another compiler will do
    ],
    ids=['complete', 'bare', 'clang alone'],
)
def test_all_that_is_missing_is_named_at_once(
    python: Interpreter, absent: str, missing: tuple[str, ...]
) -> None:
    """Compiler, git and the parts of the right Python."""
    found = missing_packages(
        WHEELS, python, lambda name: None if re.fullmatch(absent, name) else name
    )
    assert found == missing


def test_one_line_installs_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """It can be pasted."""
    monkeypatch.setattr('workspace.system.missing_packages', lambda *_: ('g++', 'git'))
    line = r'2 system packages are missing\.\n(?s:.*) sudo apt-get install g\+\+ git\n'
    with pytest.raises(WorkspaceError) as caught:
        check(WHEELS, PYTHON, ROOT)
    assert re.match(line, str(caught.value))


def test_packages_of_an_incomplete_system_ros_are_named(tmp_path: Path) -> None:
    """Beside /opt/ros/jazzy the ROS packages that it lacks are named as apt knows them."""
    index = tmp_path / 'share/ament_index/resource_index/packages'
    index.mkdir(parents=True)
    for name in set(SYSTEM_ROS_PACKAGES) - {'rosidl_default_generators'}:
        (index / name).touch()
    missing = missing_packages(Underlay(UnderlayKind.SYSTEM, tmp_path), PYTHON, str)
    assert missing == ('ros-jazzy-rosidl-default-generators',)


def test_incomplete_python_that_apt_does_not_know() -> None:
    """No apt-get line can complete an interpreter that was built by hand."""
    own = replace(PYTHON, path='/opt/bin/python3', has_venv=False)
    with pytest.raises(WorkspaceError, match='without venv'):
        missing_packages(WHEELS, own, str)


@pytest.mark.parametrize(
    ('python', 'root', 'words'),
    [
        (replace(PYTHON, version=(3, 9)), ROOT, r'3\.9.*not supported'),
        (replace(PYTHON, version=(3, 15)), ROOT, r'3\.15.*not supported'),
        (replace(PYTHON, machine='aarch64'), ROOT, 'no ROS wheels for aarch64'),
        (PYTHON, Path('/my checkout'), 'has a space'),
    ],
)
def test_unsupported_systems_are_refused(python: Interpreter, root: Path, words: str) -> None:
    """Each refusal names the cause, and says what to do in a second line."""
    with pytest.raises(WorkspaceError, match=words) as caught:
        check_supported(WHEELS, python, root)
    assert caught.value.remedy


def test_supported_systems(tmp_path: Path) -> None:
    """Python 3.10 to 3.14; with the system's ROS, which needs no wheels, on any machine."""
    for minor in range(10, 15):
        check_supported(WHEELS, replace(PYTHON, version=(3, minor)), ROOT)
    raspberry = replace(PYTHON, machine='aarch64')
    check_supported(Underlay(UnderlayKind.SYSTEM, tmp_path), raspberry, ROOT)


def test_probe_looks_through_a_virtual_environment() -> None:
    """The interpreter below is found, so that .venv is never made from itself."""
    found = probe(sys.executable)
    assert found.version == sys.version_info[:2]
    assert Path(found.path).resolve() == Path(sys.executable).resolve()
    assert not Path(found.path).is_relative_to(sys.prefix) or sys.prefix == sys.base_prefix


def test_probe_refuses_what_is_no_python() -> None:
    """A wrong PYTHON=... is answered with words."""
    with pytest.raises(WorkspaceError, match='does not start'):
        probe('/bin/false')


def test_a_python_that_the_systems_ros_is_not_built_for(tmp_path: Path) -> None:
    """Another Python could not load its extensions."""
    (tmp_path / 'lib/python3.12/site-packages/rclpy').mkdir(parents=True)
    with pytest.raises(WorkspaceError, match=r'built for python3\.12, not for python3\.11'):
        check_supported(Underlay(UnderlayKind.SYSTEM, tmp_path), PYTHON, ROOT)


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """A folder that looks like /opt/ros/jazzy."""
    made = tmp_path / 'ros'
    (made / 'share/ament_index/resource_index/packages').mkdir(parents=True)
    (made / 'lib/python3.12/site-packages/rclpy').mkdir(parents=True)
    (made / 'local_setup.bash').touch()
    return made


def test_system_ros_is_taken_when_it_is_there(prefix: Path, tmp_path: Path) -> None:
    """The prefix that the environment names, like /opt/ros/jazzy; the wheels otherwise."""
    found = find_underlay({PREFIX_VARIABLE: str(prefix)}, tmp_path / '.venv')
    assert found == Underlay(UnderlayKind.SYSTEM, prefix)
    assert found.python_name == 'python3.12'
    for absent in ('', '/nowhere'):
        found = find_underlay({PREFIX_VARIABLE: absent}, tmp_path)
        assert (found, found.python_name) == (Underlay(UnderlayKind.WHEELS, tmp_path), None)

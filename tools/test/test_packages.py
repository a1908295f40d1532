# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from collections.abc import Callable
from pathlib import Path

import pytest

from workspace.layout import Layout, this_checkout, WorkspaceError
from workspace.packages import find_packages, needed_packages, read_package, source_fingerprint
from workspace.underlay import Underlay, UnderlayKind

Add = Callable[..., Path]


@pytest.fixture
def empty(tmp_path: Path) -> Underlay:
    """A ROS that has no package."""
    return Underlay(UnderlayKind.WHEELS, tmp_path)


def test_packages_are_found_where_colcon_finds_them(layout: Layout, add_package: Add) -> None:
    """Also one folder down, but not in hidden folders, colcon's own, or ignored ones."""
    add_package('arm')
    add_package('tf2_msgs', folder='interfaces', build_type='ament_cmake')
    add_package('hidden', folder='.venv')
    add_package('built', folder='build')
    (add_package('ignored') / 'COLCON_IGNORE').touch()
    assert sorted(find_packages(layout.root)) == ['arm', 'tf2_msgs']


def test_a_target_gets_what_it_needs_in_order(
    layout: Layout, add_package: Add, empty: Underlay
) -> None:
    """Dependencies come first, indirect ones too; what the target does not need stays out."""
    add_package('bringup', 'canopen')
    add_package('canopen', 'zz_msgs', 'rclpy')
    add_package('zz_msgs', build_type='ament_cmake')
    add_package('quad', 'zz_msgs')
    packages = find_packages(layout.root)
    assert list(needed_packages(packages, ['bringup'], empty)) == ['zz_msgs', 'canopen', 'bringup']
    assert set(needed_packages(packages, [], empty)) == set(packages)


def test_what_only_tests_need_waits_for_the_tests(
    layout: Layout, add_package: Add, empty: Underlay
) -> None:
    """A demo builds no messages for the tests of what it runs."""
    add_package('plan_msgs', build_type='ament_cmake')
    add_package('page', tests='plan_msgs')
    add_package('bringup', 'page')
    packages = find_packages(layout.root)
    assert list(needed_packages(packages, ['bringup'], empty)) == ['page', 'bringup']
    with_tests = needed_packages(packages, ['bringup'], empty, tests=True)
    assert list(with_tests) == ['plan_msgs', 'page', 'bringup']


def test_copies_that_the_underlay_has_are_not_built(
    layout: Layout, add_package: Add, tmp_path: Path
) -> None:
    """The public package wins over our copy; a package of our own is built in any case."""
    add_package('tf2_msgs', folder='interfaces', build_type='ament_cmake')
    add_package('canopen_interfaces', folder='interfaces', build_type='ament_cmake')
    add_package('quad_msgs', build_type='ament_cmake')
    index = tmp_path / 'ros/share/ament_index/resource_index/packages'
    index.mkdir(parents=True)
    for name in ('tf2_msgs', 'quad_msgs'):
        (index / name).touch()
    system = Underlay(UnderlayKind.SYSTEM, tmp_path / 'ros')
    needed = needed_packages(find_packages(layout.root), [], system)
    assert sorted(needed) == ['canopen_interfaces', 'quad_msgs']


def test_circular_dependencies_do_not_hang(
    layout: Layout, add_package: Add, empty: Underlay
) -> None:
    """The search for what is needed ends; naming the circle is left to colcon."""
    add_package('one', 'two')
    add_package('two', 'one')
    assert needed_packages(find_packages(layout.root), ['one'], empty).keys() == {'one', 'two'}


def test_unknown_target_is_answered_with_the_known(
    layout: Layout, add_package: Add, empty: Underlay
) -> None:
    """A wrong name is named, with those that there are."""
    add_package('arm')
    with pytest.raises(WorkspaceError, match=r'no package leg(?s:.*)arm'):
        needed_packages(find_packages(layout.root), ['leg'], empty)


@pytest.mark.parametrize(
    ('build_type', 'name', 'counts'),
    [
        ('ament_cmake', 'msg/A.msg', 'contents'),
        ('ament_python', 'setup.py', 'contents'),
        ('ament_python', 'robots/arm.urdf', 'presence'),
        ('ament_python', 'pkg/core.py', ''),
        ('ament_python', 'pkg/__pycache__/core.pyc', ''),
    ],
)
def test_contents_count_where_they_are_copied(
    add_package: Add, build_type: str, name: str, counts: str
) -> None:
    """Of messages and build files; setup.py has to link a new data file, but no new module."""
    folder = add_package('pkg', build_type=build_type)
    package, path = read_package(folder / 'package.xml'), folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    seen = []
    for text in (None, 'one', 'two'):
        if text is not None:
            path.write_text(text)
        seen.append(source_fingerprint(package))
    assert (seen[0] != seen[1], seen[1] != seen[2]) == (counts != '', counts == 'contents')


@pytest.mark.parametrize('build_type', ['ament_cmake', 'ament_python'])
def test_a_moved_package_counts_where_it_is_linked(add_package: Add, build_type: str) -> None:
    """Links to where a Python package stood lead nowhere."""
    here = add_package('pkg', build_type=build_type)
    there = add_package('pkg', folder='libraries', build_type=build_type)
    before, after = (source_fingerprint(read_package(at / 'package.xml')) for at in (here, there))
    assert (before != after) == (build_type == 'ament_python')


def test_this_workspace_is_readable() -> None:
    """Every package of the checkout has the name of its folder."""
    packages = find_packages(this_checkout().root)
    assert packages
    assert all(name == package.folder.name for name, package in packages.items())

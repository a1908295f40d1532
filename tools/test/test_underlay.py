# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest

from workspace.underlay import find_underlay, PREFIX_VARIABLE, Underlay, UnderlayKind


@pytest.fixture
def prefix(tmp_path: Path) -> Path:
    """A folder that looks like /opt/ros/jazzy."""
    made = tmp_path / 'ros'
    (made / 'share/ament_index/resource_index/packages').mkdir(parents=True)
    (made / 'lib/python3.12/site-packages/rclpy').mkdir(parents=True)
    (made / 'local_setup.bash').touch()
    return made


def test_system_ros_is_taken_when_it_is_there(prefix: Path, tmp_path: Path) -> None:
    """The prefix that the environment names is used like /opt/ros/jazzy."""
    found = find_underlay({PREFIX_VARIABLE: str(prefix)}, tmp_path / '.venv')
    assert found == Underlay(UnderlayKind.SYSTEM, prefix)
    assert found.python_name == 'python3.12'


@pytest.mark.parametrize('value', ['', '/nowhere'])
def test_wheels_otherwise(value: str, tmp_path: Path) -> None:
    """An absent prefix leads to the wheels, and so does an empty one."""
    found = find_underlay({PREFIX_VARIABLE: value}, tmp_path)
    assert found == Underlay(UnderlayKind.WHEELS, tmp_path)
    assert found.python_name is None


def test_packages_are_looked_up_in_the_index(prefix: Path) -> None:
    """Only what the ament index lists is there; a mere folder is not."""
    underlay = Underlay(UnderlayKind.SYSTEM, prefix)
    (prefix / 'share/ament_index/resource_index/packages/tf2_msgs').touch()
    (prefix / 'share/control_msgs').mkdir()
    assert underlay.has_package('tf2_msgs')
    assert not underlay.has_package('control_msgs')

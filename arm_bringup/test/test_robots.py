# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot folders by name and by path, and the buses of the Panda and the PRBT."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest

from arm_bringup.robots import find_robot, read_bus, robot_names, RobotError, stream_mode_service
from arm_canopen import load_bus

ROBOTS = Path(__file__).parents[1] / 'robots'


def test_a_robot_is_found_by_name() -> None:
    """Bus and description are in its folder, by convention."""
    robot = find_robot('panda', ROBOTS)
    assert robot.name == 'panda'
    assert robot.bus_config == ROBOTS / 'panda' / 'bus.yml'
    assert robot.description == ROBOTS / 'panda' / 'panda.urdf.xacro'


def test_an_unknown_robot_lists_those_that_exist() -> None:
    """And shows how to give a folder of one's own."""
    with pytest.raises(RobotError, match=r"'pandora'.*robots: .*panda.*\./pandora"):
        find_robot('pandora', ROBOTS)


def test_a_folder_of_ones_own_is_given_by_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Relative paths count from where the user is."""
    folder = tmp_path / 'my_arm'
    folder.mkdir()
    (folder / 'bus.yml').touch()
    (folder / 'my_arm.urdf.xacro').touch()
    monkeypatch.chdir(tmp_path)
    robot = find_robot(f'.{os.sep}my_arm', ROBOTS)
    assert robot.name == 'my_arm'
    assert robot.bus_config == folder / 'bus.yml'
    assert robot_names(tmp_path) == ['my_arm']


def test_a_folder_that_lacks_files_says_which(tmp_path: Path) -> None:
    """All at once."""
    with pytest.raises(RobotError, match=rf'lacks bus.yml and {tmp_path.name}.urdf.xacro'):
        find_robot(f'{tmp_path}{os.sep}', ROBOTS)


def test_a_path_that_is_no_folder_says_so() -> None:
    """Not that files are missing in it."""
    with pytest.raises(RobotError, match='does not exist'):
        find_robot('./nowhere', ROBOTS)


def test_the_bus_of_the_panda_has_its_seven_joints() -> None:
    """The article's bus.yml, with its EDS, has no mistake and a drive for each joint."""
    bus = load_bus(ROBOTS / 'panda' / 'bus.yml')
    assert [node.name for node in bus.nodes] == [f'panda_joint{i}' for i in range(1, 8)]
    assert [node.node_id for node in bus.nodes] == list(range(2, 9))
    assert all(node.is_drive for node in bus.nodes)
    assert bus.master.sync_period == pytest.approx(0.01)
    assert bus.warnings == ()


def test_there_is_one_source_of_the_eds() -> None:
    """The Panda's EDS is that of the simulated drive, under the article's name."""
    eds = ROBOTS / 'panda' / 'cia402_slave.eds'
    assert eds.is_symlink()
    assert eds.resolve() == ROBOTS.parents[1] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'


def test_the_bus_of_the_prbt_has_its_six_joints() -> None:
    """Node ids 3 to 8 in mode 7, positions in thousandths of a degree; nothing odd in the file."""
    bus = load_bus(ROBOTS / 'prbt' / 'bus.yml')
    assert [node.name for node in bus.nodes] == [f'prbt_joint_{i}' for i in range(1, 7)]
    assert [node.node_id for node in bus.nodes] == list(range(3, 9))
    for node in bus.nodes:
        assert node.drive.position_mode == 7
        assert node.drive.scale_pos_to_dev == pytest.approx(math.degrees(1000.0), rel=1e-8)
        assert node.drive.scale_vel_to_dev == node.drive.scale_pos_to_dev
    assert bus.warnings == ()


def test_the_mode_of_streams_is_the_one_that_bus_yml_asks_for() -> None:
    """Interpolated position on the PRBT; the Panda asks for profile position, so cyclic."""
    services = {
        name: stream_mode_service(read_bus(find_robot(name, ROBOTS))) for name in ('panda', 'prbt')
    }
    assert services == {'panda': 'cyclic_position_mode', 'prbt': 'interpolated_position_mode'}

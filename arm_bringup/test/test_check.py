# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the check says of good robot folders, and of each mistake."""

from __future__ import annotations

from pathlib import Path
import shutil

import pytest
import yaml

from arm_bringup.check import check_robot, main
from arm_bringup.findings import Severity
from arm_bringup.motion import controller_name
from arm_bringup.robots import find_robot, Robot

ROBOTS = Path(__file__).parents[1] / 'robots'
ERROR, WARNING = Severity.ERROR, Severity.WARNING


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """Copy a robot, to break it."""
    shutil.copytree(ROBOTS / 'gp110', tmp_path / 'gp110')
    return find_robot('gp110', tmp_path)


def replace(path: Path, old: str, new: str) -> None:
    """Change a file."""
    text = path.read_text(encoding='utf-8')
    assert old in text
    path.write_text(text.replace(old, new), encoding='utf-8')


@pytest.mark.parametrize('name', ['panda', 'prbt', 'gp110'])
def test_nothing_is_wrong_with_our_robots(name: str) -> None:
    """Neither errors nor warnings."""
    assert check_robot(find_robot(name, ROBOTS)) == []


@pytest.mark.parametrize(
    ('file', 'old', 'new', 'expected'),
    [
        ('bus.yml', ' joint_2_l:', ' joint_x:', [(ERROR, 'joint_x'), (WARNING, 'joint_2_l')]),
        ('bus.yml', 'cia402_slave.eds', 'lost.eds', [(ERROR, 'lost.eds')]),
        ('gp110.urdf.xacro', '</robot>', '', [(ERROR, 'gp110.urdf.xacro')]),
        ('limits.yaml', '  joint_3_u:\n', '  joint_3:\n', [(ERROR, 'joint_3')]),
        ('gp110.srdf', '"tool0"', '"tool9"', [(ERROR, 'tool9')]),
        ('gp110.srdf', 'name="ready"', 'name="home"', [(ERROR, 'no pose')]),
        ('gp110.srdf', 'value="-1.5708"', 'value="0"', [(ERROR, 'singular')]),
        ('gp110.srdf', 'value="-1.5708"', 'value="-9"', [(WARNING, 'beyond'), (ERROR, 'no pose')]),
        (
            'gp110.srdf',
            '<disable_collisions link1="link_4_r" link2="link_5_b" reason="Adjacent"/>',
            '',
            [(ERROR, 'collide')],
        ),
        ('gp110.srdf', 'name="joint_5_b" v', 'name="joint_5" v', [(WARNING, 'has joint_5,')]),
        ('controllers.yaml', 'joint_6_t:', 'joint_6:', [(ERROR, "no joint 'joint_6'")]),
        ('controllers.yaml', 'gp110_arm_controller:\n', 'arm:\n', [(WARNING, 'no parameters')]),
        ('controllers.yaml', 'goal_time: 0', 'goal_tim: 0', [(ERROR, "'constraints.goal_time'")]),
        ('controllers.yaml', ' linear: 0.4', ' linea: 0.4', [(ERROR, "'moveit_servo.scale.lin")]),
        ('controllers.yaml', 'state_publish_rate', 'state_publish_rat', [(ERROR, 'publish_rate')]),
        ('controllers.yaml', '{trajectory: 0.1', '{trajectory: fast', [(ERROR, "'fast'")]),
        ('controllers.yaml', 'goal_time: 0.6', 'goal_time: -1', [(ERROR, 'goal_time is -1')]),
        ('controllers.yaml', 'in_type: unitless', 'in_type: knots', [(ERROR, "'knots'")]),
        ('controllers.yaml', '  ros__parameters:', '  - ros__parameters:', [(ERROR, 'file')]),
        ('limits.yaml', 'max_jerk', 'max_jrk', [(ERROR, "'max_jrk'")]),
        ('limits.yaml', 'joint_limits:', 'joint_limits: [', [(ERROR, 'limits.yaml')]),
    ],
)
def test_each_mistake_is_found(
    robot: Robot, file: str, old: str, new: str, expected: list[tuple[Severity, str]]
) -> None:
    """Every finding names the place, says what is wrong, and what to do."""
    replace(robot.folder / file, old, new)
    found = check_robot(robot)
    for severity, words in expected:
        assert any(each.severity is severity and words in str(each) for each in found), found
    assert all(each.place and each.remedy for each in found)


@pytest.mark.parametrize(
    ('file', 'old', 'new', 'remedy'),
    [
        ('limits.yaml', 'max_velocity: 2.44', 'max_velocity: 9.', 'none wider'),
        ('limits.yaml', 'max_jerk:', 'max_speed:', 'max_jerk'),
        ('limits.yaml', 'joint_limits:', 'limits:', 'robots/gp110/limits.yaml'),
        ('gp110.srdf', '"tool0"', '"tool9"', 'links and joints'),
    ],
)
def test_the_remedy_is_for_the_file_that_is_the_matter(
    robot: Robot, file: str, old: str, new: str, remedy: str
) -> None:
    """A person is sent to the file to be mended."""
    replace(robot.folder / file, old, new)
    (found,) = check_robot(robot)
    assert found.place == file
    assert remedy in found.remedy


def test_without_the_files_of_motion(robot: Robot) -> None:
    """A robot that only its drives' services move is complete; that is warned of."""
    robot.semantic.unlink()
    robot.limits.unlink()
    (finding,) = check_robot(robot)
    assert finding.severity is WARNING
    assert 'gp110.srdf and limits.yaml' in finding.problem


@pytest.mark.parametrize('name', ['/left/{}', '/**/{}', 'cell/left/{}'])
def test_nodes_of_controllers_yaml_may_have_a_namespace(robot: Robot, name: str) -> None:
    """They are looked at all the same, and the controller keeps its name."""
    plain = controller_name(robot)
    table = yaml.safe_load(robot.controllers.read_text())
    named = {name.format(node): values for node, values in table.items()}
    robot.controllers.write_text(yaml.safe_dump(named))
    assert check_robot(robot) == []
    replace(robot.controllers, 'goal_time', 'goal_tim')
    assert [finding.severity for finding in check_robot(robot)] == [ERROR]
    replace(robot.controllers, f'controller_name: {plain}', 'controller_name: arm')
    assert controller_name(robot) == 'arm'


def test_channels_of_a_drive_are_joints(robot: Robot) -> None:
    """By the names of the channels, not by that of their device."""
    eds = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_two_axes.eds'
    shutil.copy(eds, robot.folder)
    replace(
        robot.bus_config,
        ' joint_2_l:\n',
        f' shoulder:\n    dcf: {eds.name}\n    num_channels: 2\n'
        '    channel_names: [joint_2_l, joint_3_u]\n',
    )
    replace(
        robot.bus_config,
        ' joint_3_u:\n    node_id',
        ' tool:\n    driver: ros2_canopen::ProxyDriver\n    node_id',
    )
    assert [finding for finding in check_robot(robot) if finding.severity is ERROR] == []


def test_exit_code(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    """0 when all is well, 1 with an error, 2 for what is no robot."""
    assert main([f'{robot.folder}/']) == 0
    replace(robot.folder / 'bus.yml', '  joint_2_l:\n', '  joint_2_x:\n')
    assert main([f'{robot.folder}/']) == 1
    assert '1 errors, 1 warnings' in capsys.readouterr().out
    assert main(['./nowhere/']) == 2

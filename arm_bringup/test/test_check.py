# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the check says of good robot folders, and of each mistake."""

from __future__ import annotations

import os
from pathlib import Path
import shutil
from typing import Any

import pytest
from two_arms import write_two_arms
import yaml

from arm_bringup.check import check_robot, main
from arm_bringup.groups import controller_names, moved_groups
from arm_bringup.robots import find_robot, in_namespace_of_bus, read_bus, Robot, RobotError
from arm_bringup.srdf import main as make_srdf
from process_supervisor import RosOptions, Severity

pytestmark = pytest.mark.slow

ROBOTS = Path(__file__).parents[1] / 'robots'
ERROR, WARNING = Severity.ERROR, Severity.WARNING

CAMERA = """
<link name="camera"><visual><geometry><mesh filename="file:///lost.stl"/></geometry>
<material name="red"><color rgba="1 0 0"/></material></visual></link>
<joint name="camera" type="fixed"><parent link="tool0"/><child link="camera"/></joint></robot>"""
HAND = """<group name="hand"><joint name="finger_1"/><joint name="finger_2"/></group></robot>"""
LIFT = """<group name="lift"><joint name="joint_2_l"/></group></robot>"""
END, RAMP = '</robot>', '0x6084, sub_index: 0, value: 200000'
ADJACENT = '<disable_collisions link1="link_4_r" link2="link_5_b" reason="Adjacent"/>'
AT_END = """  joint_1_s:
    has_position_limits: true
    min_position: 0.0
    max_position: 1.0
"""
FINGER = (
    '<link name="{0}"/><joint name="{0}_joint" type="prismatic"><parent link="tool0"/>'
    '<child link="{0}"/><limit lower="0" upper="0.04" velocity="0.1" effort="1"/>{1}</joint>'
)

PARKED = """<group_state name="parked" group="gp110_arm">
<joint name="joint_1_s" value="0"/><joint name="joint_2_l" value="2"/>
<joint name="joint_3_u" value="-1"/><joint name="joint_4_r" value="0"/>
<joint name="joint_5_b" value="-1.57"/><joint name="joint_6_t" value="0"/></group_state></robot>"""


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
    """No errors; of the articles' own bus.yml, the warnings that the master logs, too."""
    found = check_robot(find_robot(name, ROBOTS))
    assert len(found) == (name == 'prbt')
    for each in found:
        assert each.severity is WARNING
        assert 'the target of mode 7 takes effect when its frame arrives' in each.problem


def test_a_xacro_file_is_enough_for_an_srdf(capsys: pytest.CaptureFixture[str]) -> None:
    """The SRDF goes to stdout, the report to stderr; a robot that is not there is refused."""
    assert make_srdf([f'{ROBOTS}/gp110/gp110.urdf.xacro', '--samples', '3000']) == 0
    out, err = capsys.readouterr()
    assert '<chain base_link=' in out
    assert 'pose ready found' in err
    assert make_srdf(['./nothing']) == 2
    assert 'nothing does not exist' in capsys.readouterr().err


@pytest.mark.parametrize(
    ('file', 'old', 'new', 'expected'),
    [
        ('bus.yml', ' joint_2_l:', ' joint_x:', [(ERROR, 'joint_x'), (WARNING, 'joint_2_l')]),
        ('bus.yml', ' joint_2_l:', ' joint 2:', [(ERROR, 'rename a joint in its URDF, SRDF')]),
        ('bus.yml', 'cia402_slave.eds', 'lost.eds', [(ERROR, 'lost.eds')]),
        ('bus.yml', 'value: 500000', 'value: 200000', [(WARNING, 'up to 2 (0x607F')]),
        ('bus.yml', RAMP, RAMP.replace('200000', '2000'), [(WARNING, '0x6084 is 0.02')]),
        ('gp110.urdf.xacro', END, '', [(ERROR, 'gp110.urdf.xacro')]),
        ('gp110.urdf.xacro', END, CAMERA,
         [(WARNING, 'link camera: <color rgba="1 0 0">'), (WARNING, 'no file /lost.stl')]),
        ('limits.yaml', '  joint_3_u:', '  joint_3:',
         [(ERROR, "'joint_3'; is 'joint_3_u' meant"), (WARNING, 'no max_acceleration in')]),
        ('limits.yaml', 'joint_limits:', 'joint_limits:\n  finger: {}', [(WARNING, "'finger'")]),
        ('gp110.srdf', '"tool0"', '"tool9"', [(ERROR, 'tool9'), (ERROR, 'links and joints')]),
        ('gp110.srdf', END, HAND, [(WARNING, 'group hand: the description has no joint or link')]),
        ('gp110.srdf', END, LIFT, [(WARNING, 'lift shares joints with gp110_arm, which is mov')]),
        ('gp110.srdf', END, PARKED, [(WARNING, 'base_link and link_6_t collide, by 10 mm')]),
        ('gp110.srdf', 'name="ready"', 'name="home"', [(WARNING, 'no pose')]),
        ('gp110.srdf', 'value="-1.5708"', 'value="0"', [(ERROR, 'singular')]),
        ('gp110.srdf', '"-1.5708"', '"-9"', [(WARNING, 'beyond'), (WARNING, 'no pose')]),
        ('gp110.srdf', ADJACENT, '', [(WARNING, 'link_4_r and link_5_b')]),
        ('gp110.srdf', '"joint_5_b" v', '"joint_5" v', [(WARNING, 'joint_5 is none of them')]),
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
        # from there a joint can be jogged in one direction only
        ('limits.yaml', '  joint_1_s:\n', AT_END, [(WARNING, 'joint_1_s at ')]),
        ('limits.yaml', 'max_velocity: 2.44', 'max_velocity: 9.', [(ERROR, 'none wider')]),
        ('limits.yaml', 'max_jerk:', 'max_speed:', [(ERROR, 'max_jerk')]),
        ('limits.yaml', 'joint_limits:', 'limits:', [(ERROR, 'robots/gp110/limits.yaml')]),
    ],
)  # fmt: skip
def test_each_mistake_is_found(
    robot: Robot, file: str, old: str, new: str, expected: list[tuple[Severity, str]]
) -> None:
    """Every finding names the place, says what is wrong, and what to do."""
    replace(robot.folder / file, old, new)
    found = check_robot(robot)
    for severity, words in expected:
        assert any(each.severity is severity and words in str(each) for each in found), found
    assert all(each.place and each.remedy for each in found)
    if expected[0][0] is ERROR and file != 'bus.yml':  # a person is sent to the file to correct
        assert any(each.place.startswith(file) for each in found), found


def test_without_limits_the_lines_to_copy_are_shown(robot: Robot) -> None:
    """As they are printed they are the file that is missing, and that is all that is missing.

    A robot that only its drives' services move is complete; that is warned of.
    """

    def found() -> list[Any]:
        return list(check_robot(find_robot('gp110', robot.folder.parent)))

    robot.limits.unlink()
    (finding,) = found()
    assert 'srdf' not in finding.remedy
    assert f'write {robot.limits}' in finding.remedy
    robot.limits.write_text('\n'.join(f'{finding}'.splitlines()[2:]), 'utf-8')
    assert [each.problem.split(':')[0] for each in found()] == [
        'no max_jerk in the limits file, so 20/s of max_acceleration'
    ]
    for file in (robot.semantic, robot.limits, robot.folder / 'robot.yaml'):
        file.unlink()
    (finding,) = found()
    assert finding.severity is WARNING
    assert 'gp110.srdf and limits.yaml' in finding.problem
    assert 'ros2 run arm_planning srdf' in finding.remedy


@pytest.mark.parametrize(
    ('node', 'parameters', 'words'),
    [
        ('right_controller', '{constraints: {left_turn: {goal: 0.1}}}', "no joint 'left_turn'"),
        ('right_servo_node', '{moveit_servo: {scale: {linea: 0.1}}}', "'moveit_servo.scale.linea"),
        ('hand_controller', '{goal_tolerance: -1.0}', 'goal_tolerance is -1'),
        ('controller_manager', '{controller_name: hand_controller}', 'of another group, too'),
    ],
)
def test_parameters_of_every_group_are_looked_at(
    tmp_path: Path, node: str, parameters: str, words: str
) -> None:
    """Further arms and grippers have controllers and servos of their own."""
    robot = find_robot(f'{write_two_arms(tmp_path / "two_arms")}{os.sep}', tmp_path)
    before = {str(each) for each in check_robot(robot)}
    lines = [f'{node}: {{ros__parameters: {parameters}}}']
    lines += ['left_controller: {ros__parameters: {}}'] * (node != 'controller_manager')
    robot.controllers.write_text('\n'.join(lines))
    found = [each for each in check_robot(robot) if str(each) not in before]
    assert any(each.severity is ERROR and words in each.problem for each in found), found


@pytest.mark.parametrize('name', ['/left/{}', '/**/{}', 'cell/left/{}'])
def test_nodes_of_controllers_yaml_may_have_a_namespace(robot: Robot, name: str) -> None:
    """They are looked at all the same, and the controller keeps its name."""

    def main_controller() -> str:
        groups = moved_groups(robot)
        return controller_names(robot, groups)[groups.names[0]]

    plain = main_controller()
    table = yaml.safe_load(robot.controllers.read_text())
    named = {name.format(node): values for node, values in table.items()}
    robot.controllers.write_text(yaml.safe_dump(named))
    assert check_robot(robot) == []
    replace(robot.controllers, 'goal_time', 'goal_tim')
    assert [finding.severity for finding in check_robot(robot)] == [ERROR]
    replace(robot.controllers, f'controller_name: {plain}', 'controller_name: arm')
    assert main_controller() == 'arm'


def test_channels_of_a_drive_are_joints(robot: Robot) -> None:
    """By the names of the channels, not by that of their device."""
    eds = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_two_axes.eds'
    shutil.copy(eds, robot.folder)
    device = f'dcf: {eds.name}', 'num_channels: 2', 'channel_names: [joint_2_l, joint_3_u]'
    replace(robot.bus_config, ' joint_2_l:\n', '\n    '.join((' shoulder:', *device)) + '\n')
    tool = ' tool:\n    driver: ros2_canopen::ProxyDriver'
    replace(robot.bus_config, ' joint_3_u:\n    node_id', f'{tool}\n    node_id')
    assert [finding for finding in check_robot(robot) if finding.severity is ERROR] == []


def test_joints_that_mimic_are_joints(robot: Robot) -> None:
    """MoveIt's wizard writes limits of them, too; a drive of their own is an error."""
    both = FINGER.format('left', '') + FINGER.format('right', '<mimic joint="left_joint"/>')
    replace(robot.description, END, f'{both}{END}')
    entry = '  {}:\n    has_velocity_limits: true\n    max_velocity: 0.1\n'
    with robot.limits.open('a') as file:
        file.write(entry.format('left_joint') + entry.format('right_joint'))
    (found,) = check_robot(robot)
    assert (found.severity, 'no drive for left_joint:' in found.problem) == (WARNING, True)
    with robot.bus_config.open('a') as file:
        file.write('  right_joint:\n    node_id: 9\n')
    (wrong,) = [each for each in check_robot(robot) if each.severity is ERROR]
    assert 'right_joint' in wrong.place
    assert 'follows left_joint' in wrong.problem


def test_a_gripper_without_limits_has_defaults_that_are_named(robot: Robot) -> None:
    """End effectors that have drives are moved, so they are checked as arms are."""
    replace(robot.description, END, FINGER.format('finger', '') + END)
    effector = '<end_effector name="hand" group="hand" parent_link="tool0"/>'
    hand = f'<group name="hand"><joint name="finger_joint"/></group>{effector}</robot>'
    replace(robot.semantic, '</robot>', hand)
    with robot.bus_config.open('a') as file:
        file.write('  finger_joint:\n    node_id: 9\n')
    found = check_robot(robot)
    assert [(each.severity, each.place) for each in found] == [(WARNING, 'limits.yaml')] * 2
    assert all('finger_joint' in each.problem for each in found)
    with robot.limits.open('a') as file:
        file.write('  finger_joint: {max_velocity: 0.1, max_acceleration: 1.0, max_jerk: 9.0}\n')
    assert check_robot(robot) == []


def test_everything_of_a_kind_is_reported_at_once(robot: Robot) -> None:
    """All joints in one run, and no name is suggested that is taken already."""
    replace(robot.limits, 'max_jerk: ', 'max_jerk: -')
    (found,) = check_robot(robot)
    assert all(name in found.problem for name in ('joint_1_s', 'joint_6_t'))
    replace(robot.limits, 'max_jerk: -', 'max_jerk: ')
    replace(robot.bus_config, ' joint_2_l:', ' joint_2:')
    replace(robot.bus_config, ' joint_3_u:', ' drive_3:')
    two, three, idle = check_robot(robot)
    assert "is 'joint_2_l' meant" in two.remedy
    assert 'meant' not in three.remedy
    assert 'joint_2_l' in idle.problem
    assert 'joint_3_u' in idle.problem


@pytest.mark.parametrize(
    ('old', 'new', 'namespace'),
    [
        ('master:\n', 'master:\n  namespace: cell\n', 'cell'),
        ('defaults:\n', 'defaults:\n  namespace: /cell\n', 'cell'),
        ('  joint_2_l:\n', '  joint_2_l:\n    namespace: cell\n', 'cell'),
        ('nodes:\n', 'nodes:\n', ''),
    ],
)
def test_a_namespace_of_bus_yml_holds_for_all(
    robot: Robot, old: str, new: str, namespace: str
) -> None:
    """Bring-up, demos and their clients use the same file."""
    replace(robot.bus_config, old, new)
    assert in_namespace_of_bus(RosOptions(), read_bus(robot)).namespace == namespace
    assert check_robot(robot) == []
    replace(robot.bus_config, '  joint_3_u:\n', '  joint_3_u:\n    namespace: other\n')
    if namespace:
        with pytest.raises(RobotError, match=r'several namespaces \(cell, other\).*--namespace'):
            in_namespace_of_bus(RosOptions(), read_bus(robot))
        assert in_namespace_of_bus(RosOptions('left'), read_bus(robot)).namespace == 'left'
        assert [each.severity for each in check_robot(robot)] == [ERROR]


def test_exit_code(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    """0 when all is well, 1 with an error, 2 for what is no robot."""
    assert main([f'{robot.folder}/']) == 0
    replace(robot.folder / 'bus.yml', '  joint_2_l:\n', '  joint_2_x:\n')
    assert main([f'{robot.folder}/']) == 1
    assert '1 error, 1 warning\n' in capsys.readouterr().out
    assert main(['./nowhere/']) == 2

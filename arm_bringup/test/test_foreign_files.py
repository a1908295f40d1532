# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Descriptions, SRDF and limits that others wrote, as robot folders without editing."""

from __future__ import annotations

import os
from pathlib import Path
import re
from typing import Any

import pytest
from two_arms import ARMS, DRIVES, GRIPPER, write_two_arms
import urdf_reader
from urdf_reader import parse_srdf, read_urdf

from arm_bringup import robots
from arm_bringup.bringup import parse
from arm_bringup.examples.wave import waving_joints
from arm_bringup.groups import choose_groups, moved_groups, MovedGroups
from arm_bringup.session import locate

XACRO = 'xmlns:xacro="http://wiki.ros.org/xacro"'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Make a robot folder with a bus and a plain URDF."""
    folder = tmp_path / 'arm'
    folder.mkdir()
    (folder / 'bus.yml').touch()
    (folder / 'arm.urdf').write_text('<robot name="arm"><link name="base"/></robot>')
    return folder


def found(folder: Path) -> robots.Robot:
    """Read a robot folder."""
    return robots.find_robot(f'{folder}{os.sep}', folder)


def test_names_that_moveit_and_vendors_give_their_files(folder: Path, tmp_path: Path) -> None:
    """A plain URDF, a SRDF of xacro, and joint_limits.yaml.

    robot.yaml names files elsewhere: the package of a vendor stays where it is; paths count from
    the robot folder.
    """
    (folder / 'arm.srdf.xacro').write_text(f'<robot name="arm" {XACRO}/>')
    (folder / 'joint_limits.yaml').touch()
    robot = found(folder)
    assert robot.lacking == ''
    assert '<link name="base"/>' in robots.read_description(robot)
    assert '<robot name="arm"/>' in robots.read_semantic(robot)
    config = tmp_path / 'vendor_moveit_config' / 'config'
    config.mkdir(parents=True)
    (config / 'vendor.srdf').write_text('<robot name="vendor"/>')
    (folder / 'robot.yaml').write_text(
        'semantic: ../vendor_moveit_config/config/vendor.srdf\ngroup: manipulator\n'
        'tip_link: tool0\n'
    )
    robot = found(folder)
    assert 'vendor' in robots.read_semantic(robot)
    assert (robot.groups, robot.tip_link) == (('manipulator',), 'tool0')


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('groop: arm', r"unknown key 'groop'; keys: description.*group"),
        ('[arm]', 'no table'),
        ('semantic: lost.srdf', r'semantic: there is no file .*lost.srdf'),
        ('packages: {vendor: lost}', 'packages: vendor: there is no folder'),
        ('xacro_args: [name]', 'xacro_args: a table'),
        ('group: [[left]]', 'no text'),
        ('group: {', 'robot.yaml'),
    ],
)
def test_a_robot_yaml_that_cannot_be_used_says_what(folder: Path, text: str, words: str) -> None:
    """The key, and those that there are."""
    (folder / 'robot.yaml').write_text(text)
    with pytest.raises(robots.RobotError, match=words):
        found(folder)


def test_xacro_arguments_of_the_folder_and_of_the_command_line(folder: Path) -> None:
    """The command line has the last word; both reach description and SRDF."""
    text = f'<robot name="$(arg name)" {XACRO}><link name="$(arg kind)_$(arg big)"/></robot>'
    (folder / 'arm.urdf').unlink()
    (folder / 'arm.urdf.xacro').write_text(text)
    (folder / 'arm.srdf.xacro').write_text(text)
    (folder / 'robot.yaml').write_text('xacro_args: {name: arm, kind: ur5, big: true}')
    argv = [f'{folder}{os.sep}', '--xacro-arg', 'kind:=ur10e', '--group', 'left']
    robot = locate(parse(argv)[0])
    for read in (robots.read_description, robots.read_semantic):
        assert '<robot name="arm">' in read(robot)
        assert '<link name="ur10e_true"/>' in read(robot)
    assert robot.groups == ('left',)
    with pytest.raises(SystemExit):
        parse([f'{folder}{os.sep}', '--xacro-arg', 'kind=ur10e'])


def test_the_tip_of_robot_yaml_is_that_of_its_main_group(folder: Path, tmp_path: Path) -> None:
    """It is not taken for the end of another group of the command line.

    Without a group it is that of the default one: of several arms the first.
    """
    (folder / 'robot.yaml').write_text('{group: [left, right], tip_link: left_tool}')
    other = write_two_arms(tmp_path / 'two_arms')
    with (other / 'robot.yaml').open('a') as file:
        file.write('tip_link: left_lift_link\n')
    left, right = ['--group', 'left'], ['--group', 'right']
    for place, argv, tip in (
        (folder, [], 'left_tool'),
        (folder, left, 'left_tool'),
        (folder, right, ''),
        (folder, [*right, *left], ''),
        (other, [], 'left_lift_link'),
        (other, left, 'left_lift_link'),
        (other, right, ''),
    ):
        assert locate(parse([f'{place}{os.sep}', *argv])[0]).tip_link == tip, (place, argv)


def test_a_package_that_is_not_installed_is_given_a_folder(folder: Path, tmp_path: Path) -> None:
    """For ``$(find ...)`` in xacro files, and for the meshes of the description."""
    shared = tmp_path / 'share' / 'vendor_description'
    shared.mkdir(parents=True)
    (shared / 'arm.xacro').write_text(
        f'<robot {XACRO}><link name="base"><visual><geometry>'
        '<mesh filename="package://vendor_description/base.stl"/></geometry></visual></link>'
        '<link name="file://$(find vendor_description)/tip.stl"/>'
        '<link name="file:///$(find vendor)/tip.stl"/>'
        '<link name="$(find arm_model)"/></robot>'
    )
    (folder / 'arm.urdf').unlink()
    (folder / 'arm.xacro').write_text(
        f'<robot name="arm" {XACRO}>'
        '<xacro:include filename="$(find vendor_description)/arm.xacro"/></robot>'
    )
    before = os.environ['AMENT_PREFIX_PATH']
    with pytest.raises(
        robots.DescriptionError,
        match=r"arm.xacro: package 'vendor_description' .*packages: \{vendor_d",
    ) as refused:
        robots.read_description(found(folder))
    assert len(str(refused.value)) < 400  # not every folder that was searched
    (folder / 'robot.yaml').write_text(
        'packages:\n  vendor_description: ../share/vendor_description\n  vendor: ../share\n'
    )
    urdf = robots.read_description(found(folder))
    assert f'"{shared.as_uri()}/base.stl"' in urdf
    for name in (f'file://{shared}/tip.stl', f'file:///{shared.parent}/tip.stl'):
        assert f'<link name="{name}"/>' in urdf  # not a temporary folder
    assert os.environ['AMENT_PREFIX_PATH'] == before


def test_meshes_beside_the_description_are_found_by_every_node(folder: Path) -> None:
    """A relative path counts from the description; others stay as they are."""
    names = ['meshes/a b.stl', 'package://vendor/c.stl', 'file:///d.stl', '/e.stl']
    shape = '<collision><geometry><mesh scale="1 1 1" filename="{}"/></geometry></collision>'
    link = f'<link name="base">{"".join(map(shape.format, names))}</link>'
    (folder / 'arm.urdf').write_text(f'<robot name="arm">{link}</robot>')
    located = re.findall('filename="(.*?)"', robots.read_description(found(folder)))
    assert located == [f'{folder.as_uri()}/meshes/a%20b.stl', *names[1:]]


def test_drivers_of_ros2_control_and_gazebo_need_not_be_there(tmp_path: Path) -> None:
    """Their includes are left out with the calls of their macros; the rest stays.

    Only what is missing is left out: what is there and wrong is reported.
    """
    file = tmp_path / 'arm.urdf.xacro'
    file.write_text(
        f'<robot name="arm" {XACRO}>'
        '<xacro:include filename="$(find vendor_driver)/urdf/arm.ros2_control.xacro"/>'
        '<xacro:include filename="gazebo.xacro"/>'
        '<link name="base"/>'
        '<xacro:arm_ros2_control name="arm" ip="1"><origin/></xacro:arm_ros2_control>'
        '<xacro:macro name="tool" params="n"><link name="${n}"/>'
        '<xacro:arm_gazebo/></xacro:macro><xacro:tool n="tool0"/></robot>'
    )
    urdf = robots.expand_xacro(file)
    assert '<link name="base"/>' in urdf
    assert '<link name="tool0"/>' in urdf
    assert 'xacro:' not in urdf
    wrong = f'<robot {XACRO}><link name="${{1/0}}"/></robot>'
    (tmp_path / 'arm.ros2_control.xacro').write_text(wrong)
    include = '<xacro:include filename="arm.ros2_control.xacro"/>'
    for text, words in (
        (file.read_text().replace('arm_gazebo', 'arm_gripper'), 'macro name: xacro:arm_gripper'),
        (f'<robot name="arm" {XACRO}>{include}</robot>', 'division by zero'),
        # xacro's own words have no remedy
        (f'<robot name="$(arg name)" {XACRO}/>', r"'name' has no value.*--xacro-arg name:=VALUE"),
    ):
        file.write_text(text)
        with pytest.raises(robots.DescriptionError, match=words):
            robots.expand_xacro(file)


JOINT = (
    '<link name="{0}_link"/><joint name="{0}" type="revolute"><parent link="base"/>'
    '<child link="{0}_link"/><limit lower="-1" upper="1" velocity="1" effort="1"/></joint>'
)
TWO_ARMS = (
    '<robot name="arm"><group name="left"><joint name="a"/></group>'
    '<group name="right"><joint name="b"/></group><group name="bare"><link name="base"/></group>'
    '<group name="both"><group name="left"/><group name="right"/></group>'
    '<group name="wide"><joint name="a"/><joint name="d"/></group>'
    '<group name="hand"><link name="c_link"/></group>'
    '<end_effector name="hand" parent_link="a_link" group="hand" parent_group="left"/></robot>'
)


def groups(folder: Path, drives: str, settings: str = '') -> MovedGroups:
    """Return the groups of TWO_ARMS that are moved."""
    (folder / 'robot.yaml').write_text(settings)
    tree = read_urdf(
        f'<robot name="arm"><link name="base"/>{"".join(map(JOINT.format, "abcd"))}</robot>'
    )
    return choose_groups(found(folder), parse_srdf(TWO_ARMS), tree, drives)


def test_all_arms_and_tools_with_drives_are_moved(folder: Path) -> None:
    """Unless one is named; groups of groups, and what overlaps, only by name."""
    both, hand = ('left', 'right'), ('hand',)
    for drives, settings, moved in (
        ('abcd', '', MovedGroups(both, hand)),
        ('ab', '', MovedGroups(both)),
        ('bc', '', MovedGroups(('right',), hand)),
        ('abc', 'group: both', MovedGroups(('both',), hand)),
        ('abcd', 'group: [wide, right]', MovedGroups(('wide', 'right'), hand)),
        ('c', '', MovedGroups(hand)),
    ):
        assert groups(folder, drives, settings) == moved, (drives, settings)


def test_groups_that_cannot_be_moved_are_reported(folder: Path) -> None:
    """With those that there are, and where one is chosen."""
    for drives, settings, words in (
        ('abc', 'group: bath', r'no group bath; groups: left, .*group in robot.yaml, or --group'),
        ('abc', 'group: wide', 'no drive for d of group wide'),
        ('abcd', 'group: [left, wide]', 'group wide shares joints with left'),
        ('d', '', 'no group of arm.srdf has a drive for each joint'),
    ):
        with pytest.raises(robots.RobotError, match=words):
            groups(folder, drives, settings)


def test_groups_that_are_asked_for_wave(tmp_path: Path) -> None:
    """The demo enables the others as little as it waves with them.

    SRDFs of other planners name an arm as an end effector; the gripper stays one.
    """
    folder = write_two_arms(tmp_path / 'two_arms')
    file = folder / 'two_arms.srdf'
    own = '<end_effector name="tool" parent_link="left_roll_link" group="left"/></robot>'
    file.write_text(file.read_text().replace('</robot>', own))
    assert moved_groups(found(folder)) == MovedGroups(('left', 'right'), ('hand',))
    right = ['--group', 'right']
    for argv, waving in (
        ([], DRIVES),
        (right, ARMS['right']),
        ([*right, '--group', 'hand'], (*ARMS['right'], GRIPPER)),
    ):
        robot = locate(parse([f'{folder}{os.sep}', *argv])[0])
        assert {*waving_joints(robot, DRIVES, DRIVES)} == {*waving}


def test_a_xacro_file_is_expanded_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As bus, groups and nodes of one bring-up all read it; the next one reads it anew."""
    expand, expanded = urdf_reader.expand_xacro, list[Path]()

    def counted(path: Path, *rest: Any) -> str:
        expanded.append(path)
        return expand(path, *rest)

    monkeypatch.setattr(urdf_reader, 'expand_xacro', counted)
    (folder / 'arm.urdf').unlink()
    for turn, link in enumerate(('base', 'tip'), 1):
        text = f'<robot name="arm" {XACRO}><link name="{link}"/></robot>'
        (folder / 'arm.xacro').write_text(text)
        robot = found(folder)
        for _ in range(2):
            assert f'<link name="{link}"/>' in robots.read_description(robot)
        assert len(expanded) == turn

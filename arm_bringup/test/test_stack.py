# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which processes an arm has, with which arguments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import json
from pathlib import Path
from typing import Any

from isolation import Isolation
import pytest
from rclpy.context import Context
from rclpy.node import Node
import yaml

from arm_bringup import session
from arm_bringup.groups import motion_files, MovedGroups, planning_files
from arm_bringup.robots import Robot
from node_runner import init_ros
from process_supervisor import EVERY_NODE, ProcessSpec, RosOptions, StartError

ROBOT = Robot('panda', Path('/robots/panda/bus.yml'), Path('/robots/panda/panda.urdf.xacro'))
PARAMETERS = Path('/tmp/parameters.yaml')
FILES = (Path('/r/motion.yaml'), Path('/r/controllers.yaml'))
FindExecutable = Callable[[str, str], Path | None]


def my_robot(folder: Path) -> Robot:
    """Return a robot whose files may not be there yet."""
    bus, urdf, srdf, limits, controllers = (
        folder / name
        for name in ('bus.yml', 'my.urdf.xacro', 'my.srdf', 'limits.yaml', 'controllers.yaml')
    )
    return Robot('my', bus, urdf, srdf, limits, controllers)


def underlay(folder: Path, *packages: str) -> FindExecutable:
    """Return what finds executables of packages that are there."""

    def find(package: str, name: str) -> Path | None:
        if package not in packages:
            return None
        file = folder / package / name
        file.parent.mkdir(exist_ok=True)
        file.touch(mode=0o755)
        return file

    return find


def processes(folder: Path, stack: session.Stack, *packages: str) -> dict[str, ProcessSpec]:
    """Plan a stack on an underlay with arm_canopen and more."""
    find = underlay(folder, 'arm_canopen', 'arm_bringup', 'canopen_sim', *packages)
    return {spec.name: spec for spec in session.arm_processes(stack, PARAMETERS, find)}


def parameter_files(spec: ProcessSpec) -> list[Path]:
    """Return the parameter files of a process, in their order."""
    return [Path(spec.argv[n + 1]) for n, word in enumerate(spec.argv) if word == '--params-file']


def test_the_master_of_motion_publishes_the_joints(tmp_path: Path) -> None:
    """It gets the files of the robot, later ones counting more, and needs no other publisher.

    move_group is one process more, with the same files, and ends before the drives.
    """
    own = {'diagnostics_period': '0.2'}
    fields: dict[str, Any] = {'master_parameters': own, 'master_files': FILES, 'simulate': True}
    stack = session.Stack(ROBOT, 'can0', master=session.MOTION_NODE, **fields)
    found = processes(tmp_path, stack, 'arm_servo')
    assert set(found) == {'slaves', 'master'}
    argv = found['master'].argv
    assert argv[0].endswith('arm_servo/motion_node')
    assert {'bus_config:=/robots/panda/bus.yml', 'diagnostics_period:=0.2'} < {*argv}
    assert 'bus_config:=/robots/panda/bus.yml' in found['slaves'].argv
    assert parameter_files(found['master']) == [PARAMETERS, *FILES]
    stack = replace(stack, plan=True)
    found = processes(tmp_path, stack, 'arm_servo', 'arm_planning')
    assert set(found) == {'slaves', 'master', 'planner'}
    assert parameter_files(found['planner']) == [PARAMETERS, *FILES]
    assert found['master'].stop_order < found['planner'].stop_order < found['slaves'].stop_order
    with pytest.raises(StartError, match='arm_planning'):
        processes(tmp_path, stack, 'arm_servo')


@pytest.mark.parametrize('words', [('-p', 'rate:=7'), ('--params-file', '/home/me/my.yaml')])
def test_what_a_person_says_counts_most(tmp_path: Path, words: tuple[str, str]) -> None:
    """It comes behind all parameters and files of the bring-up."""
    ros = RosOptions('left', words)
    stack = session.Stack(
        ROBOT, 'can0', True, master=session.MOTION_NODE, master_files=FILES, ros=ros
    )
    names = ('arm_canopen', 'arm_bringup', 'arm_servo', 'canopen_sim', 'robot_viewer')
    find = underlay(tmp_path, *names)
    specs = [
        *session.arm_processes(stack, PARAMETERS, find),
        session.controller_process(FILES, PARAMETERS, 1.0, find, ros),
    ]
    assert len(specs) == 4
    assert {spec.argv[-2:] for spec in specs} == {words}


@pytest.mark.parametrize('namespace', ['', 'left'])
@pytest.mark.parametrize('spelling', ['/**', '/**/servo_node', 'servo_node'])
def test_rcl_takes_what_a_person_says(tmp_path: Path, spelling: str, namespace: str) -> None:
    """Whatever the robot's own file says of that node, by name or by pattern."""
    robot = my_robot(tmp_path)
    robot.semantic.write_text('<robot name="my"><group name="arm"/></robot>')
    own, other = ({'ros__parameters': {'rate': rate}} for rate in (1, 9))
    robot.controllers.write_text(json.dumps({'/**': own, 'servo_node': own}))
    user = tmp_path / 'user.yaml'
    user.write_text(json.dumps({RosOptions(namespace).node_name(spelling): other}))
    said = ['-p', 'rate:=9'] if spelling == '/**' else ['--params-file', str(user)]
    ros = RosOptions(namespace, tuple(said))
    files = motion_files(robot, tmp_path, ros, MovedGroups(('arm',)))
    find = underlay(tmp_path, 'arm_servo')
    argv = session.controller_process(files[:-1], files[-1], 1.0, find, ros).argv
    context = Context()
    init_ros(argv, context)
    node = Node('servo_node', context=context)
    overrides = dict(node._parameter_overrides)
    context.try_shutdown()
    assert overrides['rate'].value == 9


def test_master_without_arm_servo(tmp_path: Path) -> None:
    """Where it is not built, or the robot lacks its files, the plain master runs, and why."""
    robot = my_robot(tmp_path)
    bare = underlay(tmp_path, 'arm_canopen')
    full = underlay(tmp_path, 'arm_canopen', 'arm_servo')
    assert session.choose_master(robot, bare) == (session.MASTER, session.MAKE_MOVE)
    assert session.choose_master(robot, full)[0] == session.MASTER
    assert 'lacks my.srdf and limits.yaml' in session.choose_master(robot, full)[1]
    robot.limits.touch()
    assert 'my lacks my.srdf for' in session.choose_master(robot, full)[1]
    srdf = '<robot name="my"><group name="arm"/></robot>'
    robot.semantic.write_text(srdf)
    assert session.choose_master(robot, full) == (session.MOTION_NODE, '')
    (file,) = motion_files(robot, tmp_path, RosOptions(), MovedGroups(('arm',)))
    values = yaml.safe_load(file.read_text())[EVERY_NODE]['ros__parameters']
    assert (values['robot_description_semantic'], values['group']) == (srdf, 'arm')
    assert 'other_groups' not in values  # rcl has no type for an empty list


def test_the_page_is_there_when_it_is_asked_for_and_built(tmp_path: Path) -> None:
    """Everything else is the same. The master disables the drives, so it stops before them."""
    plain = session.Stack(ROBOT, 'can0', simulate=True)
    without = processes(tmp_path, plain, 'robot_viewer')
    seen = processes(tmp_path, replace(plain, view=True), 'robot_viewer')
    viewer = seen.pop('viewer')
    assert seen == without
    assert viewer.stop_order > seen['master'].stop_order  # STOP is there until then
    assert 'viewer' not in processes(tmp_path, replace(plain, view=True))
    orders = {name: spec.stop_order for name, spec in without.items()}
    assert orders['master'] < orders['robot_state'] < orders['slaves']


def test_a_second_simulated_arm_has_a_bus_of_its_own(
    isolation: Isolation, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a choice of the bus; one that is chosen is not shared."""
    monkeypatch.setenv('ROS_DOMAIN_ID', str(isolation.domain_id))
    with (
        session.own_bus(None, simulate=True) as one,
        session.own_bus(None, simulate=True) as other,
    ):
        assert one != other
        with (
            pytest.raises(StartError, match='another bring-up'),
            session.own_bus(one, simulate=True),
        ):
            pytest.fail(f'{one} is shared')


@pytest.mark.parametrize('packages', [['robot_viewer'], ['robot_viewer', 'robot_state_publisher']])
def test_the_public_robot_state_publisher_runs_where_it_is_installed(
    tmp_path: Path, packages: list[str]
) -> None:
    """Ours elsewhere, which says when it is ready; it is no reason to end when it dies."""
    stack = session.Stack(ROBOT, 'can0', simulate=True)
    publisher = processes(tmp_path, stack, *packages)['robot_state']
    assert not publisher.required
    assert publisher.notifies_ready == (packages[-1] == 'robot_viewer')
    assert publisher.argv[0].endswith(f'{packages[-1]}/robot_state_publisher')


def test_move_group_knows_the_controller_by_its_name(tmp_path: Path) -> None:
    """Also where controllers.yaml gives it another one than that of the group."""
    robot = my_robot(tmp_path)
    robot.semantic.write_text('<robot name="my"/>')
    manager = {'controller_name': 'mine'}
    robot.controllers.write_text(json.dumps({'controller_manager': {'ros__parameters': manager}}))
    ros = RosOptions('left')
    groups = MovedGroups(('arm',), ('hand',), {'arm': ('j',), 'hand': ('f',)})
    *_, file = planning_files(robot, tmp_path, ros, groups)
    (values,) = yaml.safe_load(file.read_text()).values()
    assert values['ros__parameters'] == {
        'moveit_simple_controller_manager': {
            'controller_names': ['mine', 'hand_controller'],
            'mine': {'joints': ['j']},
            'hand_controller': {'joints': ['f'], 'type': 'GripperCommand'},
        },
        'frame_prefix': 'left/',
    }

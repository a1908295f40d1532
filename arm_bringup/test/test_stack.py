# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which processes an arm has, with which arguments."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rclpy.context import Context
from rclpy.node import Node
import yaml

from arm_bringup.groups import motion_files, MovedGroups, planning_files
from arm_bringup.robots import Robot
from arm_bringup.session import (
    arm_processes,
    choose_master,
    controller_process,
    MAKE_MOVE,
    MASTER,
    MOTION_NODE,
    Stack,
)
from node_runner import init_ros
from process_supervisor import EVERY_NODE, ProcessSpec, RosOptions, StartError

ROBOT = Robot('panda', Path('/robots/panda/bus.yml'), Path('/robots/panda/panda.urdf.xacro'))
PARAMETERS = Path('/tmp/parameters.yaml')


def my_robot(folder: Path) -> Robot:
    """Return a robot whose files may not be there yet."""
    return Robot(
        'my',
        folder / 'bus.yml',
        folder / 'my.urdf.xacro',
        folder / 'my.srdf',
        folder / 'limits.yaml',
        folder / 'controllers.yaml',
    )


class Underlay:
    """Executables of packages that are there."""

    def __init__(self, folder: Path, *packages: str) -> None:
        self.folder = folder
        self.packages = packages

    def find(self, package: str, name: str) -> Path | None:
        """Answer as find_executable does."""
        if package not in self.packages:
            return None
        file = self.folder / package / name
        file.parent.mkdir(exist_ok=True)
        file.touch(mode=0o755)
        return file


def processes(folder: Path, stack: Stack, *packages: str) -> dict[str, ProcessSpec]:
    """Plan a stack on an underlay with arm_canopen and more."""
    names = ('arm_canopen', 'arm_bringup', 'canopen_sim', *packages)
    find = Underlay(folder, *names).find
    return {spec.name: spec for spec in arm_processes(stack, PARAMETERS, find)}


def test_the_master_of_motion_publishes_the_joints(tmp_path: Path) -> None:
    """It gets the files of the robot, later ones counting more, and needs no other publisher."""
    files = (Path('/r/motion.yaml'), Path('/r/controllers.yaml'))
    own = {'diagnostics_period': '0.2'}
    stack = Stack(
        ROBOT, 'can0', simulate=True, master=MOTION_NODE, master_parameters=own, master_files=files
    )
    found = processes(tmp_path, stack, 'arm_servo')
    assert set(found) == {'slaves', 'master'}
    argv = found['master'].argv
    assert argv[0].endswith('arm_servo/motion_node')
    assert {'bus_config:=/robots/panda/bus.yml', 'diagnostics_period:=0.2'} < {*argv}
    assert 'bus_config:=/robots/panda/bus.yml' in found['slaves'].argv
    named = [Path(argv[n + 1]) for n, word in enumerate(argv) if word == '--params-file']
    assert named == [PARAMETERS, *files]


@pytest.mark.parametrize('words', [('-p', 'rate:=7'), ('--params-file', '/home/me/my.yaml')])
def test_what_a_person_says_counts_most(tmp_path: Path, words: tuple[str, str]) -> None:
    """It comes behind all parameters and files of the bring-up."""
    files = (Path('/r/motion.yaml'), Path('/r/controllers.yaml'))
    ros = RosOptions('left', words)
    stack = Stack(ROBOT, 'can0', True, master=MOTION_NODE, master_files=files, ros=ros)
    names = ('arm_canopen', 'arm_bringup', 'arm_servo', 'canopen_sim', 'robot_viewer')
    find = Underlay(tmp_path, *names).find
    specs = [
        *arm_processes(stack, PARAMETERS, find),
        controller_process(files, PARAMETERS, 1.0, find, ros),
    ]
    assert len(specs) == 4
    assert {spec.argv[-2:] for spec in specs} == {words}


@pytest.mark.parametrize('namespace', ['', 'left'])
@pytest.mark.parametrize('spelling', ['/**', '/**/servo_node', 'servo_node'])
def test_rcl_takes_what_a_person_says(tmp_path: Path, spelling: str, namespace: str) -> None:
    """Whatever the robot's own file says of that node, by name or by pattern."""
    robot = my_robot(tmp_path)
    robot.semantic.write_text('<robot name="my"><group name="arm"/></robot>')
    own = {'ros__parameters': {'rate': 1}}
    robot.controllers.write_text(json.dumps({'/**': own, 'servo_node': own}))
    user = tmp_path / 'user.yaml'
    user.write_text(
        json.dumps({RosOptions(namespace).node_name(spelling): {'ros__parameters': {'rate': 9}}})
    )
    said = ['-p', 'rate:=9'] if spelling == '/**' else ['--params-file', str(user)]
    ros = RosOptions(namespace, tuple(said))
    files = motion_files(robot, tmp_path, ros, MovedGroups(('arm',)))
    find = Underlay(tmp_path, 'arm_servo').find
    argv = controller_process(files[:-1], files[-1], 1.0, find, ros).argv
    context = Context()
    init_ros(argv, context)
    node = Node('servo_node', context=context)
    overrides = dict(node._parameter_overrides)
    context.try_shutdown()
    assert overrides['rate'].value == 9


def test_master_without_arm_servo(tmp_path: Path) -> None:
    """Where it is not built, or the robot lacks its files, the plain master runs, and why."""
    robot = my_robot(tmp_path)
    bare = Underlay(tmp_path, 'arm_canopen').find
    full = Underlay(tmp_path, 'arm_canopen', 'arm_servo').find
    assert choose_master(robot, bare) == (MASTER, MAKE_MOVE)
    assert choose_master(robot, full)[0] == MASTER
    assert 'lacks my.srdf and limits.yaml' in choose_master(robot, full)[1]
    robot.limits.touch()
    assert 'my lacks my.srdf for' in choose_master(robot, full)[1]
    srdf = '<robot name="my"><group name="arm"/></robot>'
    robot.semantic.write_text(srdf)
    assert choose_master(robot, full) == (MOTION_NODE, '')
    (file,) = motion_files(robot, tmp_path, RosOptions(), MovedGroups(('arm',)))
    values = yaml.safe_load(file.read_text())[EVERY_NODE]['ros__parameters']
    assert (values['robot_description_semantic'], values['group']) == (srdf, 'arm')
    assert 'other_groups' not in values  # rcl has no type for an empty list


def test_the_page_is_there_when_it_is_asked_for_and_built(tmp_path: Path) -> None:
    """Everything else is the same."""
    without = processes(tmp_path, Stack(ROBOT, 'can0', simulate=True), 'robot_viewer')
    seen = processes(tmp_path, Stack(ROBOT, 'can0', simulate=True, view=True), 'robot_viewer')
    viewer = seen.pop('viewer')
    assert seen == without
    assert viewer.stop_order > seen['master'].stop_order  # STOP is there until then
    unbuilt = processes(tmp_path, Stack(ROBOT, 'can0', simulate=True, view=True))
    assert 'viewer' not in unbuilt


def test_the_master_stops_before_the_slaves(tmp_path: Path) -> None:
    """It disables the drives, so they must still be there; the listeners go between."""
    found = processes(tmp_path, Stack(ROBOT, 'can0', simulate=True), 'robot_state_publisher')
    orders = {name: spec.stop_order for name, spec in found.items()}
    assert orders['master'] < orders['robot_state'] < orders['slaves']


@pytest.mark.parametrize(
    ('packages', 'taken'),
    [
        (['robot_viewer'], 'robot_viewer'),
        (['robot_viewer', 'robot_state_publisher'], 'robot_state_publisher'),
    ],
    ids=['ours', 'public'],
)
def test_the_public_robot_state_publisher_runs_where_it_is_installed(
    tmp_path: Path, packages: list[str], taken: str
) -> None:
    """Ours elsewhere, which says when it is ready; it is no reason to end when it dies."""
    found = processes(tmp_path, Stack(ROBOT, 'can0', simulate=True), *packages)
    assert not found['robot_state'].required
    assert found['robot_state'].notifies_ready == (taken == 'robot_viewer')
    assert found['robot_state'].argv[0].endswith(f'{taken}/robot_state_publisher')


def test_move_group_has_what_the_master_has(tmp_path: Path) -> None:
    """It is one process more, with the same description and groups, and ends before the drives."""
    files = (Path('/r/motion.yaml'),)
    stack = Stack(ROBOT, 'can0', simulate=True, master=MOTION_NODE, master_files=files, plan=True)
    found = processes(tmp_path, stack, 'arm_servo', 'arm_planning')
    assert set(found) == {'slaves', 'master', 'planner'}
    argv = found['planner'].argv
    named = [Path(argv[n + 1]) for n, word in enumerate(argv) if word == '--params-file']
    assert named == [PARAMETERS, *files]
    assert found['master'].stop_order < found['planner'].stop_order < found['slaves'].stop_order
    with pytest.raises(StartError, match='arm_planning'):
        processes(tmp_path, stack, 'arm_servo')


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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Files for viewers, and words of the page, name what robots have."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import import_module
import json
from pathlib import Path
import re
from typing import Any
from xml.etree import ElementTree as ET

import pytest
from urdf_reader import read_urdf
import yaml

from arm_bringup.robots import find_robot, read_description, read_semantic
from arm_canopen.master.remote_node import BootPhase
from arm_servo.teleop.keyboard_teleop import TOOL
from canopen_core.standard import DriveState, OperationMode
from quad_controller import MODES as QUAD_MODES
from quad_controller.states.modes import MOVING_STATES
from quad_description import movable_joints, robot_urdf
from quad_teleop.mappings import MOVES
from robot_viewer.page.jog_panel import TWISTS
from robot_viewer.page.robot_page import GAITS, MODES, WALKS
from robot_viewer.robot_state import (
    BOOTING,
    ENABLED,
    FAULTY,
    FOLLOWS,
    MODE_SERVICES,
    NO_MODE,
    POSTURES,
)

CHECKOUT = Path(__file__).parents[1]
ROBOTS = CHECKOUT / 'arm_bringup' / 'robots'
ARMS = ('panda', 'prbt', 'gp110')
DOG = CHECKOUT / 'quad_bringup' / 'view'
LAYOUTS = [*(ROBOTS / name / 'foxglove.json' for name in ARMS), DOG / 'foxglove.json']
RVIZ = [ROBOTS / name / file for name in ARMS for file in (f'{name}.rviz', 'moveit.rviz')]
RVIZ.append(DOG / 'quad.rviz')
CURVES = [*(ROBOTS / name / 'plotjuggler.xml' for name in ARMS), DOG / 'plotjuggler.xml']
PANELS = {'3D', 'DiagnosticSummary', 'Plot', 'RosOut', 'StateTransitions'}
"""Of Foxglove and Lichtblick alike: packages/suite-base/src/panels of the latter."""
CLASSES = {
    # rviz_common, src/rviz_common/visualization_frame.cpp and panel_factory.cpp
    *(f'rviz_common/{name}' for name in ('Displays', 'Tool Properties', 'Views')),
    # rviz_default_plugins, plugins_description.xml
    *(f'rviz_default_plugins/{name}' for name in ('Grid', 'Odometry', 'RobotModel', 'TF')),
    *(f'rviz_default_plugins/{name}' for name in ('FocusCamera', 'Interact', 'Measure')),
    *(f'rviz_default_plugins/{name}' for name in ('MoveCamera', 'Orbit', 'Select')),
    # moveit_ros_visualization, motion_planning_rviz_plugin_description.xml
    'moveit_rviz_plugin/MotionPlanning',
}
"""Names of classes that RViz of Jazzy loads."""


@dataclass(frozen=True)
class Named:
    """What a file names."""

    frames: frozenset[str]  # frames of TF
    topics: frozenset[str]  # topics
    fields: frozenset[tuple[str, str]]  # fields of messages, each behind its topic


def entries(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield each key of a document with its value, however deep."""
    if isinstance(value, dict):
        for key, each in value.items():
            yield key, each
            yield from entries(each)
    elif isinstance(value, list):
        for each in value:
            yield from entries(each)


def layout(file: Path) -> Named:
    """Read a layout."""
    document = json.loads(file.read_text('utf-8'))
    found = list(entries(document['configById']))
    paths = [each['value'] for key, values in found if key == 'paths' for each in values]
    fields = frozenset((path.partition('.')[0], path.partition('.')[2]) for path in paths)
    keys = {'topic', 'topicToRender'}
    topics = {value for key, value in found if key in keys} | {topic for topic, _ in fields}
    frames = {value for key, value in found if key in {'followTf', 'frameId'}}
    return Named(frozenset(frames), frozenset(topics), fields)


TYPES = {
    'battery_state': 'sensor_msgs/msg/BatteryState',
    'cmd_vel': 'geometry_msgs/msg/Twist',
    'controller_state': 'control_msgs/msg/JointTrajectoryControllerState',
    'imu': 'sensor_msgs/msg/Imu',
    'joint_command': 'quad_msgs/msg/JointCommand',
    'joint_states': 'sensor_msgs/msg/JointState',
    'odom': 'nav_msgs/msg/Odometry',
}
"""Types of the topics of which PlotJuggler draws curves, by the last part of their names."""


def curves(file: Path) -> Iterator[tuple[str, str]]:
    """Yield topic and field of each curve of PlotJuggler.

    It names a field as ROS does, with slashes; the fields of joint states by the joint, and roll,
    pitch and yaw beside a quaternion (plotjuggler_ros, parser of each type).
    """
    for curve in ET.parse(file).iter('curve'):  # noqa: S314  # of this repository
        found = re.fullmatch(rf'(/(?:\w+/)*?(?:{"|".join(TYPES)}))/(.+)', curve.attrib['name'])
        assert found is not None, curve.attrib['name']
        yield found[1], found[2]


def plotjuggler(file: Path, joints: list[str]) -> Named:
    """Read a layout of PlotJuggler.

    Args:
        file: The layout.
        joints: Joints of the robot, in their order.
    """
    fields = set()
    for topic, path in curves(file):
        field = re.sub(r'/(roll|pitch|yaw)$', '/x', path)
        if topic.endswith('joint_states'):
            joint, _, name = path.partition('/')
            field = f'{name}[{joints.index(joint)}]'
        fields.add((topic, field.replace('/', '.')))
    topics = frozenset(topic for topic, _ in fields)
    return Named(frozenset(), topics, frozenset(fields))


def rviz(file: Path) -> Named:
    """Read a configuration of RViz."""
    found = list(entries(yaml.safe_load(file.read_text('utf-8'))))
    keys = {'Planning Scene Topic', 'Trajectory Topic'}
    topics = {value for key, value in found if key in keys}
    topics |= {v['Value'] for k, v in found if k in {'Topic', 'Description Topic'}}
    keys = {'Fixed Frame', 'Reference Frame', 'Target Frame'}
    frames = {value for key, value in found if key in keys} - {'<Fixed Frame>'}
    return Named(frozenset(frames), frozenset(topics), frozenset())


def links(name: str) -> set[str]:
    """Return the links of an arm."""
    tree = read_urdf(read_description(find_robot(name, ROBOTS)))
    return set(tree.links)


@pytest.mark.parametrize('file', LAYOUTS, ids=str)
def test_a_layout_shows_each_panel_once(file: Path) -> None:
    """All are of known kinds, and each has its place."""
    document = json.loads(file.read_text('utf-8'))
    placed: list[str] = []

    def walk(node: str | dict[str, Any]) -> None:
        if isinstance(node, str):
            placed.append(node)
            return
        assert node['direction'] in {'row', 'column'}
        assert 0 < node['splitPercentage'] < 100
        walk(node['first'])
        walk(node['second'])

    walk(document['layout'])
    assert sorted(placed) == sorted(document['configById'])
    assert {name.partition('!')[0] for name in placed} <= PANELS
    assert any(name.startswith('3D!') for name in placed)


@pytest.mark.parametrize('file', RVIZ, ids=str)
def test_rviz_loads_known_classes(file: Path) -> None:
    """A class that there is not would be an error on the screen."""
    document = yaml.safe_load(file.read_text('utf-8'))
    classes = {value for key, value in entries(document) if key == 'Class'} - {''}
    assert classes <= CLASSES
    shown = [each['Class'] for each in document['Visualization Manager']['Displays']]
    expected = 'MotionPlanning' if file.name == 'moveit.rviz' else 'RobotModel'
    assert any(each.endswith(expected) for each in shown)


@pytest.mark.parametrize('name', ARMS)
def test_frames_and_groups_of_arms_are_there(name: str) -> None:
    """In the description of each arm; what all arms have is compared with the Panda's."""
    files = [layout(ROBOTS / name / 'foxglove.json')]
    files += [rviz(ROBOTS / name / file) for file in (f'{name}.rviz', 'moveit.rviz')]
    for file in files:
        assert file.frames
        assert file.frames <= links(name)
    document = yaml.safe_load((ROBOTS / name / 'moveit.rviz').read_text('utf-8'))
    group = next(value for key, value in entries(document) if key == 'Planning Group')
    assert f'<group name="{group}">' in read_semantic(find_robot(name, ROBOTS))
    assert files[1].topics == rviz(ROBOTS / 'panda' / 'panda.rviz').topics
    assert files[2].topics == rviz(ROBOTS / 'panda' / 'moveit.rviz').topics


@pytest.mark.parametrize('name', ARMS)
def test_plots_of_arms_show_all_joints(name: str) -> None:
    """Each index is a joint that moves, with its name; the controller is the robot's own."""
    robot = find_robot(name, ROBOTS)
    document = json.loads((ROBOTS / name / 'foxglove.json').read_text('utf-8'))
    joints = list(read_urdf(read_description(robot)).ranges())
    controllers = yaml.safe_load((ROBOTS / name / 'controllers.yaml').read_text('utf-8'))
    controller = controllers['controller_manager']['ros__parameters']['controller_name']
    error = document['configById']['Plot!error']['paths']
    assert [each['label'] for each in error] == joints
    assert [each['value'] for each in error] == [
        f'/{controller}/controller_state.error.positions[{i}]' for i in range(len(joints))
    ]


def type_of(kind: Any, path: str) -> str:
    """Return the type of a field of a message.

    Raises:
        KeyError: There is none.
    """
    name, _, rest = path.partition('.')
    field, indexed = re.fullmatch(r'(\w+)(\[\d+\])?', name).groups()  # type: ignore[union-attr]
    found = str(kind.get_fields_and_field_types()[field])
    element = re.sub(r'sequence<([^,>]+)(, \d+)?>|\[\d*\]', r'\1', found)
    assert bool(indexed) == (element != found), f'{path}: {found}'
    return type_of(class_of(element, 'msg'), rest) if rest else element


def class_of(name: str, folder: str) -> Any:
    """Return the class of a type, `package/Name` or `package/folder/Name`."""
    parts = name.split('/')
    return getattr(import_module(f'{parts[0]}.{folder}'), parts[-1])


def joints_of(file: Path) -> list[str]:
    """Return the joints of the robot of a layout, in the order of its messages."""
    if file.parent == DOG:
        return [joint.name for joint in movable_joints(robot_urdf())]
    return list(read_urdf(read_description(find_robot(file.parent.name, ROBOTS))).ranges())


@pytest.mark.parametrize('file', CURVES, ids=lambda file: file.parent.name)
def test_each_curve_is_a_number_of_a_message(file: Path) -> None:
    """All joints are there, measured and wanted; the controller is the robot's own."""
    joints = joints_of(file)
    named = plotjuggler(file, joints)
    for topic, path in named.fields:
        kind = TYPES[topic.rpartition('/')[2]]
        assert type_of(class_of(kind, 'msg'), path) in {'double', 'float'}, f'{topic}.{path}'
    if file.parent == DOG:
        wanted = {f'position[{index}]' for index in range(len(joints))}
        commands = {path for topic, path in named.fields if topic == '/joint_command'}
    else:
        shown = layout(file.with_name('foxglove.json')).fields
        wanted = {path for topic, path in shown if topic.endswith('controller_state')}
        commands = {p for topic, p in named.fields if (topic, p) in shown}
    assert wanted <= commands
    shown_joints = {p.partition('/')[0] for topic, p in curves(file) if topic == '/joint_states'}
    assert shown_joints == set(joints)


@pytest.mark.parametrize('file', CURVES, ids=lambda file: file.parent.name)
def test_a_layout_of_plotjuggler_has_its_parts(file: Path) -> None:
    """Tabs, each with as many plots as it says, and a curve once in each plot."""
    root = ET.parse(file).getroot()  # noqa: S314  # of this repository
    tabs = root.findall('./tabbed_widget/Tab')
    assert tabs
    for tab in tabs:
        [splitter] = tab.findall('./Container/DockSplitter')
        plots = splitter.findall('./DockArea/plot')
        assert len(plots) == int(splitter.attrib['count'])
        assert sum(map(float, splitter.attrib['sizes'].split(';'))) == pytest.approx(1.0, abs=1e-3)
        for plot in plots:
            names = [curve.attrib['name'] for curve in plot.iter('curve')]
            assert names
            assert len(names) == len(set(names))


NO_PART = ('arm_servo servo_', 'quad_teleop', 'robot_viewer web_viewer')
"""Programs of docs/reference/nodes.md that no robot needs."""


def declared() -> dict[str, str]:
    """Return the topics of the Panda and of the dog with their types."""
    text = (CHECKOUT / 'docs' / 'reference' / 'nodes.md').read_text('utf-8')
    programs = [part for part in text.split('\n## ')[1:] if not part.startswith(NO_PART)]
    rows = re.findall(r'\| (?:publishes|subscribes) \| `(.+?)` \| `(.+?)`', ''.join(programs))
    found = {name.replace('<group>', 'panda_arm'): kind for name, kind in rows}
    return found | {'/rosout': 'rcl_interfaces/msg/Log'}


@pytest.mark.parametrize('folder', [ROBOTS / 'panda', DOG], ids=lambda folder: folder.name)
def test_a_robot_has_all(folder: Path) -> None:
    """Topics and fields are those of the page that is compared with running robots."""
    plotted, topics = folder / 'plotjuggler.xml', declared()
    frames = {'odom', *read_urdf(robot_urdf()).links} if folder == DOG else links(folder.name)
    files = [layout(folder / 'foxglove.json'), plotjuggler(plotted, joints_of(plotted))]
    for named in [*files, *map(rviz, folder.glob('*.rviz'))]:
        assert named.topics <= topics.keys()
        assert named.frames <= frames
        for topic, path in named.fields:
            assert type_of(class_of(topics[topic], 'msg'), path), f'{topic}.{path}'


ENDS = {BootPhase.WAITING, BootPhase.OPERATIONAL, BootPhase.FAILED}
"""Phases in which a device does not come by itself, or is there."""


def test_words_of_drives() -> None:
    """Each phase of a boot is one; a fault and a drive with torque are known by their titles."""
    assert set(BOOTING) == {phase.value for phase in BootPhase if phase not in ENDS}
    faults = DriveState.FAULT, DriveState.FAULT_REACTION_ACTIVE
    assert {state.title for state in faults} == FAULTY
    assert DriveState.OPERATION_ENABLED.title == ENABLED
    assert {NO_MODE, *MODE_SERVICES} <= {mode.title for mode in OperationMode}


def test_words_of_legs() -> None:
    """Modes that the page requests are modes; those with velocities are all of them."""
    assert {state.value for state in MOVING_STATES} == FOLLOWS
    assert {*POSTURES, *MODES.values(), *(f'gait:{gait}' for gait in GAITS)} <= set(QUAD_MODES)


def test_keys_are_those_of_the_terminals() -> None:
    """They move the same way."""
    for key, twist in TWISTS.values():
        jog = TOOL[key.removeprefix('Arrow').lower()]
        assert (*jog.linear, *jog.angular) == twist
    for key, velocity in WALKS.values():
        move = MOVES[key]
        assert [*map(signum, velocity)] == [move.x, move.y, move.yaw]


def signum(value: float) -> int:
    """Return 1, 0 or -1."""
    return (value > 0.0) - (value < 0.0)

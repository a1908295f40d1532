# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot folders by name and by path, their buses, and where simulated drives start."""

from __future__ import annotations

from dataclasses import replace
import math
import os
from pathlib import Path

import pytest

from arm_bringup.check import check_robot
from arm_bringup.groups import start_positions, StartPositions
from arm_bringup.robots import (
    find_robot,
    read_bus,
    read_description,
    Robot,
    robot_names,
    RobotError,
    stream_mode_service,
)
from arm_bringup.session import arm_processes, Stack
from arm_canopen import load_bus
from arm_model import frozen, load_limits, RobotModel

EDS = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
RANGES = {'lift': (0.0, 0.5), 'turn': (0.3, 2.0), 'swing': (-3.0, 3.0), 'bend': (-3.0, 3.0)}


@pytest.fixture
def robot(tmp_path: Path) -> Robot:
    """Make an arm on a lift whose second joint does not reach 0, and whose links fold at 0."""
    folder = tmp_path / 'arm'
    folder.mkdir()
    (folder / 'arm.urdf').write_text(urdf(RANGES))
    (folder / 'arm.srdf').write_text(
        '<robot name="arm"><group name="arm"><chain base_link="base" tip_link="tip"/></group>'
        '<disable_collisions link1="base" link2="lift_link" reason="Adjacent"/></robot>'
    )
    limits = '{max_velocity: 1, max_acceleration: 4, max_jerk: 40}'
    (folder / 'limits.yaml').write_text(
        'joint_limits:\n' + ''.join(f'  {name}: {limits}\n' for name in RANGES)
    )
    (folder / 'bus.yml').write_text(
        'master: {node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}\n'
        + ''.join(
            f'{name}: {{node_id: {n}, driver: "ros2_canopen::Cia402Driver", dcf: {EDS}}}\n'
            for n, name in enumerate((*RANGES, 'finger'), start=2)
        )
    )
    return find_robot(f'{folder}/', tmp_path)


def urdf(ranges: dict[str, tuple[float, float]], finger: tuple[float, float] = (0, 0.04)) -> str:
    """Return an arm that folds back upon its base at 0 where no joint keeps it from it."""
    ball = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    parts, parent = [f'<robot name="arm"><link name="base">{ball}</link>'], 'base'
    places = {'lift': '0 0 0.2', 'turn': '0 0 0.1', 'swing': '0.3 0 0', 'bend': '-0.3 0 -0.05'}
    for name, (lower, upper) in ranges.items():
        kind, axis = (
            ('prismatic', _axis('0 0 1')) if name == 'lift' else ('revolute', _axis('0 1 0'))
        )
        limits = _limits(lower, upper)
        parts.append(_joint(name, kind, parent, f'<origin xyz="{places[name]}"/>{axis}{limits}'))
        parent = f'{name}_link'
        parts.append(f'<link name="{parent}">{ball if name in {"lift", "bend"} else ""}</link>')
    parts.append(_joint('finger', 'prismatic', parent, _axis('0 1 0') + _limits(*finger)))
    parts.append('<link name="finger_link"/><link name="tip"/><joint name="end" type="fixed">')
    parts.append(f'<parent link="{parent}"/><child link="tip"/><origin xyz="0.2 0 0"/></joint>')
    return ''.join([*parts, '</robot>'])


def _joint(name: str, kind: str, parent: str, inner: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
        f'<child link="{name}_link"/>{inner}</joint>'
    )


def _axis(xyz: str) -> str:
    return f'<axis xyz="{xyz}"/>'


def _limits(lower: float, upper: float) -> str:
    return f'<limit lower="{lower}" upper="{upper}" velocity="1" effort="1"/>'


def start_of(robot: Robot) -> StartPositions:
    """Choose the start of a robot folder."""
    return start_positions(robot, read_description(robot), read_bus(robot).joints)


def model_of(robot: Robot) -> RobotModel:
    """Build the arm."""
    text = robot.semantic.read_text()
    return RobotModel(read_description(robot), text, load_limits(robot.limits))


@pytest.mark.slow
def test_an_arm_that_does_not_reach_0_starts_in_its_ranges(robot: Robot) -> None:
    """From a pose that is free; the log has joint and range."""
    start = start_of(robot)
    model = model_of(robot)
    pose = frozen([start.positions[name] for name in model.joints])
    assert (model.limits.lower <= pose).all()
    assert (pose <= model.limits.upper).all()
    assert model.clearance(pose) > 0.0
    assert 'finger' not in start.positions
    assert str(start).startswith('simulated drives start at lift ')
    assert 'because at 0 turn is outside its range of 0.3 to 2' in str(start)


@pytest.mark.slow
def test_an_arm_that_collides_at_0_starts_apart(robot: Robot) -> None:
    """The log names the links."""
    robot.description.write_text(urdf({**RANGES, 'turn': (-2.0, 2.0)}))
    start = start_of(robot)
    model = model_of(robot)
    assert model.clearance(frozen([0.0] * len(model))) < 0.0
    assert model.clearance(frozen([start.positions[name] for name in model.joints])) > 0.0
    assert 'because at 0 lift_link and bend_link collide' in str(start)


@pytest.mark.slow
def test_a_drive_beside_the_groups_starts_in_its_range(robot: Robot) -> None:
    """In the middle; the group, which can stand at 0, stays there."""
    ranges = dict.fromkeys(RANGES, (-2.0, 2.0))
    text = urdf(ranges, (0.01, 0.04)).replace('xyz="-0.3 0 -0.05"', 'xyz="0.3 0 0.12"')
    robot.description.write_text(text)
    start = start_of(robot)
    assert start.positions == {'finger': pytest.approx(0.025)}


@pytest.mark.slow
def test_without_limits_of_motion_the_ranges_of_the_description_count(robot: Robot) -> None:
    """As for an arm of which only the drives are moved."""
    robot.limits.unlink()
    assert start_of(robot).positions == {'turn': pytest.approx(1.15)}


@pytest.mark.slow
def test_robot_yaml_has_the_last_word(robot: Robot) -> None:
    """What it names is where drives start; a name that is no drive is refused, by check too."""
    settings = robot.folder / 'robot.yaml'
    settings.write_text('start_positions: {turn: 1, bend: 0.5}')
    robot = find_robot(f'{robot.folder}/', robot.folder)
    start = start_of(robot)
    assert start.positions == {'turn': 1.0, 'bend': 0.5}
    assert 'turn 1, bend 0.5, because robot.yaml has start_positions' in str(start)
    settings.write_text('start_positions: {tern: 1}')
    robot = find_robot(f'{robot.folder}/', robot.folder)
    words = 'start_positions: bus.yml has no drive tern; drives: lift, turn'
    with pytest.raises(RobotError, match=words):
        start_of(robot)
    assert any(words in str(finding) for finding in check_robot(robot))


@pytest.mark.slow
def test_a_pose_of_the_srdf_is_named(robot: Robot) -> None:
    """Of its joints that have drives; another name is refused with those that there are."""
    pose = '<joint name="turn" value="1"/><joint name="other" value="2"/>'
    state = f'<group_state name="park" group="arm">{pose}</group_state></robot>'
    robot.semantic.write_text(robot.semantic.read_text().replace('</robot>', state))
    settings = robot.folder / 'robot.yaml'
    settings.write_text('start_positions: park')
    assert start_of(find_robot(f'{robot.folder}/', robot.folder)).positions == {'turn': 1.0}
    settings.write_text('start_positions: bark')
    robot = find_robot(f'{robot.folder}/', robot.folder)
    words = "the SRDF has no pose 'bark'; poses: park"
    with pytest.raises(RobotError, match=words):
        start_of(robot)
    assert any(words in str(finding) for finding in check_robot(robot))
    robot.semantic.unlink()
    with pytest.raises(RobotError, match="'bark' is a pose of the SRDF, and there is none"):
        start_of(robot)


@pytest.mark.slow
@pytest.mark.parametrize('text', ['[1]', '{turn: high}', '{turn: true}'])
def test_what_is_no_table_of_numbers_is_refused(robot: Robot, text: str) -> None:
    """With the key."""
    (robot.folder / 'robot.yaml').write_text(f'start_positions: {text}')
    with pytest.raises(RobotError, match='start_positions'):
        find_robot(f'{robot.folder}/', robot.folder)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'prbt', 'gp110'])
def test_the_robots_here(name: str) -> None:
    """They name the pose that would be found for them, which takes a second to import."""
    robot = find_robot(name, ROBOTS)
    found = start_of(replace(robot, start_positions={})).positions
    given = start_of(robot).positions
    assert {joint: at for joint, at in given.items() if at} == pytest.approx(
        {joint: at for joint, at in found.items() if at}
    )
    assert ('panda_joint4' in given) is (name == 'panda')


@pytest.mark.slow
def test_the_simulated_drives_get_them(robot: Robot, tmp_path: Path) -> None:
    """As parameters that ROS takes for numbers."""
    program = tmp_path / 'program'
    program.touch(mode=0o755)
    stack = Stack(robot, 'vcan0', simulate=True, start_positions={'turn': 1.0, 'bend': -1e-05})
    specs = arm_processes(stack, tmp_path / 'parameters', lambda package, name: program)
    (slaves,) = (spec for spec in specs if spec.name == 'slaves')
    assert {'positions.turn:=1.0', 'positions.bend:=-1e-05'} <= set(slaves.argv)
    real = arm_processes(
        replace(stack, simulate=False), tmp_path / 'parameters', lambda package, name: program
    )
    assert 'slaves' not in {spec.name for spec in real}


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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot folders by name and by path, their buses, and where simulated drives start."""

from __future__ import annotations

from dataclasses import replace
import math
import os
from pathlib import Path

import pytest

from arm_bringup import robots
from arm_bringup.check import check_robot
from arm_bringup.groups import start_positions, StartPositions
from arm_bringup.session import arm_processes, Stack
from arm_canopen import load_bus
from arm_model import frozen, load_limits, RobotModel

EDS = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'
RANGES = {'lift': (0.0, 0.5), 'turn': (0.3, 2.0), 'swing': (-3.0, 3.0), 'bend': (-3.0, 3.0)}


@pytest.fixture
def robot(tmp_path: Path) -> robots.Robot:
    """Make an arm on a lift whose second joint does not reach 0, and whose links fold at 0."""
    folder = tmp_path / 'arm'
    folder.mkdir()
    (folder / 'arm.urdf').write_text(urdf(RANGES))
    (folder / 'arm.srdf').write_text(
        '<robot name="arm"><group name="arm"><chain base_link="base" tip_link="tip"/></group>'
        '<disable_collisions link1="base" link2="lift_link" reason="Adjacent"/></robot>'
    )
    limits = '{max_velocity: 1, max_acceleration: 4, max_jerk: 40}'
    rows = ['joint_limits:', *(f'  {name}: {limits}' for name in RANGES)]
    (folder / 'limits.yaml').write_text('\n'.join(rows))
    drive = f'driver: "ros2_canopen::Cia402Driver", dcf: {EDS}'
    rows = ['master: {node_id: 1, driver: "ros2_canopen::MasterDriver", sync_period: 10000}']
    for number, name in enumerate((*RANGES, 'finger'), start=2):
        rows.append(f'{name}: {{node_id: {number}, {drive}}}')
    (folder / 'bus.yml').write_text('\n'.join(rows))
    return robots.find_robot(f'{folder}/', tmp_path)


def urdf(ranges: dict[str, tuple[float, float]], finger: tuple[float, float] = (0, 0.04)) -> str:
    """Return an arm that folds back upon its base at 0 where no joint keeps it from it."""
    ball = '<collision><geometry><sphere radius="0.05"/></geometry></collision>'
    parts, parent = [f'<robot name="arm"><link name="base">{ball}</link>'], 'base'
    places = {'lift': '0 0 0.2', 'turn': '0 0 0.1', 'swing': '0.3 0 0', 'bend': '-0.3 0 -0.05'}
    for name, (lower, upper) in {**ranges, 'finger': finger}.items():
        kind = 'prismatic' if name in {'lift', 'finger'} else 'revolute'
        parts.append(
            f'<joint name="{name}" type="{kind}"><parent link="{parent}"/>'
            f'<child link="{name}_link"/><origin xyz="{places.get(name, "0 0 0")}"/>'
            f'<axis xyz="{"0 0 1" if name == "lift" else "0 1 0"}"/>'
            f'<limit lower="{lower}" upper="{upper}" velocity="1" effort="1"/></joint>'
            f'<link name="{name}_link">{ball if name in {"lift", "bend"} else ""}</link>'
        )
        parent = f'{name}_link'
    end = '<joint name="end" type="fixed"><parent link="bend_link"/><child link="tip"/>'
    parts.append(f'<link name="tip"/>{end}<origin xyz="0.2 0 0"/></joint></robot>')
    return ''.join(parts)


def start_of(robot: robots.Robot) -> StartPositions:
    """Choose the start of a robot folder."""
    return start_positions(robot, robots.read_description(robot), robots.read_bus(robot).joints)


def model_of(robot: robots.Robot) -> RobotModel:
    """Build the arm."""
    text = robot.semantic.read_text()
    return RobotModel(robots.read_description(robot), text, load_limits(robot.limits))


@pytest.mark.slow
@pytest.mark.parametrize(
    ('turn', 'why'),
    [
        ((0.3, 2.0), 'at 0 turn is outside its range of 0.3 to 2'),
        ((-2.0, 2.0), 'at 0 lift_link and bend_link collide'),
    ],
)
def test_an_arm_that_cannot_stand_at_0_starts_elsewhere(
    robot: robots.Robot, turn: tuple[float, float], why: str
) -> None:
    """In its ranges, from a pose that is free; the log has joint and range, or the links."""
    robot.description.write_text(urdf({**RANGES, 'turn': turn}))
    start = start_of(robot)
    model = model_of(robot)
    pose = frozen([start.positions.get(name, 0.0) for name in model.joints])
    assert (model.limits.lower <= pose).all()
    assert (pose <= model.limits.upper).all()
    assert model.clearance(pose) > 0.0
    assert 'finger' not in start.positions
    assert str(start).startswith('simulated drives start at ')
    assert f'because {why}' in str(start)
    # without limits of motion, as for an arm of which only the drives are moved
    robot.limits.unlink()
    outside = {} if turn[0] < 0.0 else {'turn': pytest.approx(1.15)}
    assert start_of(robot).positions == outside


@pytest.mark.slow
def test_a_drive_beside_the_groups_starts_in_its_range(robot: robots.Robot) -> None:
    """In the middle; the group, which can stand at 0, stays there."""
    ranges = dict.fromkeys(RANGES, (-2.0, 2.0))
    text = urdf(ranges, (0.01, 0.04)).replace('xyz="-0.3 0 -0.05"', 'xyz="0.3 0 0.12"')
    robot.description.write_text(text)
    start = start_of(robot)
    assert start.positions == {'finger': pytest.approx(0.025)}


def given(robot: robots.Robot, text: str) -> robots.Robot:
    """Return a robot with start positions of robot.yaml."""
    (robot.folder / 'robot.yaml').write_text(f'start_positions: {text}')
    return robots.find_robot(f'{robot.folder}/', robot.folder)


@pytest.mark.slow
def test_robot_yaml_has_the_last_word(robot: robots.Robot) -> None:
    """Places of drives, or a pose of the SRDF, of its joints that have drives.

    A name that is no drive or no pose is refused with those that there are, by check too.
    """
    pose = '<joint name="turn" value="1"/><joint name="other" value="2"/>'
    state = f'<group_state name="park" group="arm">{pose}</group_state></robot>'
    robot.semantic.write_text(robot.semantic.read_text().replace('</robot>', state))
    start = start_of(given(robot, '{turn: 1, bend: 0.5}'))
    assert start.positions == {'turn': 1.0, 'bend': 0.5}
    assert 'turn 1, bend 0.5, because robot.yaml has start_positions' in str(start)
    assert start_of(given(robot, 'park')).positions == {'turn': 1.0}
    for text, words in (
        ('{tern: 1}', 'start_positions: bus.yml has no drive tern; drives: lift, turn'),
        ('bark', "the SRDF has no pose 'bark'; poses: park"),
    ):
        wrong = given(robot, text)
        with pytest.raises(robots.RobotError, match=words):
            start_of(wrong)
        assert any(words in str(finding) for finding in check_robot(wrong))
    robot.semantic.unlink()
    with pytest.raises(robots.RobotError, match="'bark' is a pose of the SRDF, and there is none"):
        start_of(given(robot, 'bark'))
    for text in ('[1]', '{turn: high}', '{turn: true}'):
        with pytest.raises(robots.RobotError, match='start_positions'):
            given(robot, text)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['panda', 'prbt', 'gp110'])
def test_the_robots_here(name: str) -> None:
    """They name the pose that would be found for them, which takes a second to import."""
    robot = robots.find_robot(name, ROBOTS)
    found = start_of(replace(robot, start_positions={})).positions
    given = start_of(robot).positions
    assert {joint: at for joint, at in given.items() if at} == pytest.approx(
        {joint: at for joint, at in found.items() if at}
    )
    assert ('panda_joint4' in given) is (name == 'panda')


@pytest.mark.slow
def test_the_simulated_drives_get_them(robot: robots.Robot, tmp_path: Path) -> None:
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


def test_a_robot_is_found_by_name_or_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bus and description are in its folder, by convention; relative paths count from here.

    What is not there is said: an unknown name with those that exist, all files that are missing.
    """
    robot = robots.find_robot('panda', ROBOTS)
    assert robot.name == 'panda'
    assert robot.bus_config == ROBOTS / 'panda' / 'bus.yml'
    assert robot.description == ROBOTS / 'panda' / 'panda.urdf.xacro'
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / 'my_arm'
    folder.mkdir()
    for name, words in (
        ('pandora', r"'pandora'.*robots: .*panda.*\./pandora"),
        ('./my_arm', 'lacks bus.yml and my_arm.urdf.xacro'),
        ('./nowhere', 'does not exist'),
    ):
        with pytest.raises(robots.RobotError, match=words):
            robots.find_robot(name, ROBOTS)
    (folder / 'bus.yml').touch()
    (folder / 'my_arm.urdf.xacro').touch()
    robot = robots.find_robot(f'.{os.sep}my_arm', ROBOTS)
    assert (robot.name, robot.bus_config) == ('my_arm', folder / 'bus.yml')
    assert robots.robot_names(tmp_path) == ['my_arm']


@pytest.mark.parametrize(
    ('name', 'joints', 'first', 'mode'),
    [
        ('panda', [f'panda_joint{i}' for i in range(1, 8)], 2, 'cyclic_position_mode'),
        ('prbt', [f'prbt_joint_{i}' for i in range(1, 7)], 3, 'interpolated_position_mode'),
    ],
)
def test_the_bus_of_an_article_has_a_drive_for_each_joint(
    name: str, joints: list[str], first: int, mode: str
) -> None:
    """With its EDS, without a mistake; streams have the mode that bus.yml asks for.

    That is interpolated position on the PRBT; the Panda asks for profile position, so cyclic.
    """
    bus = load_bus(ROBOTS / name / 'bus.yml')
    assert name != 'panda' or (ROBOTS / name / 'cia402_slave.eds').resolve() == EDS.resolve()
    assert [node.name for node in bus.nodes] == joints
    assert [node.node_id for node in bus.nodes] == list(range(first, first + len(joints)))
    assert all(node.is_drive for node in bus.nodes)
    assert bus.warnings == ()
    assert bus.master.sync_period == pytest.approx(0.01)
    assert robots.stream_mode_service(robots.read_bus(robots.find_robot(name, ROBOTS))) == mode
    if name == 'prbt':  # thousandths of a degree
        for node in bus.nodes:
            assert node.drive.position_mode == 7
            assert node.drive.scale_pos_to_dev == pytest.approx(math.degrees(1000.0), rel=1e-8)
            assert node.drive.scale_vel_to_dev == node.drive.scale_pos_to_dev

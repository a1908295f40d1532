# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The URDF against the dimensions and masses of the robot, and against physics."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import Path
import subprocess
import sys

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from quad_builds import centre_of_mass, inertia, link_pose, mass, parse, rotation
from quad_description import (
    DescriptionError,
    LEGS,
    movable_joints,
    Pose,
    pose_positions,
    PresetError,
    PRESETS,
    quadruped,
    robot_urdf,
    run_command,
)
from quad_description.presets import run

pytestmark = pytest.mark.slow

SIDE = {'fl': 1, 'fr': -1, 'bl': 1, 'br': -1}
BUILDS = [(preset, arm) for preset in PRESETS for arm in (False, True)]
builds = pytest.mark.parametrize(('preset', 'arm'), BUILDS)

# roll axis, knee and pad of a left leg at zero [m], as the vendor's model has them
HIP_X = {'f': 0.04946, 'b': -0.10059}
ANGLE = st.floats(-1.0, 1.0)
ROOT, MINI = parse(robot_urdf('mini')), quadruped(robot_urdf('mini'))
BROKEN = (
    '<robot><link name="b"/><link name="c"/>'
    '<joint name="a" type="revolute"><parent link="b"/><child link="c"/>{}</joint></robot>'
)


@builds
def test_every_link_hangs_on_the_base(preset: str, arm: bool) -> None:
    """The description is one tree with base_link as root, and has the links that others name."""
    root = parse(robot_urdf(preset, arm))
    links = [link.get('name') for link in root.iter('link')]
    children = [joint.find('child').get('link') for joint in root.iter('joint')]  # type: ignore[union-attr]
    parents = {joint.find('parent').get('link') for joint in root.iter('joint')}  # type: ignore[union-attr]
    assert sorted([*children, 'base_link']) == sorted(links)  # type: ignore[type-var]
    assert len(set(links)) == len(links)
    assert parents <= set(links)
    expected = {f'{leg}_{part}' for leg in LEGS for part in ('hip', 'thigh', 'calf', 'foot')}
    expected |= {'base_link', 'imu_link', 'base_footprint'}
    expected |= {'arm_yaw', 'arm_thigh', 'arm_calf', 'hand_right', 'hand_left'} if arm else set()
    assert set(links) == expected


@builds
def test_motors_come_in_the_order_of_the_contract(preset: str, arm: bool) -> None:
    """Twelve leg joints leg by leg, then the arm and one joint for the gripper."""
    names = [joint.name for joint in movable_joints(robot_urdf(preset, arm))]
    legs = [f'{leg}_{joint}_joint' for leg in LEGS for joint in ('hip', 'thigh', 'calf')]
    extra = ['arm_yaw_joint', 'arm_thigh_joint', 'arm_calf_joint', 'hand_right_joint']
    assert names == legs + (extra if arm else [])


@builds
def test_inertias_are_those_of_a_solid_body(preset: str, arm: bool) -> None:
    """Every mass is positive and every inertia that of some body: the triangle law holds."""
    for link in parse(robot_urdf(preset, arm)).iter('link'):
        if link.find('inertial') is None:
            assert link.get('name') in {'imu_link', 'base_footprint'}
            continue
        assert mass(link) > 0
        moments = np.sort(np.linalg.eigvalsh(inertia(link)))
        assert moments[0] > 0
        assert moments[2] < moments[0] + moments[1]
        # not larger than a shell as long as the robot could have
        assert moments[2] < mass(link) * 0.15**2


@pytest.mark.parametrize('leg', LEGS)
def test_feet_are_where_the_vendor_has_them(leg: str) -> None:
    """Knee and pad positions at zero equal the published numbers."""
    root = parse(robot_urdf('mini'))
    side, x = SIDE[leg], HIP_X[leg[0]]
    hip, _ = link_pose(root, f'{leg}_hip', {})
    knee, _ = link_pose(root, f'{leg}_calf', {})
    foot, _ = link_pose(root, f'{leg}_foot', {})
    assert hip == pytest.approx([x, side * 0.0225, -0.02207], abs=1e-9)
    assert knee == pytest.approx([x - 0.0186, side * 0.0721, -0.02207 - 0.0599], abs=1e-9)
    assert foot - knee == pytest.approx([0.0715, -side * 0.0186, -0.0226], abs=1e-9)
    assert math.hypot(0.0715, 0.0226) == pytest.approx(0.0750, abs=1e-4)
    assert foot[1] == pytest.approx(side * 0.0535)


@pytest.mark.parametrize('leg', LEGS)
@given(hip=ANGLE, thigh=ANGLE, calf=ANGLE)
def test_legs_bend_as_the_conventions_say(leg: str, hip: float, thigh: float, calf: float) -> None:
    """The foot follows from roll about -+x and pitches about y, in the URDF and in closed form."""
    at = {
        f'{leg}_{name}_joint': q
        for name, q in zip(('hip', 'thigh', 'calf'), (hip, thigh, calf), strict=True)
    }
    foot, _ = link_pose(ROOT, f'{leg}_foot', at)
    side, (x, y) = SIDE[leg], np.eye(3)[:2]
    shank = rotation(y, calf) @ np.array([0.0715, -side * 0.0186, -0.0226])
    below = rotation(y, thigh) @ (np.array([0, 0, -0.0599]) + shank)
    expected = rotation(-side * x, hip) @ (np.array([-0.0186, side * 0.0496, 0]) + below)
    expected += [HIP_X[leg[0]], side * 0.0225, -0.02207]
    assert foot == pytest.approx(expected, abs=1e-9)
    feet = MINI.feet([at.get(name, 0.0) for name in MINI.names])
    assert feet[LEGS.index(leg)] == pytest.approx(expected, abs=1e-9)


def test_a_positive_hip_moves_each_foot_inward() -> None:
    """The pad goes from 53.5 mm to 27.7 mm beside the middle at 0.3 rad, as in the vendor's."""
    root = parse(robot_urdf('mini'))
    for leg in LEGS:
        at = {f'{leg}_thigh_joint': 1.0, f'{leg}_calf_joint': -0.2792, f'{leg}_hip_joint': 0.3}
        foot, _ = link_pose(root, f'{leg}_foot', at)
        outward = SIDE[leg] * foot[1]
        drop = -0.02207 - link_pose(root, f'{leg}_foot', {**at, f'{leg}_hip_joint': 0})[0][2]
        assert outward == pytest.approx(0.0225 + 0.031 * math.cos(0.3) - drop * math.sin(0.3))
        assert outward < 0.03


def test_mass_and_centre_of_mass_are_the_vendors() -> None:
    """0.70 kg without and 0.749 kg with the arm, the centre 24 mm behind that of the hips."""
    root, with_arm = parse(robot_urdf('mini')), parse(robot_urdf('mini', arm=True))
    assert sum(map(mass, root.iter('link'))) == pytest.approx(0.7006, abs=1e-6)
    assert sum(map(mass, with_arm.iter('link'))) == pytest.approx(0.749, abs=3e-4)
    centre = centre_of_mass(root, pose_positions(Pose.STAND))
    assert centre == pytest.approx([-0.0496, 0, -0.028], abs=1e-3)


@builds
def test_poses_keep_the_limits(preset: str, arm: bool) -> None:
    """Every pose names exactly the motors, in their order and within their limits."""
    joints = movable_joints(robot_urdf(preset, arm))
    for pose in Pose:
        positions = pose_positions(pose, arm)
        assert list(positions) == [joint.name for joint in joints]
        for joint in joints:
            assert joint.limits.lower <= positions[joint.name] <= joint.limits.upper
            assert joint.limits.velocity > 0
            assert joint.limits.effort > 0


def test_standing_height_is_that_of_the_vendors_default_pose() -> None:
    """The base stands 125 to 130 mm above the ground."""
    foot, _ = link_pose(parse(robot_urdf('mini')), 'fl_foot', pose_positions(Pose.STAND))
    assert 0.125 <= 0.010 - foot[2] <= 0.130
    standing = list(pose_positions(Pose.STAND).values())
    assert quadruped(robot_urdf('mini')).standing_height(standing) == pytest.approx(
        0.010 - foot[2]
    )


def test_the_lite_keeps_what_its_servos_reach() -> None:
    """The lite's limits lie within the mini's and within its servos' range in degrees."""
    reach = {'hip': (-30, 30), 'thigh': (-70, 90), 'calf': (-70, 50)}
    pairs = zip(
        movable_joints(robot_urdf('lite')), movable_joints(robot_urdf('mini')), strict=True
    )
    for lite, mini in pairs:
        lowest, highest = reach[lite.name.split('_')[1]]
        assert max(mini.limits.lower, math.radians(lowest)) == pytest.approx(
            lite.limits.lower, abs=2e-3
        )
        assert min(mini.limits.upper, math.radians(highest)) == pytest.approx(
            lite.limits.upper, abs=1e-3
        )


@settings(max_examples=10)
@given(st.floats(0.05, 5.0))
def test_a_heavier_trunk_changes_nothing_else(kilograms: float) -> None:
    """trunk_mass sets the trunk's mass, scales its inertia, and leaves the legs alone."""
    plain, loaded = (
        parse(robot_urdf('mini')),
        parse(robot_urdf.__wrapped__('mini', False, kilograms)),
    )
    for one, other in zip(plain.iter('link'), loaded.iter('link'), strict=True):
        if one.get('name') == 'base_link':
            assert mass(other) == pytest.approx(kilograms)
            assert inertia(other) / mass(other) == pytest.approx(inertia(one) / mass(one))
        else:
            assert mass(one) == mass(other)


@pytest.mark.parametrize('kilograms', [0.0, -1.0, math.nan, math.inf, 50.0])
def test_a_trunk_that_cannot_be_is_refused(kilograms: float) -> None:
    """The message names the value and the range."""
    with pytest.raises(DescriptionError, match=r'kg is not 0\.05 to 5\.0 kg'):
        robot_urdf('mini', trunk_mass=kilograms)


def test_an_unknown_preset_is_answered_with_the_list() -> None:
    """The message names all presets."""
    with pytest.raises(PresetError, match="'rider'; choose one of lite, mini"):
        robot_urdf('rider')


@pytest.mark.parametrize(
    ('urdf', 'message'),
    [
        ('<robot', 'no XML'),
        (
            BROKEN.format(''),
            'joint a: a revolute joint needs <limit .../> with velocity and effort',
        ),
        (
            BROKEN.format('<limit velocity="1" effort="1" lower="x"/>'),
            'joint a: <limit> is not usable',
        ),
        (BROKEN.format('<axis xyz="0 0 0"/>'), 'joint a: <axis> has no direction'),
    ],
)
def test_a_broken_description_is_refused(urdf: str, message: str) -> None:
    """The message names the joint."""
    with pytest.raises(DescriptionError, match=message):
        movable_joints(urdf)


def test_the_xacro_file_takes_the_same_arguments() -> None:
    """What xacro makes of the file on the command line is what the API returns."""
    model = Path(__file__).parents[1] / 'quad_description' / 'model' / 'quadruped.urdf.xacro'
    arguments = ['preset:=mini', 'arm:=true', 'trunk_mass:=0.5']
    made = subprocess.run(
        ['xacro', str(model), *arguments], capture_output=True, text=True, check=True
    )
    ours = parse(robot_urdf('mini', arm=True, trunk_mass=0.5))
    theirs = parse(made.stdout)
    assert [(e.tag, e.attrib) for e in theirs.iter()] == [(e.tag, e.attrib) for e in ours.iter()]


def test_the_description_says_nothing_about_this_machine() -> None:
    """Nothing of the comment is left in which xacro names the path of the file."""
    urdf = robot_urdf('lite', arm=True)
    assert urdf.startswith('<robot ')
    assert 'autogenerated' not in urdf
    assert '.xacro' not in urdf


def test_the_command_prints_the_urdf(capsys: pytest.CaptureFixture[str]) -> None:
    """Its arguments are those of the API, and a wrong one ends with exit code 2."""
    assert run(['--preset', 'mini', '--arm', '--base-footprint']) == 0
    assert capsys.readouterr().out == robot_urdf('mini', arm=True) + '\n'
    assert run(['--trunk-mass', '0']) == 2
    assert 'trunk_mass' in capsys.readouterr().err


def test_ctrl_c_ends_a_program_without_a_traceback() -> None:
    """With the exit code that a shell expects."""

    def interrupted(_: Sequence[str]) -> int:
        raise KeyboardInterrupt

    with pytest.raises(SystemExit) as ended:
        run_command(interrupted)
    assert ended.value.code == 130


CONVERTED = """
import os, signal
from quad_description import run_command

def run(arguments):
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except KeyboardInterrupt as error:
        raise RuntimeError('what a library in C++ makes of it') from error

run_command(run)
"""


def test_ctrl_c_ends_a_program_whatever_a_library_makes_of_it() -> None:
    """MuJoCo raises an error of its own when it is interrupted while it starts."""
    command = [sys.executable, '-c', CONVERTED]
    done = subprocess.run(command, check=False, capture_output=True, timeout=60)
    assert (done.returncode, done.stderr) == (130, b'')

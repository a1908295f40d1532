# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The URDF against the dimensions and masses of the robot, and against physics."""

from __future__ import annotations

import math
from pathlib import Path
import subprocess
import sys
from xml.etree import ElementTree as ET

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
from numpy.typing import NDArray
import pytest
from urdf_reader import compose, link_poses, Transform

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
)
from quad_description.presets import run

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
SIDE = {'fl': 1, 'fr': -1, 'bl': 1, 'br': -1}
BUILDS = [(preset, arm) for preset in PRESETS for arm in (False, True)]
builds = pytest.mark.parametrize(('preset', 'arm'), BUILDS)

# roll axis, knee and pad of a left leg at zero [m], as the vendor's model has them
HIP_X = {'f': 0.04946, 'b': -0.10059}
ANGLE = st.floats(-1.0, 1.0)
MINI = quadruped(robot_urdf('mini'))


def parse(urdf: str) -> ET.Element:
    """Parse a URDF."""
    return ET.fromstring(urdf)  # noqa: S314


def rotation(axis: Array, angle: float) -> Array:
    """Rodrigues' formula."""
    x, y, z = axis
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Array = np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
    return turn


def mass(link: ET.Element) -> float:
    """Return a link's mass in [kg]."""
    element = link.find('inertial/mass')
    return 0.0 if element is None else float(element.attrib['value'])


def inertia(link: ET.Element) -> Array:
    """Return a link's inertia about its centre of mass in [kg m2], in its inertial frame."""
    values = link.find('inertial/inertia')
    assert values is not None
    rows = (('ixx', 'ixy', 'ixz'), ('ixy', 'iyy', 'iyz'), ('ixz', 'iyz', 'izz'))
    return np.array([[float(values.attrib[key]) for key in row] for row in rows])


@builds
def test_links_and_motors_are_those_that_others_name(preset: str, arm: bool) -> None:
    """One tree with base_link as root; motors leg by leg, then those of the arm and its gripper.

    Every pose names exactly the motors, in their order and within their limits.
    """
    tree = quadruped(robot_urdf(preset, arm)).tree
    expected = {f'{leg}_{part}' for leg in LEGS for part in ('hip', 'thigh', 'calf', 'foot')}
    expected |= {'base_link', 'imu_link', 'base_footprint'}
    expected |= {'arm_yaw', 'arm_thigh', 'arm_calf', 'hand_right', 'hand_left'} if arm else set()
    assert tree.root == 'base_link'
    assert sorted(tree.links) == sorted(expected)
    assert link_poses(tree, {}).keys() == expected
    joints = movable_joints(tree)
    motors = [f'{leg}_{joint}_joint' for leg in LEGS for joint in ('hip', 'thigh', 'calf')]
    extra = ['arm_yaw_joint', 'arm_thigh_joint', 'arm_calf_joint', 'hand_right_joint']
    assert [joint.name for joint in joints] == motors + (extra if arm else [])
    assert all(joint.limits.velocity > 0 and joint.limits.effort > 0 for joint in joints)
    for pose in Pose:
        positions = pose_positions(pose, arm)
        assert list(positions) == [joint.name for joint in joints]
        for joint in joints:
            assert joint.limits.lower <= positions[joint.name] <= joint.limits.upper


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
    side, x, poses = SIDE[leg], HIP_X[leg[0]], link_poses(MINI.tree, {})
    hip, knee, foot = (
        np.array(poses[f'{leg}_{part}'].translation) for part in ('hip', 'calf', 'foot')
    )
    assert hip == pytest.approx([x, side * 0.0225, -0.02207], abs=1e-9)
    assert knee == pytest.approx([x - 0.0186, side * 0.0721, -0.02207 - 0.0599], abs=1e-9)
    assert foot - knee == pytest.approx([0.0715, -side * 0.0186, -0.0226], abs=1e-9)


@pytest.mark.parametrize('leg', LEGS)
@given(hip=ANGLE, thigh=ANGLE, calf=ANGLE)
def test_legs_bend_as_the_conventions_say(leg: str, hip: float, thigh: float, calf: float) -> None:
    """The foot follows from roll about -+x and pitches about y, in the URDF and in closed form.

    A positive hip moves each foot inward.
    """
    names = [f'{leg}_{joint}_joint' for joint in ('hip', 'thigh', 'calf')]
    at = dict(zip(names, (hip, thigh, calf), strict=True))
    side, (x, y) = SIDE[leg], np.eye(3)[:2]
    shank = rotation(y, calf) @ np.array([0.0715, -side * 0.0186, -0.0226])
    below = rotation(y, thigh) @ (np.array([0, 0, -0.0599]) + shank)
    expected = rotation(-side * x, hip) @ (np.array([-0.0186, side * 0.0496, 0]) + below)
    expected += [HIP_X[leg[0]], side * 0.0225, -0.02207]
    foot = link_poses(MINI.tree, at)[f'{leg}_foot'].translation
    assert foot == pytest.approx(expected, abs=1e-9)
    feet = MINI.feet([at.get(name, 0.0) for name in MINI.names])
    assert feet[LEGS.index(leg)] == pytest.approx(expected, abs=1e-9)


def test_mass_and_centre_of_mass_are_the_vendors() -> None:
    """0.70 kg without and 0.749 kg with the arm, the centre 24 mm behind that of the hips."""
    with_arm = quadruped(robot_urdf('mini', arm=True))
    assert MINI.mass == pytest.approx(0.7006, abs=1e-6)
    assert with_arm.mass == pytest.approx(0.749, abs=3e-4)
    poses = link_poses(MINI.tree, pose_positions(Pose.STAND))
    places = (
        (each.mass, compose(poses[each.link], Transform(each.centre)).translation)
        for each in MINI.tree.masses()
    )
    centre = sum(kilograms * np.array(place) for kilograms, place in places) / MINI.mass
    assert centre == pytest.approx([-0.0496, 0, -0.028], abs=1e-3)


def test_standing_height_is_that_of_the_vendors_default_pose() -> None:
    """The base stands 125 to 130 mm above the ground, on feet that are balls."""
    standing = pose_positions(Pose.STAND)
    lowest = min(z for _, _, z in MINI.feet(list(standing.values())))
    assert MINI.foot_radius == pytest.approx(0.010)
    assert 0.125 <= 0.010 - lowest <= 0.130
    assert MINI.standing_height(list(standing.values())) == pytest.approx(0.010 - lowest)


def test_the_lite_keeps_what_its_servos_reach() -> None:
    """The lite's limits lie within the mini's and within its servos' range in degrees."""
    reach = {'hip': (-30, 30), 'thigh': (-70, 90), 'calf': (-70, 50)}
    joints = (movable_joints(robot_urdf(preset)) for preset in ('lite', 'mini'))
    for lite, mini in zip(*joints, strict=True):
        lowest, highest = map(math.radians, reach[lite.name.split('_')[1]])
        assert lite.limits.lower == pytest.approx(max(mini.limits.lower, lowest), abs=2e-3)
        assert lite.limits.upper == pytest.approx(min(mini.limits.upper, highest), abs=1e-3)


@pytest.mark.parametrize('kilograms', [0.05, 0.7, 5.0])
def test_a_heavier_trunk_changes_nothing_else(kilograms: float) -> None:
    """trunk_mass sets the trunk's mass, scales its inertia, and leaves the legs alone."""
    plain, loaded = (parse(robot_urdf('mini', trunk_mass=mass)) for mass in (None, kilograms))
    for one, other in zip(plain.iter('link'), loaded.iter('link'), strict=True):
        if one.get('name') == 'base_link':
            assert mass(other) == pytest.approx(kilograms)
            assert inertia(other) / mass(other) == pytest.approx(inertia(one) / mass(one))
        else:
            assert mass(one) == mass(other)


@pytest.mark.parametrize('kilograms', [0.0, -1.0, math.nan, math.inf, 50.0])
def test_a_trunk_or_preset_that_cannot_be_is_refused(kilograms: float) -> None:
    """The message names the value and the range, or all presets."""
    with pytest.raises(DescriptionError, match=r'kg is not 0\.05 to 5\.0 kg'):
        robot_urdf('mini', trunk_mass=kilograms)
    with pytest.raises(PresetError, match="'rider'; choose one of lite, mini"):
        robot_urdf('rider')


def test_the_xacro_file_takes_the_same_arguments() -> None:
    """What xacro makes of the file on the command line is what the API returns."""
    model = Path(__file__).parents[1] / 'quad_description' / 'model' / 'quadruped.urdf.xacro'
    command = ['xacro', str(model), 'preset:=mini', 'arm:=true', 'trunk_mass:=0.5']
    made = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    theirs, ours = parse(made), parse(robot_urdf('mini', arm=True, trunk_mass=0.5))
    assert [(e.tag, e.attrib) for e in theirs.iter()] == [(e.tag, e.attrib) for e in ours.iter()]


def test_the_command_prints_the_urdf(capsys: pytest.CaptureFixture[str]) -> None:
    """Its arguments are those of the API, and a wrong one ends with exit code 2.

    Nothing of the comment is left in which xacro names the path of the file.
    """
    assert run(['--preset', 'mini', '--arm', '--base-footprint']) == 0
    urdf = capsys.readouterr().out
    assert urdf == robot_urdf('mini', arm=True) + '\n'
    assert urdf.startswith('<robot ')
    assert '.xacro' not in urdf
    assert run(['--trunk-mass', '0']) == 2
    assert 'trunk_mass' in capsys.readouterr().err


INTERRUPTED = """
import os, signal
from quad_description import run_command

def run(arguments):
    try:
        os.kill(os.getpid(), signal.SIGINT)
    except KeyboardInterrupt as error:
        if arguments:
            raise RuntimeError('what a library in C++ makes of it') from error
        raise

run_command(run)
"""


@pytest.mark.parametrize('arguments', [[], ['converted']])
def test_ctrl_c_ends_a_program_without_a_traceback(arguments: list[str]) -> None:
    """MuJoCo raises an error of its own when it is interrupted while it starts."""
    command = [sys.executable, '-c', INTERRUPTED, *arguments]
    done = subprocess.run(command, check=False, capture_output=True, timeout=60)
    assert (done.returncode, done.stderr) == (130, b'')

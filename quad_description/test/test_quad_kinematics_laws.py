# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the legs' kinematics, on robots of several shapes."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from urdf_reader import link_poses

from quad_builds import Build, urdf
from quad_description import DescriptionError, foot_position, jacobian, LEGS, quadruped, solve
from quad_description.kinematics import calf_rotation
from quad_description.rotations import conjugate, multiply, rotation_vector

pytestmark = pytest.mark.slow

BUILDS = {
    'xgo': Build(),
    'positive hips': Build(hip_sign=1),
    'reversed pitch axes': Build(pitch_axis='0 -1 0', calf_range=(-1.047, 1.134)),
    'knees forward': Build(calf=(-0.0715, -0.0226), calf_range=(-1.047, 1.134)),
    'thigh axis below the hip': Build(offset=(0.01, 0.03, -0.012), foot_inward=-0.004),
}
ROBOTS = {name: quadruped(urdf(build)) for name, build in BUILDS.items()}

robots = pytest.mark.parametrize('name', ROBOTS)
legs = st.integers(0, 3)
fractions = st.tuples(*[st.floats(0.0, 1.0)] * 3)


def pose(name: str, index: int, fraction: tuple[float, ...]) -> tuple[float, float, float]:
    """Return joint positions within the limits of a leg."""
    limits = ROBOTS[name].legs[index].limits
    a, b, c = (
        one.lower + part * (one.upper - one.lower)
        for one, part in zip(limits, fraction, strict=True)
    )
    return a, b, c


@robots
@given(index=legs, fraction=fractions)
def test_closed_form_agrees_with_the_tree(
    name: str, index: int, fraction: tuple[float, ...]
) -> None:
    """The foot is where walking through the URDF finds it."""
    robot = ROBOTS[name]
    angles = pose(name, index, fraction)
    named = dict(zip(robot.legs[index].joints, angles, strict=True))
    link = f'{LEGS[index]}_foot'
    expected = link_poses(robot.tree, named)[link]
    assert foot_position(robot.legs[index], angles) == pytest.approx(
        expected.translation, abs=1e-12
    )
    zero = link_poses(robot.tree, {})[link].rotation
    turned = calf_rotation(robot.legs[index], angles)
    off = rotation_vector(multiply(conjugate(expected.rotation), multiply(turned, zero)))
    assert off == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


@robots
@given(index=legs, fraction=fractions)
def test_inverse_brings_the_foot_back(name: str, index: int, fraction: tuple[float, ...]) -> None:
    """Every reachable foot is reached to a nanometre, whatever branch the pose was on."""
    leg = ROBOTS[name].legs[index]
    foot = foot_position(leg, pose(name, index, fraction))
    solution = solve(leg, foot)
    if solution.reachable:
        assert math.dist(foot_position(leg, solution.angles), foot) < 1e-9


@robots
@given(index=legs, fraction=fractions)
def test_poses_below_the_body_are_recovered(
    name: str, index: int, fraction: tuple[float, ...]
) -> None:
    """A pose with the knee on its side and the foot below the hip is found again."""
    leg = ROBOTS[name].legs[index]
    angles = pose(name, index, fraction)
    foot = foot_position(leg, angles)
    roll = leg.signs[0] * angles[0]
    knee = leg.signs[2] * angles[2] + leg.calf_pitch - leg.thigh_pitch
    hip_y, hip_z = foot[1] - leg.hip[1], foot[2] - leg.hip[2]
    depth = -hip_y * math.sin(roll) + hip_z * math.cos(roll)
    if knee * leg.knee_sign > 1e-3 and depth < -1e-3:
        solution = solve(leg, foot)
        assert solution.angles == pytest.approx(angles, abs=1e-6)
        assert solution.reachable or min(
            abs(angle - edge)
            for angle, limits in zip(angles, leg.limits, strict=True)
            for edge in (limits.lower, limits.upper)
        ) < 1e-9  # fmt: skip


@robots
@given(index=legs, foot=st.tuples(*[st.floats(-0.4, 0.4)] * 3))
def test_any_target_gives_angles_within_limits(
    name: str, index: int, foot: tuple[float, float, float]
) -> None:
    """No target gives NaN or breaks a limit, and only those that are reached are called so."""
    leg = ROBOTS[name].legs[index]
    solution = solve(leg, foot)
    for angle, limits in zip(solution.angles, leg.limits, strict=True):
        assert limits.lower <= angle <= limits.upper
    reached = math.dist(foot_position(leg, solution.angles), foot) < 1e-9
    assert reached or not solution.reachable


@robots
@given(index=legs, fraction=fractions)
def test_jacobian_is_the_derivative(name: str, index: int, fraction: tuple[float, ...]) -> None:
    """The Jacobian agrees with central differences."""
    leg = ROBOTS[name].legs[index]
    angles = pose(name, index, fraction)
    step = 1e-6
    for joint, column in enumerate(jacobian(leg, angles)):
        ends = []
        for sign in (-1, 1):
            moved = list(angles)
            moved[joint] += sign * step
            ends.append(foot_position(leg, (moved[0], moved[1], moved[2])))
        difference = (np.array(ends[1]) - ends[0]) / (2 * step)
        assert column == pytest.approx(difference, abs=1e-8)


def test_footprint_is_under_the_centre_of_mass() -> None:
    """The stance puts the middle of the feet under the centre of mass."""
    robot = ROBOTS['xgo']
    feet = robot.footprint(0.085, [0.0] * 12)
    middle = sum(foot[0] for foot in feet) / 4
    assert middle < robot.hip_centre[0]
    assert all(solution.reachable for solution in robot.solve(feet))


def test_a_height_out_of_reach_is_refused() -> None:
    """Legs that do not reach the ground are noticed before anything moves."""
    with pytest.raises(DescriptionError, match='do not reach'):
        ROBOTS['xgo'].footprint(0.2, [0.0] * 12)


@pytest.mark.parametrize(
    ('text', 'replacement', 'reason'),
    [
        ('link="fl_foot"', 'link="fl_toe"', 'fl_foot'),
        ('axis xyz="-1 0 0"', 'axis xyz="0 0 1"', 'turns about'),
        ('axis xyz="-1 0 0"', 'axis xyz="0 0 0"', 'no direction'),
        ('velocity="10"', '', 'needs <limit .../> with velocity'),
        ('parent link="base_link"', 'parent link="fl_calf"', 'loop'),
        ('lower="-0.6"', 'lower="nan"', 'finite'),
        ('<robot', '<model', 'no XML'),
        ('type="revolute"', 'type="turning"', 'is none of fixed'),
        ('link="fl_hip"', '', 'it needs'),
    ],
)
def test_unsuited_descriptions_are_refused(text: str, replacement: str, reason: str) -> None:
    """A description that cannot be walked with is refused with its reason."""
    with pytest.raises(DescriptionError, match=reason):
        quadruped(urdf().replace(text, replacement))


def test_order_of_joints_is_that_of_the_description() -> None:
    """An arm's joint stays in its place among the commanded joints and is in no leg."""
    robot = quadruped(urdf(Build(arm=True)))
    assert robot.names[:3] == robot.legs[0].joints
    assert robot.others == (12,)


def test_joints_may_have_any_names() -> None:
    """A leg is what leads from the body to its foot."""
    robot = quadruped(urdf().replace('fl_calf_joint', 'left_front_knee'))
    assert robot.legs[0].joints[2] == 'left_front_knee'


def test_links_may_be_named_as_others_do() -> None:
    """The body is the root, and feet are found in the order of the legs."""
    ours, theirs = quadruped(urdf()), urdf().replace('base_link', 'base')
    for leg, name in zip(('fl', 'fr', 'bl', 'br'), ('FL', 'FR', 'RL', 'RR'), strict=True):
        theirs = theirs.replace(f'{leg}_foot', f'{name}_foot')
    robot = quadruped(theirs)
    assert robot.feet([0.1] * 12) == ours.feet([0.1] * 12)
    assert robot.foot_radius == ours.foot_radius

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The Panda's and the PRBT's description against the numbers of the arms, and broken ones."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as ET

from model_robots import forward, numbers, transform
import pytest

from arm_bringup.robots import DescriptionError, expand_xacro, joint_limits

FILE = Path(__file__).parents[1] / 'robots' / 'prbt' / 'prbt.urdf.xacro'
HALF_PI = math.pi / 2

# upper limit [rad] and effort [Nm] of joint 1 to 6; all are symmetrical and turn at 1.57 rad/s
LIMITS = [
    (2.96706, 370.0),
    (2.53073, 370.0),
    (2.35620, 176.0),
    (2.96706, 176.0),
    (2.96706, 41.6),
    (3.12414, 20.1),
]


def prbt(**arguments: str) -> str:
    """Expand the PRBT's xacro."""
    return expand_xacro(FILE, arguments)


def test_the_limits_are_those_of_the_arm() -> None:
    """Range, velocity and effort of each joint, in their order."""
    limits = joint_limits(prbt())
    assert list(limits) == [f'prbt_joint_{number}' for number in range(1, 7)]
    for joint, (upper, _) in zip(limits.values(), LIMITS, strict=True):
        assert (joint.lower, joint.upper, joint.velocity) == (-upper, upper, 1.57)
    efforts = [float(limit.attrib['effort']) for limit in ET.fromstring(prbt()).iter('limit')]  # noqa: S314
    assert efforts == [effort for _, effort in LIMITS]


@pytest.mark.parametrize(
    ('positions', 'xyz'),
    [
        ((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0014)),
        ((0.0, 0.0, HALF_PI, 0.0, HALF_PI, 0.0), (-0.307, 0.0, 0.5264)),
    ],
    ids=['straight', 'ready'],
)
def test_the_flange_of_the_prbt_is_where_the_arm_has_it(
    positions: tuple[float, ...], xyz: tuple[float, float, float]
) -> None:
    """Forward kinematics of the description meets the check poses."""
    angles = {f'prbt_joint_{number}': angle for number, angle in enumerate(positions, start=1)}
    flange = forward(ET.fromstring(prbt()), angles, 'prbt_flange')  # noqa: S314
    assert flange[:3, 3] == pytest.approx(xyz, abs=1e-4)


def test_links_have_their_masses_and_shapes() -> None:
    """19.5 kg in all, about the masses' own centres, and every shape is drawn and collides."""
    root = ET.fromstring(prbt())  # noqa: S314
    masses = [float(mass.attrib['value']) for mass in root.iter('mass')]
    assert sum(masses) == pytest.approx(19.52)
    for link in root.iter('link'):
        assert len(link.findall('visual')) == len(link.findall('collision'))


def test_the_prefix_is_an_argument() -> None:
    """For two arms in one description."""
    root = ET.fromstring(prbt(prefix='left_'))  # noqa: S314
    names = [element.get('name', '') for tag in ('link', 'joint') for element in root.iter(tag)]
    assert all(name.startswith('left_') for name in names)


ROBOTS = Path(__file__).parents[1] / 'robots'

# name, xyz [m], rpy [rad], lower, upper [rad], velocity [rad/s], effort [Nm]: data sheet and
# modified Denavit-Hartenberg table of the Franka Emika Panda
Row = tuple[str, tuple[float, float, float], float, float, float, float, float]

JOINTS: list[Row] = [
    ('panda_joint1', (0, 0, 0.333), 0, -2.8973, 2.8973, 2.175, 87),
    ('panda_joint2', (0, 0, 0), -HALF_PI, -1.7628, 1.7628, 2.175, 87),
    ('panda_joint3', (0, -0.316, 0), HALF_PI, -2.8973, 2.8973, 2.175, 87),
    ('panda_joint4', (0.0825, 0, 0), HALF_PI, -3.0718, -0.0698, 2.175, 87),
    ('panda_joint5', (-0.0825, 0.384, 0), -HALF_PI, -2.8973, 2.8973, 2.61, 12),
    ('panda_joint6', (0, 0, 0), HALF_PI, -0.0175, 3.7525, 2.61, 12),
    ('panda_joint7', (0.088, 0, 0), HALF_PI, -2.8973, 2.8973, 2.61, 12),
]


READY = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]  # [rad]


def at(positions: list[float]) -> dict[str, float]:
    """Name the positions of the joints."""
    return dict(zip([name for name, *_ in JOINTS], positions, strict=True))


def panda(**arguments: str) -> ET.Element:
    """Expand the Panda's xacro."""
    urdf = expand_xacro(ROBOTS / 'panda' / 'panda.urdf.xacro', arguments)
    return ET.fromstring(urdf)  # noqa: S314


@pytest.mark.slow
@pytest.mark.parametrize('row', JOINTS, ids=[row[0] for row in JOINTS])
def test_a_joint_is_where_the_arm_has_it(row: Row) -> None:
    """Origin, axis and limits of each joint are those of the table."""
    name, xyz, roll, *values = row
    joint = panda().find(f"joint[@name='{name}']")
    assert joint is not None
    assert joint.get('type') == 'revolute'
    origin = joint.find('origin')
    assert numbers(origin, 'xyz') == pytest.approx(xyz)
    assert numbers(origin, 'rpy') == pytest.approx((roll, 0, 0))
    assert numbers(joint.find('axis'), 'xyz') == [0, 0, 1]
    limit = joint.find('limit')
    assert limit is not None
    keys = ('lower', 'upper', 'velocity', 'effort')
    assert [float(limit.attrib[key]) for key in keys] == values


@pytest.mark.slow
@pytest.mark.parametrize(
    ('positions', 'xyz'),
    [
        ([0.0] * 7, (0.088, 0.0, 0.926)),
        (READY, (0.3070, 0.0, 0.5903)),
    ],
    ids=['zero', 'ready'],
)
def test_the_flange_is_where_the_arm_has_it(
    positions: list[float], xyz: tuple[float, float, float]
) -> None:
    """Forward kinematics of the description meets the check poses."""
    flange = forward(panda(), at(positions), 'panda_link8')
    assert flange[:3, 3] == pytest.approx(xyz, abs=1e-4)
    assert flange[2, 2] == pytest.approx(-1.0, abs=1e-3)  # it points down


@pytest.mark.slow
def test_the_tool_centre_point_is_between_the_finger_tips() -> None:
    """The hand hangs turned by 45 degrees below the flange."""
    tcp = forward(panda(), at(READY), 'panda_hand_tcp')
    assert tcp[2, 3] == pytest.approx(0.4869, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ('arguments', 'there', 'gone'),
    [
        ({}, 'panda_hand', 'panda_leftfinger'),
        ({'hand': 'false'}, 'panda_link8', 'panda_hand'),
        ({'fingers': 'true'}, 'panda_rightfinger', 'panda_none'),
    ],
    ids=['default', 'bare', 'fingers'],
)
def test_hand_and_fingers_are_arguments(arguments: dict[str, str], there: str, gone: str) -> None:
    """The fingers are left out by default: no drive of the bus moves them."""
    links = {link.get('name') for link in panda(**arguments).iter('link')}
    assert there in links
    assert gone not in links


@pytest.mark.slow
def test_fingers_without_a_hand_are_refused() -> None:
    """With a sentence, not with a URDF of two roots."""
    with pytest.raises(DescriptionError, match='hand:=true'):
        panda(hand='false', fingers='true')


@pytest.mark.slow
def test_the_description_is_one_tree_with_plausible_masses() -> None:
    """One root; every link with mass has a positive inertia that fulfils the triangle rule."""
    root = panda(fingers='true')
    children = {joint.find('child').get('link') for joint in root.iter('joint')}  # type: ignore[union-attr]
    links = [link.get('name') for link in root.iter('link')]
    assert [name for name in links if name not in children] == ['panda_link0']
    total = 0.0
    for inertial in root.iter('inertial'):
        mass, inertia = inertial.find('mass'), inertial.find('inertia')
        assert mass is not None
        assert inertia is not None
        total += float(mass.attrib['value'])
        moments = sorted(float(inertia.attrib[key]) for key in ('ixx', 'iyy', 'izz'))
        assert moments[0] > 0
        assert moments[0] + moments[1] >= moments[2]
    assert 15 < total < 20  # the data sheet says about 18 kg


@pytest.mark.slow
def test_a_capsule_is_a_cylinder_between_two_spheres() -> None:
    """Of each collision capsule, the ends of the cylinder are the centres of the spheres."""
    for link in panda(fingers='true').iter('link'):
        parts = link.findall('collision')
        for cylinder, *spheres in zip(parts[::3], parts[1::3], parts[2::3], strict=True):
            shape = cylinder.find('geometry/cylinder')
            origin = cylinder.find('origin')
            assert shape is not None
            pose = transform(numbers(origin, 'xyz'), numbers(origin, 'rpy'))
            half = float(shape.attrib['length']) / 2
            for sphere, end in zip(spheres, (-half, half), strict=True):
                centre = numbers(sphere.find('origin'), 'xyz')
                assert pose @ [0, 0, end, 1] == pytest.approx([*centre, 1], abs=1e-9)
                ball = sphere.find('geometry/sphere')
                assert ball is not None
                assert ball.get('radius') == shape.get('radius')


@pytest.mark.slow
def test_the_limits_are_read_in_the_order_of_the_joints() -> None:
    """Fixed joints and joints that mimic others are left out."""
    urdf = ET.tostring(panda(fingers='true'), encoding='unicode')
    limits = joint_limits(urdf)
    assert list(limits) == [*(name for name, *_ in JOINTS), 'panda_finger_joint1']
    assert (limits['panda_joint4'].lower, limits['panda_joint4'].upper) == (-3.0718, -0.0698)
    assert limits['panda_joint5'].velocity == 2.61


def one_joint(kind: str, limit: str = '') -> str:
    """Return a URDF of two links and a joint."""
    return (
        '<robot><link name="x"/><link name="y"/>'
        f'<joint name="a" type="{kind}"><parent link="x"/><child link="y"/>{limit}</joint></robot>'
    )


@pytest.mark.slow
def test_a_continuous_joint_has_no_range() -> None:
    """Its lower and upper limits are infinite."""
    assert joint_limits(one_joint('continuous', '<limit velocity="1"/>'))['a'].lower == -math.inf


@pytest.mark.slow
@pytest.mark.parametrize(
    ('urdf', 'words'),
    [
        ('<robot>', 'no XML'),
        (one_joint('revolute'), 'joint a'),
        (one_joint('revolute', '<limit/>'), 'velocity'),
        (one_joint('revolute', '<limit velocity="fast"/>'), 'fast'),
    ],
    ids=['xml', 'no limit', 'no velocity', 'no number'],
)
def test_a_description_that_is_not_usable_says_why(urdf: str, words: str) -> None:
    """The message names the joint and the value."""
    with pytest.raises(DescriptionError, match=words):
        joint_limits(urdf)


@pytest.mark.slow
def test_a_broken_xacro_says_which_file_and_what(tmp_path: Path) -> None:
    """The message has the file and xacro's own words."""
    file = tmp_path / 'arm.urdf.xacro'
    file.write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><a b="${nothing}"/></robot>'
    )
    with pytest.raises(DescriptionError, match=r'arm\.urdf\.xacro.*nothing'):
        expand_xacro(file)

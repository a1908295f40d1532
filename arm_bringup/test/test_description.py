# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The Panda's and the PRBT's description against the numbers of the arms, and broken ones."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from arm_bringup.robots import DescriptionError, expand_xacro, joint_limits


def described(name: str, **arguments: str) -> ET.Element:
    """Expand the xacro of a robot."""
    file = Path(__file__).parents[1] / 'robots' / name / f'{name}.urdf.xacro'
    return ET.fromstring(expand_xacro(file, arguments))  # noqa: S314


def numbers(element: ET.Element | None, key: str) -> list[float]:
    """Return three numbers of an attribute, zero where there are none."""
    text = element.get(key, '0 0 0') if element is not None else '0 0 0'
    return [float(word) for word in text.split()]


def attributes(element: ET.Element | None, *keys: str) -> list[float]:
    """Return numbers of an element."""
    assert element is not None
    return [float(element.attrib[key]) for key in keys]


def test_the_limits_of_the_prbt_are_those_of_the_arm() -> None:
    """Range, velocity and effort of each joint, in their order; 19.5 kg in all.

    Every shape is drawn and collides; a prefix is for two arms in one description.
    """
    root = described('prbt', prefix='left_')
    limits = joint_limits(ET.tostring(root, encoding='unicode'))
    assert list(limits) == [f'left_joint_{number}' for number in range(1, 7)]
    uppers = [2.96706, 2.53073, 2.35620, 2.96706, 2.96706, 3.12414]  # [rad]
    for joint, upper in zip(limits.values(), uppers, strict=True):
        assert (joint.lower, joint.upper, joint.velocity) == (-upper, upper, 1.57)
    efforts = [float(limit.attrib['effort']) for limit in root.iter('limit')]
    assert efforts == [370.0, 370.0, 176.0, 176.0, 41.6, 20.1]  # [Nm]
    assert sum(float(mass.attrib['value']) for mass in root.iter('mass')) == pytest.approx(19.52)
    for link in root.iter('link'):
        assert len(link.findall('visual')) == len(link.findall('collision'))
    names = [element.get('name', '') for tag in ('link', 'joint') for element in root.iter(tag)]
    assert all(name.startswith('left_') for name in names)


# name, xyz [m], rpy [rad], lower, upper [rad], velocity [rad/s], effort [Nm]: data sheet and
# modified Denavit-Hartenberg table of the Franka Emika Panda

HALF_PI = math.pi / 2
JOINTS: list[tuple[str, tuple[float, float, float], float, float, float, float, float]] = [
    ('panda_joint1', (0, 0, 0.333), 0, -2.8973, 2.8973, 2.175, 87),
    ('panda_joint2', (0, 0, 0), -HALF_PI, -1.7628, 1.7628, 2.175, 87),
    ('panda_joint3', (0, -0.316, 0), HALF_PI, -2.8973, 2.8973, 2.175, 87),
    ('panda_joint4', (0.0825, 0, 0), HALF_PI, -3.0718, -0.0698, 2.175, 87),
    ('panda_joint5', (-0.0825, 0.384, 0), -HALF_PI, -2.8973, 2.8973, 2.61, 12),
    ('panda_joint6', (0, 0, 0), HALF_PI, -0.0175, 3.7525, 2.61, 12),
    ('panda_joint7', (0.088, 0, 0), HALF_PI, -2.8973, 2.8973, 2.61, 12),
]


@pytest.mark.slow
def test_joints_of_the_panda_are_where_the_arm_has_them() -> None:
    """Origin, axis and limits of each joint are those of the table.

    Limits are read in the order of the joints; fixed ones and those that mimic are left out.
    """
    root = described('panda', fingers='true')
    for name, xyz, roll, *values in JOINTS:
        joint = root.find(f"joint[@name='{name}']")
        assert joint is not None, name
        assert joint.get('type') == 'revolute', name
        origin = joint.find('origin')
        assert numbers(origin, 'xyz') == pytest.approx(xyz), name
        assert numbers(origin, 'rpy') == pytest.approx((roll, 0, 0)), name
        assert numbers(joint.find('axis'), 'xyz') == [0, 0, 1], name
        found = attributes(joint.find('limit'), 'lower', 'upper', 'velocity', 'effort')
        assert found == values, name
    limits = joint_limits(ET.tostring(root, encoding='unicode'))
    assert list(limits) == [*(name for name, *_ in JOINTS), 'panda_finger_joint1']
    assert (limits['panda_joint4'].lower, limits['panda_joint4'].upper) == (-3.0718, -0.0698)
    assert limits['panda_joint5'].velocity == 2.61


@pytest.mark.slow
def test_hand_and_fingers_are_arguments() -> None:
    """The fingers are left out by default: no drive of the bus moves them."""
    for arguments, there, gone in (
        ({}, 'panda_hand', 'panda_leftfinger'),
        ({'hand': 'false'}, 'panda_link8', 'panda_hand'),
        ({'fingers': 'true'}, 'panda_rightfinger', 'panda_none'),
    ):
        links = {link.get('name') for link in described('panda', **arguments).iter('link')}
        assert there in links
        assert gone not in links
    with pytest.raises(DescriptionError, match='hand:=true'):  # not a URDF of two roots
        described('panda', hand='false', fingers='true')


@pytest.mark.slow
def test_the_panda_is_one_tree_with_plausible_masses() -> None:
    """One root; every link with mass has a positive inertia that fulfils the triangle rule."""
    root = described('panda', fingers='true')
    children = {joint.find('child').get('link') for joint in root.iter('joint')}  # type: ignore[union-attr]
    links = [link.get('name') for link in root.iter('link')]
    assert [name for name in links if name not in children] == ['panda_link0']
    total = 0.0
    for inertial in root.iter('inertial'):
        total += attributes(inertial.find('mass'), 'value')[0]
        least, middle, most = sorted(attributes(inertial.find('inertia'), 'ixx', 'iyy', 'izz'))
        assert least > 0
        assert least + middle >= most
    assert 15 < total < 20  # the data sheet says about 18 kg


def one_joint(kind: str, limit: str = '') -> str:
    """Return a URDF of two links and a joint."""
    return (
        '<robot><link name="x"/><link name="y"/>'
        f'<joint name="a" type="{kind}"><parent link="x"/><child link="y"/>{limit}</joint></robot>'
    )


@pytest.mark.slow
def test_a_description_that_is_not_usable_says_why(tmp_path: Path) -> None:
    """The message names the joint and the value, or the file and xacro's own words."""
    continuous = one_joint('continuous', '<limit velocity="1"/>')
    assert joint_limits(continuous)['a'].lower == -math.inf
    for urdf, words in (
        ('<robot>', 'no XML'),
        (one_joint('revolute'), 'joint a'),
        (one_joint('revolute', '<limit/>'), 'velocity'),
        (one_joint('revolute', '<limit velocity="fast"/>'), 'fast'),
    ):
        with pytest.raises(DescriptionError, match=words):
            joint_limits(urdf)
    file = tmp_path / 'arm.urdf.xacro'
    file.write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><a b="${nothing}"/></robot>'
    )
    with pytest.raises(DescriptionError, match=r'arm\.urdf\.xacro.*nothing'):
        expand_xacro(file)

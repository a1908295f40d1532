# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The PRBT's description against the numbers of the arm."""

from __future__ import annotations

import math
from pathlib import Path
from xml.etree import ElementTree as ET

from model_robots import forward
import pytest

from arm_bringup.robots import expand_xacro, joint_limits

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
def test_the_flange_is_where_the_arm_has_it(
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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robots of arm_bringup for the benchmarks, as they are installed."""

from __future__ import annotations

from functools import cache
import re

import numpy as np
import pinocchio as pin

from arm_bringup.robots import expand_xacro, installed_robots_folder
from arm_model import Array, frozen, load_limits, RobotModel

ROBOTS = ('panda', 'prbt', 'gp110')

SPEED = frozen([0.1] * 3 + [0.3] * 3)  # speed of a command along each axis in [m/s] and [rad/s]

TWISTS = [sign * SPEED * axis for axis in np.eye(6) for sign in (1.0, -1.0)]
"""Commands along each axis, both ways."""


@cache
def texts(name: str) -> tuple[str, str]:
    """Return URDF and SRDF of a robot."""
    folder = installed_robots_folder() / name
    urdf = expand_xacro(folder / f'{name}.urdf.xacro')
    return urdf, (folder / f'{name}.srdf').read_text(encoding='utf-8')


@cache
def robot(name: str) -> RobotModel:
    """Build the main group of an installed robot folder, once for all."""
    return RobotModel(*texts(name), load_limits(installed_robots_folder() / name / 'limits.yaml'))


def two_pandas() -> list[RobotModel]:
    """Return two Pandas of one robot side by side, 0.8 m apart, which move by themselves."""
    table = load_limits(installed_robots_folder() / 'panda' / 'limits.yaml')
    descriptions, semantics, limits = [], [], dict[str, dict[str, float]]()
    for side, place in (('left', 0.4), ('right', -0.4)):
        urdf, srdf = (
            re.sub(r'"panda_', f'"{side}_', text.partition('<robot ')[2].partition('>')[2])
            .removesuffix('\n')
            .removesuffix('</robot>')
            for text in texts('panda')
        )
        descriptions.append(
            f'{urdf}<joint name="{side}_base" type="fixed"><origin xyz="0 {place} 0"/>'
            f'<parent link="base"/><child link="{side}_link0"/></joint>'
        )
        semantics.append(srdf)
        limits |= {name.replace('panda_', f'{side}_'): entry for name, entry in table.items()}
    whole = f'<robot name="two"><link name="base"/>{"".join(descriptions)}</robot>'
    groups = f'<robot name="two">{"".join(semantics)}</robot>'
    joints = {side: [f'{side}_joint{n}' for n in range(1, 8)] for side in ('left', 'right')}
    return [
        RobotModel(whole, groups, limits, f'{side}_arm', moved_by_others={other: joints[other]})
        for side, other in (('left', 'right'), ('right', 'left'))
    ]


def ready(name: str) -> Array:
    """Return the pose of a robot from which it can move in every direction."""
    return robot(name).poses['ready']


def moved(model: RobotModel, start: Array, end: Array) -> Array:
    """Return the twist of the tip from one place to another in unit time (6)."""
    before, after = model.pose(start), model.pose(end)
    angular = pin.log3(after.rotation @ before.rotation.T)
    return np.concatenate((after.position - before.position, angular))

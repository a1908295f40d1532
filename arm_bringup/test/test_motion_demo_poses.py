# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo chooses poses and ways on arms that it does not know."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from arm_bringup.demos.motion.poses import (
    choose_start,
    free_end,
    free_way,
    is_free,
    MAX_RUN_UP,
    SIDE,
    SIDES,
    SPEED,
    square_fits,
    square_speed,
)
from arm_bringup.description import expand_xacro
from arm_model import load_limits, RobotModel, start_pose

pytestmark = pytest.mark.slow

ROBOTS = Path(__file__).parents[1] / 'robots'


def model(name: str, before: str = '', after: str = '') -> RobotModel:
    """Return a robot of this package, with something else in its SRDF."""
    folder = ROBOTS / name
    semantic = (folder / f'{name}.srdf').read_text()
    assert before in semantic
    semantic = semantic.replace(before, after)
    urdf = expand_xacro(folder / f'{name}.urdf.xacro')
    return RobotModel(urdf, semantic, load_limits(folder / 'limits.yaml'))


@pytest.mark.parametrize('name', ['panda', 'prbt', 'gp110'])
def test_our_arms_start_where_their_files_say(name: str) -> None:
    """The squares are possible there."""
    arm = model(name)
    assert square_fits(arm, start_pose(arm))
    assert choose_start(arm).tolist() == start_pose(arm).tolist()


def test_a_slow_arm_reaches_the_speed_of_its_square_early() -> None:
    """With the default acceleration of 1 rad/s2, as without any in MoveIt's file."""
    quick = model('panda')
    assert square_speed(quick, start_pose(quick)) == SPEED
    table = load_limits(ROBOTS / 'panda' / 'limits.yaml')
    slow = {
        name: {key: limit[key] for key in ('has_velocity_limits', 'max_velocity')}
        for name, limit in table.items()
    }
    arm = RobotModel(
        expand_xacro(ROBOTS / 'panda' / 'panda.urdf.xacro'),
        (ROBOTS / 'panda' / 'panda.srdf').read_text(),
        slow,
    )
    start = start_pose(arm)
    speed = square_speed(arm, start)
    assert 0.05 < speed < SPEED
    jacobian, limits = arm.jacobian(start), arm.limits
    shares = []
    for side in SIDES:
        twist = np.array([*side, 0.0, 0.0, 0.0]) * speed
        joints = np.abs(np.linalg.lstsq(jacobian * limits.velocity, twist, rcond=1e-3)[0])
        run_up = limits.velocity * joints / limits.acceleration + limits.acceleration / limits.jerk
        shares.append(run_up.max() / (SIDE / speed))
    assert max(shares) <= MAX_RUN_UP + 1e-9
    assert max(shares) > 0.5 * MAX_RUN_UP


def test_at_the_border_of_its_reach_an_arm_starts_elsewhere() -> None:
    """Nearly straight, the tool cannot go outwards; a pose is found from which it can."""
    arm = model('gp110', 'name="joint_3_u" value="0"', 'name="joint_3_u" value="1.4"')
    first = start_pose(arm)
    assert not square_fits(arm, first)
    chosen = choose_start(arm)
    assert square_fits(arm, chosen)
    assert arm.clearance(chosen) > 0.0


def test_trajectories_lead_around_links() -> None:
    """Where the straight way is barred, by another pose."""
    arm = model('panda')
    rng = np.random.default_rng(3)
    start = start_pose(arm)
    assert is_free(arm, start, free_end(arm, start))
    for _ in range(400):
        begin, end = rng.uniform(arm.limits.lower, arm.limits.upper, (2, len(arm)))
        if min(arm.clearance(begin), arm.clearance(end)) < 0.01 or is_free(arm, begin, end):
            continue
        way = [begin, *free_way(arm, begin, end)]
        if len(way) == 3:
            assert is_free(arm, way[0], way[1])
            assert is_free(arm, way[1], way[2])
            return
    pytest.fail('no way was found around links')

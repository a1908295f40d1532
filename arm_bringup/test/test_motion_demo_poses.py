# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo chooses poses and ways on arms that it does not know."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from arm_bringup.demos.motion.poses import (
    can_go,
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
from arm_bringup.demos.motion.samples import Sample
from arm_bringup.demos.motion.sequence import MotionSequence, straight_ahead
from arm_bringup.description import expand_xacro
from arm_model import load_limits, RobotModel, start_pose

pytestmark = pytest.mark.slow

TWO_JOINTS = """<robot name="two">
  <link name="base"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="upper_arm"/>
    <origin xyz="0 0 0.2"/> <axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="1.5" velocity="1.0" effort="50"/>
  </joint>
  <link name="upper_arm"/>
  <joint name="elbow" type="revolute">
    <parent link="upper_arm"/> <child link="forearm"/>
    <origin xyz="0 0 0.4"/> <axis xyz="0 1 0"/>
    <limit lower="-2.0" upper="2.0" velocity="1.0" effort="30"/>
  </joint>
  <link name="forearm"/>
</robot>"""
SEMANTIC = """<robot name="two">
  <group name="arm"><chain base_link="base" tip_link="forearm"/></group>
</robot>"""
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


def test_an_arm_of_two_joints_has_no_way_outwards() -> None:
    """It cannot lead its tool along a line, so that the demo leaves the way out and back out."""
    arm = RobotModel(TWO_JOINTS, SEMANTIC, {'shoulder': {}, 'elbow': {}})
    start, still = np.array([0.4, 0.8]), np.zeros(2)
    tool = arm.pose(start, arm.tip).position
    client = SimpleNamespace(last=Sample(0.0, start, still, still, start, 1.0, tool, tool))
    sequence = MotionSequence(client, arm, start, 0.01, lambda _: None, lambda: None)  # type: ignore[arg-type]
    sequence.singularity()
    assert 'left out: this arm cannot lead its tool' in sequence.results.lines()[0]
    assert sequence.results.problems == []
    for name in ('panda', 'prbt', 'gp110'):
        arm = model(name)
        start = choose_start(arm)
        assert can_go(arm, start, straight_ahead(arm.pose(start, arm.tip).position))


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

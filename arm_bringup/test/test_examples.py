# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demos of an arm compute: the path of the wave, measures of a motion, cells of parts.

tests/test_demo.py runs them.
"""

from __future__ import annotations

import argparse
import io
from itertools import pairwise
import math
from types import SimpleNamespace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
from rich.console import Console
from urdf_reader import JointRange

from arm_bringup.examples.arm import ArmDemo
from arm_bringup.examples.wave import Axis, MAX_VELOCITY
from arm_bringup.robots import WaveError
from arm_bringup.session import locate

pytestmark = pytest.mark.slow

PERIOD = 0.04  # [s] between targets

limits = st.builds(
    lambda lower, width, velocity: JointRange('elbow', lower, lower + width, velocity),
    st.floats(-7, 7),
    st.floats(0.01, 12),
    st.floats(0.05, 8),
)


@given(limits, st.floats(-1, 1))
def test_a_joint_moves_from_where_it_stands_no_faster_than_planned(
    joint: JointRange, share: float
) -> None:
    """Through entry and swing; one beyond its limits goes in, and never farther out."""
    width = joint.upper - joint.lower
    axis, start = Axis(joint, 0.9), (joint.lower + joint.upper) / 2 + share * width
    axis.enter(start, 0.0)
    track = [axis.target(count * PERIOD) for count in range(500)]
    steps = [abs(after - before) for before, after in pairwise(track)]
    assert track[0] == start
    assert max(steps) <= axis.velocity * PERIOD * (1 + 1e-9)
    assert steps[0] <= 0.05 * axis.velocity * PERIOD  # from rest
    assert min(track) >= min(start, joint.lower) - 1e-12
    assert max(track) <= max(start, joint.upper) + 1e-12


def test_a_joint_that_cannot_swing_is_refused_by_name() -> None:
    """An empty range or no speed is an error of the URDF; no range and no limit is none.

    It swings about zero; Baxter's URDF has a velocity limit of 10000 rad/s for its head.
    """
    for wrong in (JointRange('elbow', -1.0, 1.0, 0.0), JointRange('elbow', 1.0, -1.0, 1.0)):
        with pytest.raises(WaveError, match='elbow'):
            Axis(wrong, 0.0)
    wheel = Axis(JointRange('wheel', -math.inf, math.inf, 1.0), 0.0)
    assert wheel.centre == 0.0
    assert 0 < wheel.amplitude < 1.0
    assert Axis(JointRange('head_pan', -1.6, 1.6, 10000.0), 0.0).velocity == MAX_VELOCITY


@pytest.mark.parametrize('name', ['panda_hand', 'prbt', 'gp110'])
def test_a_cell_suits_its_robot(name: str) -> None:
    """Home, and both poses above the part, are free of the pillar; the tip looks down."""
    plan = pytest.importorskip('arm_bringup.examples.plan')
    from arm_bringup.robots import read_description, read_semantic
    from arm_model import load_limits, RobotModel, start_pose

    robot = locate(argparse.Namespace(robot=name, group=[], xacro_arg=[]))
    cell = plan.CELLS[name]
    model = RobotModel(
        read_description(robot),
        read_semantic(robot),
        load_limits(robot.limits),
        cell.group,
        robot.tip_link or None,
        folder=robot.description.parent,
    )
    assert cell.aside[0] in model.joints
    if cell.gripper:
        model = model.with_others({cell.gripper[1]: cell.gripper[2]})
    for place in (0, 1):
        pose = model.pose(np.array(cell.above[place]))
        assert pose.position[2] > cell.part_at(place)[2] + cell.below
        assert math.dist(pose.position[:2], cell.part_at(place)[:2]) < 0.01
        assert pose.rotation[2, 2] == pytest.approx(-1.0, abs=0.01)
    for thing in cell.obstacles():
        if thing.id == plan.PILLAR:  # it stands upright whatever its yaw is
            for at in (start_pose(model), *map(np.array, cell.above)):
                assert plan.distance_of(model, thing, at) > 0.0


@pytest.mark.parametrize(('width', 'height'), [(80, 24), (121, 24), (122, 40)])
def test_the_table_fits_a_terminal(width: int, height: int) -> None:
    """In as many lines as it says, also before drives are seen; a long name is cut, no number."""

    class Still(ArmDemo):
        label = 'plan'

        def move(self) -> None:
            """Nothing moves."""

        def line(self) -> str:
            return 'planned ' * 30

    names = ['joint_1', 'panda_finger_joint1']
    session: Any = SimpleNamespace(
        robot=SimpleNamespace(name='arm'), drives=names, bus='vcan0', mode_service='m'
    )
    demo = Still(session, {name: JointRange(name, -1.0, 1.0, 1.0) for name in names}, None, [])
    console = Console(file=io.StringIO(), width=width, height=height)
    for known in (False, True):
        if known:
            figures = dict.fromkeys(('position', 'velocity', 'following_error'), '-0.123 rad')
            figures |= {'nmt_state': 'OPERATIONAL', 'state': 'Fault reaction active'}
            figures['mode'] = 'Cyclic position'
            demo.drives = dict.fromkeys(names, figures)
            demo.bus = {'frames_per_second': '2912.0', 'bus_load': '27 %', 'jitter_p50': '0.001'}
        rows = [
            ''.join(each.text for each in line)
            for part in demo.table(width)
            for line in console.render_lines(part, pad=False)
        ]
        assert len(rows) == demo.lines - 2  # a title, and one that is left free
        assert max(map(len, rows)) <= width
        assert sum(row.count('-0.123') for row in rows) == 6 * known
        assert sum(row.count('●') for row in rows) == 2 * known * (width >= 122)
    assert 'load 27 %' in demo.progress()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Cartesian paths: dense enough, on their lines, and how far they lead."""

from __future__ import annotations

from functools import cache

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain_texts, ready, robot, ROBOTS
import numpy as np
import pytest

from arm_model import Pose, RobotModel
from arm_planning.cartesian import cartesian_path, JumpThresholds
from arm_planning.link_kinematics import LinkKinematics


@cache
def tip(name: str) -> LinkKinematics:
    """Return the kinematics of a robot's tip."""
    return LinkKinematics(robot(name))


def moved(name: str, *way: float) -> Pose:
    """Return the pose of the tip at the ready pose, moved."""
    pose = tip(name).pose(ready(name))
    return Pose(pose.rotation, pose.position + np.array(way))


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=15, deadline=None)
@given(side=st.floats(0.01, 0.08), step=st.floats(0.002, 0.03))
def test_way_points_are_passed_in_steps(name: str, side: float, step: float) -> None:
    """The link goes around a corner in steps that are no longer than asked for."""
    corner, end = moved(name, 0.0, side, 0.0), moved(name, 0.0, side, -side)
    found = cartesian_path(robot(name), ready(name), [corner, end], step)
    assert found.fraction == 1.0
    assert not found.reason
    places = [tip(name).pose(row) for row in found.positions]
    ways = np.array([place.position for place in places])
    longest = np.linalg.norm(np.diff(ways, axis=0), axis=1).max()
    assert longest <= step + 1e-9  # [m] inverse kinematics is no more exact
    assert places[-1].position == pytest.approx(end.position, abs=1e-8)
    assert np.linalg.norm(ways - corner.position, axis=1).min() < 1e-8
    assert np.abs(ways[:, 0] - corner.position[0]).max() < 1e-8
    for place in places:
        assert place.rotation == pytest.approx(corner.rotation, abs=1e-8)


@pytest.mark.parametrize('name', ROBOTS)
def test_the_fraction_ends_where_the_reach_does(name: str) -> None:
    """Out of reach: all places but the last are met, and the reason is said."""
    found = cartesian_path(robot(name), ready(name), [moved(name, 0.0, 4.0, 0.0)], 0.02)
    assert 0.01 < found.fraction < 0.9
    assert 'no joint positions' in found.reason
    way = tip(name).pose(found.positions[-1]).position - moved(name, 0.0, 0.0, 0.0).position
    assert way == pytest.approx([0.0, 4.0 * found.fraction, 0.0], abs=1e-8)


def test_jumps_end_a_path() -> None:
    """By the step of a joint that turns or slides, or by the mean step."""
    name = 'prbt'
    goal = moved(name, 0.0, 0.1, 0.0)
    free = cartesian_path(robot(name), ready(name), [goal], 0.005)
    steps = np.abs(np.diff(free.positions, axis=0))
    limit = float(steps[: len(steps) // 2].max()) * 0.999
    cut = cartesian_path(
        robot(name), ready(name), [goal], 0.005, jumps=JumpThresholds(revolute=limit)
    )
    assert cut.fraction < 0.5
    assert 'would jump by' in cut.reason
    assert np.abs(np.diff(cut.positions, axis=0)).max(initial=0.0) <= limit
    same = cartesian_path(
        robot(name), ready(name), [goal], 0.005, jumps=JumpThresholds(2.0, 1.0, 1e-9)
    )
    assert same.fraction == 1.0
    lengths = np.linalg.norm(steps, axis=1)
    factor = float(lengths[0] / lengths.mean()) * 0.999
    none = cartesian_path(robot(name), ready(name), [goal], 0.005, jumps=JumpThresholds(factor))
    assert none.fraction == 0.0


def test_sliding_joints_have_a_threshold_of_their_own() -> None:
    """A slide that is too far in one step is a jump, though it turns nothing."""
    model = RobotModel(*chain_texts('pzyyzxz'))
    start = np.array([0.1, 0.3, 0.4, 0.5, 0.3, 0.4, 0.2])
    pose = LinkKinematics(model).pose(start)
    goal = Pose(pose.rotation, pose.position + np.array([0.05, 0.0, 0.0]))
    assert cartesian_path(model, start, [goal], 0.01).fraction == 1.0
    cut = cartesian_path(model, start, [goal], 0.01, jumps=JumpThresholds(prismatic=1e-4))
    assert cut.fraction == 0.0
    assert 'j1 would jump' in cut.reason

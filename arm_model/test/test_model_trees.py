# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A group that is a tree: two arms on a torso, one of them continuous, the other sliding."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import two_arms
import numpy as np
import pytest

from arm_model import Array

STEP = 1e-6


def anywhere(seed: int, count: int) -> Array:
    """Return positions of all joints at random."""
    return np.random.default_rng(seed).uniform(-1.2, 1.2, count)


def test_each_group_is_an_arm_of_its_own() -> None:
    """An arm alone is a chain from the torso; both are no chain, with the last arm's tip."""
    left, both = two_arms('left'), two_arms()
    assert left.joints == ('left_1', 'left_2', 'left_3')
    assert (left.base, left.tip, left.serial) == ('torso_link', 'left_3_link', True)
    assert set(both.joints) == {'torso', *left.joints, 'right_1', 'right_2'}
    assert (both.base, both.tip, both.serial) == ('base', 'right_2_link', False)
    assert both.limits.continuous.tolist() == [name == 'right_2' for name in both.joints]


@pytest.mark.parametrize('tip', ['left_3_link', 'right_2_link', 'torso_link'])
@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_jacobians_are_differences(tip: str, seed: int) -> None:
    """Of either tip; joints of the other arm do not move it."""
    model = two_arms(tip=tip)
    at = anywhere(seed, len(model))
    jacobian, pose = model.jacobian(at), model.pose(at)
    for joint, unit in enumerate(np.eye(len(model))):
        moved = model.pose(at + STEP * unit)
        linear = (moved.position - pose.position) / STEP
        assert jacobian[:3, joint] == pytest.approx(linear, abs=1e-5)
        if model.joints[joint].partition('_')[0] not in {'torso', tip.partition('_')[0]}:
            assert not jacobian[:, joint].any()


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_gradients_of_distances_are_differences(seed: int) -> None:
    """Within an arm, between the arms, and between an arm and the base."""
    model = two_arms()
    at = anywhere(seed, len(model))
    every = model.nearest(at, math.inf, len(model.pairs))
    assert len(every) == len(model.pairs)
    steps = STEP * np.eye(len(at))
    ahead = np.array([model.clearances().least(at + step, math.inf) for step in steps])
    behind = np.array([model.clearances().least(at - step, math.inf) for step in steps])
    for near in every:
        quotient = (ahead - behind)[:, near.pair] / (2.0 * STEP)
        assert near.gradient == pytest.approx(quotient, abs=1e-3)


def test_arms_are_parted_by_their_own_joints_and_not_by_the_torso() -> None:
    """The torso turns both; the joints of one arm are one way, those of the other the other."""
    model = two_arms()
    pair = model.pairs.index(('left_3_link', 'right_2_link'))
    signs = dict(zip(model.joints, model.scene.relative_motion_sign[pair], strict=True))
    assert signs['torso'] == 0.0
    assert {signs[name] for name in ('left_1', 'left_2', 'left_3')} == {-1.0}
    assert {signs[name] for name in ('right_1', 'right_2')} == {1.0}

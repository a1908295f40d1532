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

from arm_model import Array, Clearances, CommandError

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


def test_arms_are_parted_by_their_own_joints_and_not_by_the_torso() -> None:
    """The torso turns both; the joints of one arm are one way, those of the other the other."""
    model = two_arms()
    pair = model.pairs.index(('left_3_link', 'right_2_link'))
    signs = dict(zip(model.joints, model.scene.relative_motion_sign[pair], strict=True))
    assert signs['torso'] == 0.0
    assert {signs[name] for name in ('left_1', 'left_2', 'left_3')} == {-1.0}
    assert {signs[name] for name in ('right_1', 'right_2')} == {1.0}


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_joints_beside_a_group_stand_where_they_are_said_to(seed: int) -> None:
    """Poses and distances are those of the whole robot; the first model stays as it is."""
    left, both = two_arms('left'), two_arms()
    everywhere = anywhere(seed, len(both))
    state = dict(zip(both.joints, everywhere.tolist(), strict=True))
    here = np.array([state[name] for name in left.joints])
    before = left.kinematics.link_pose('right_2_link', here)
    moved = left.with_others(state)
    assert moved.kinematics.others == {name: state[name] for name in left.kinematics.others}
    for link in moved.frames:
        pose = moved.kinematics.link_pose(link, here)
        whole = both.kinematics.link_pose(link, everywhere)
        assert pose.position == pytest.approx(whole.position, abs=1e-12)
        assert pose.rotation == pytest.approx(whole.rotation, abs=1e-12)
    distances = dict(
        zip(both.pairs, Clearances(both.scene).least(everywhere, math.inf), strict=True)
    )
    for pair, distance in zip(
        moved.pairs, Clearances(moved.scene).least(here, math.inf), strict=True
    ):
        assert distance == pytest.approx(distances[pair], abs=1e-9)
    assert moved.clearance(here) == pytest.approx(min(distances[pair] for pair in moved.pairs))
    again = left.kinematics.link_pose('right_2_link', here)
    assert again.position.tolist() == before.position.tolist()


def test_nothing_is_made_anew_where_no_joint_beside_the_group_has_moved() -> None:
    """A place that is no number is refused by the joint's name."""
    left = two_arms('left')
    assert left.with_others({'left_1': 0.5, 'right_1': 0.0}) is left
    with pytest.raises(CommandError, match='right_1: its position is nan'):
        left.with_others({'right_1': math.nan})

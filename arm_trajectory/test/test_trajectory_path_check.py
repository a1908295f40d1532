# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contacts on a path are those that are found by looking at every place."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import robot, ROBOTS
import numpy as np
import pytest

from arm_model import Array, AttachedBody, Box, CollisionObject, ORIGIN
from arm_trajectory import PathCheck
from arm_trajectory.path import MAX_STEP

pytestmark = pytest.mark.slow


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=12, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_what_is_refused_collides_and_what_is_accepted_does_not(name: str, seed: int) -> None:
    """Against looking at every millisecond; what is passed over is shallower than a step."""
    model, rng = robot(name), np.random.default_rng(seed)
    lower = np.maximum(model.limits.lower, -2.5)
    upper = np.minimum(model.limits.upper, 2.5)
    begin, end = rng.uniform(lower, upper, (2, len(model)))
    shares = np.linspace(0.0, 1.0, 2001)
    least = min(model.clearance(begin + share * (end - begin)) for share in shares)

    def positions(times: Array) -> Array:
        places: Array = begin + np.outer(times / 4.0, end - begin)
        return places

    if model.clearance(begin) > 0.0:
        found = PathCheck(model.scene).contact(positions, 4.0)
        assert least < 0.0 if found else least > -MAX_STEP


def test_an_object_in_the_way_is_found() -> None:
    """With its name; the same way past it, and with it attached to the tip, is free."""
    model = robot('panda')
    begin = model.poses['ready']
    end = begin + np.eye(7)[0]

    def positions(times: Array) -> Array:
        places: Array = begin + np.outer(times, end - begin)
        return places

    half_way = model.pose(begin + 0.5 * (end - begin))
    post = CollisionObject('post', Box(0.05, 0.05, 0.5), pose=half_way)
    scene = model.scene.with_object(post)
    found = PathCheck(scene).contact(positions, 1.0)
    assert found is not None
    assert 'post' in found.links
    assert 0.0 < found.time < 0.5
    assert PathCheck(scene.allowing('post', '*')).contact(positions, 1.0) is None
    assert PathCheck(scene.without('post')).contact(positions, 1.0) is None
    beam = CollisionObject('beam', Box(0.02, 0.02, 0.2))
    held = scene.with_attached(AttachedBody(beam.at(ORIGIN), model.tip, frozenset(model.frames)))
    found = PathCheck(held.allowing('post', 'panda_*')).contact(positions, 1.0)
    assert found is not None
    assert set(found.links) == {'post', 'beam'}

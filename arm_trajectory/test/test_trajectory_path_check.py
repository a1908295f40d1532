# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contacts on a path are those that are found by looking at every place."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import robot, ROBOTS
import numpy as np
import pytest

from arm_model import Array
from arm_trajectory import PathCheck
from arm_trajectory.path_check import MAX_STEP

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
        found = PathCheck(model).contact(positions, 4.0)
        assert least < 0.0 if found else least > -MAX_STEP

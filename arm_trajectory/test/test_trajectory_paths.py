# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Segments, rounded corners, time scaling, and the words of a tolerance that is violated."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import assume, given, settings
from hypothesis import strategies as st
from model_robots import robot, ROBOTS
import numpy as np
import pytest

from arm_model import AttachedBody, Box, CollisionObject, ORIGIN, PlanningScene, RobotState
from arm_trajectory import cubics, JointTolerance, lines, merge_tolerances, Path, PathCheck, Timing
from arm_trajectory.path import MAX_STEP
from arm_trajectory.rounding import rounded


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

    if model.clearance(begin) > 0.0:
        found = PathCheck(model.scene).contact(
            lambda times: begin + np.outer(times / 4.0, end - begin), 4.0
        )
        assert least < 0.0 if found else least > -MAX_STEP


def test_an_object_in_the_way_is_found() -> None:
    """With its name; the same way past it, and with it attached to the tip, is free."""
    model = robot('panda')
    begin, turn = model.poses['ready'], np.eye(7)[0]

    def contact(scene: PlanningScene) -> Any:
        return PathCheck(scene).contact(lambda times: begin + np.outer(times, turn), 1.0)

    post = CollisionObject('post', Box(0.05, 0.05, 0.5), pose=model.pose(begin + 0.5 * turn))
    scene = model.scene.with_object(post)
    found = contact(scene)
    assert 'post' in found.links
    assert 0.0 < found.time < 0.5
    assert contact(scene.allowing('post', '*')) is None
    assert contact(scene.without('post')) is None
    beam = CollisionObject('beam', Box(0.02, 0.02, 0.2))
    held = scene.with_attached(AttachedBody(beam.at(ORIGIN), model.tip, frozenset(model.frames)))
    assert set(contact(held.allowing('post', 'panda_*')).links) == {'post', 'beam'}


pytestmark = pytest.mark.slow


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), duration=st.floats(0.1, 5.0), share=st.floats(0.1, 0.9))
def test_segments_meet_their_ends(seed: int, duration: float, share: float) -> None:
    """A line meets positions, a cubic velocities too, a quintic accelerations too.

    Velocity and acceleration are the difference quotients of what they derive.
    """
    rng = np.random.default_rng(seed)
    begin, end = (RobotState(*rng.normal(size=(3, 4))) for _ in range(2))
    lasts, q = np.array([duration]), np.array([begin.position, end.position])
    straight = Path(lasts, lines(lasts, q))
    third = Path(lasts, cubics(lasts, q, np.array([begin.velocity, end.velocity])))
    fifth = Path.between(duration, begin, end)
    step = 1e-5 * duration
    for path in (straight, third, fifth):
        assert path.at(0.0).position == pytest.approx(begin.position)
        assert path.end.position == pytest.approx(end.position, abs=1e-9)
        before, here, after = (path.at(share * duration + shift) for shift in (-step, 0.0, step))
        moved = (after.position - before.position) / (2 * step)
        turned = (after.velocity - before.velocity) / (2 * step)
        assert here.velocity == pytest.approx(moved, rel=1e-4, abs=1e-4)
        assert here.acceleration == pytest.approx(turned, rel=1e-3, abs=1e-3)
    for path in (third, fifth):
        assert path.at(0.0).velocity == pytest.approx(begin.velocity)
        assert path.end.velocity == pytest.approx(end.velocity, abs=1e-8)
    assert fifth.at(0.0).acceleration == pytest.approx(begin.acceleration)
    assert fifth.end.acceleration == pytest.approx(end.acceleration, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(tolerance=st.floats(1e-6, 1.0), share=st.floats(1.0001, 2.0))
def test_the_words_of_a_violation_show_it(tolerance: float, share: float) -> None:
    """The amount reads greater than its tolerance, however small both are."""
    limits = robot('prbt').limits
    bound = merge_tolerances(limits, None, JointTolerance(tolerance))
    words = bound.violation(limits, np.full(6, -tolerance * share), np.zeros(6))
    assert words is not None
    found = re.search(r'off by -(\S+) rad, tolerance (\S+)$', words)
    assert found is not None, words
    assert float(found[1]) > float(found[2]) > 0.0


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), step=st.sampled_from([0.01, 0.1, 1.0]))
def test_rounded_paths_are_smooth(seed: int, step: float) -> None:
    """Positions, speeds and accelerations are continuous, however dense the corners are."""
    limits = robot('prbt').limits
    rows = np.cumsum(np.random.default_rng(seed).normal(size=(12, 6)), axis=0) * 0.1 * step
    lasts = np.full(len(rows) - 1, step)
    path = rounded(Path(lasts, lines(lasts, rows)), limits)
    numbers = np.arange(len(path.durations))
    for order, tolerance in enumerate((1e-9, 1e-8, 1e-6)):
        before = path.derived(order, numbers, path.durations)[:-1]
        after = path.derived(order, numbers, np.zeros(len(numbers)))[1:]
        assert after == pytest.approx(before, abs=tolerance)
    assert path.at(0.0).position == pytest.approx(rows[0])
    assert path.end.position == pytest.approx(rows[-1])


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_time_scaled_paths_lead_through_the_same_places(seed: int) -> None:
    """A path that is followed slower is the same path, within the limits."""
    limits = robot('gp110').limits
    rows = np.random.default_rng(seed).uniform(-0.3, 0.3, (5, 6))
    lasts = np.full(4, 0.25)
    given_path = rounded(Path(lasts, lines(lasts, rows)), limits)
    scaled = Timing(given_path, limits).time_scaled()
    assume(scaled is not None and scaled is not given_path)
    assert scaled is not None
    assert Timing(scaled, limits).demand.time_factor <= 1.0
    there = given_path.positions(np.linspace(0.0, given_path.duration, 3000))
    for place in scaled.positions(np.linspace(0.0, scaled.duration, 60)):
        assert np.abs(there - place).max(axis=1).min() < 2e-3  # as dense as the places are

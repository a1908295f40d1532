# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The jerk-limited generator: limits, stops, and its fallback."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import robot, ROBOTS
import numpy as np
import pytest

from arm_model import Array, RobotState
from arm_trajectory import brakeable, hard_brake, OnlineTrajectoryGenerator

PERIOD = 0.004


def stream(name: str, seed: int) -> list[RobotState]:
    """Follow velocities that change at random, and return the states."""
    limits, rng = robot(name).limits, np.random.default_rng(seed)
    generator = OnlineTrajectoryGenerator(limits)
    state = RobotState.at_rest(np.zeros(len(limits)))
    states, target = [state], state.velocity
    for step in range(120):
        if step % 15 == 0:
            target = rng.uniform(-1, 1, len(limits)) * limits.velocity
        noisy = np.clip(
            target + 0.01 * rng.normal(size=len(limits)), -limits.velocity, limits.velocity
        )
        plan = generator.to_velocity(state, noisy)
        assert plan is not None
        state = plan.at(PERIOD)
        states.append(state)
    return states


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_limits_hold_while_the_target_changes(name: str, seed: int) -> None:
    """Velocity, acceleration and jerk stay within the limits, whatever is asked."""
    limits, states = robot(name).limits, stream(name, seed)
    for before, after in pairwise(states):
        assert np.all(np.abs(after.velocity) <= limits.velocity * 1.0001)
        assert np.all(np.abs(after.acceleration) <= limits.acceleration * 1.0001)
        jerk = (after.acceleration - before.acceleration) / PERIOD
        assert np.all(np.abs(jerk) <= limits.jerk * 1.0001)


def test_joints_start_in_step() -> None:
    """From rest all joints keep the direction of the asked velocity, cycle by cycle."""
    limits = robot('panda').limits
    generator = OnlineTrajectoryGenerator(limits)
    target = limits.velocity * np.array([0.3, -0.5, 0.2, 0.9, -0.1, 0.4, 0.05])
    state = RobotState.at_rest(np.zeros(7))
    for _ in range(40):
        plan = generator.to_velocity(state, target)
        assert plan is not None
        state = plan.at(PERIOD)
        along = target * (state.velocity @ target) / (target @ target)
        assert np.abs(state.velocity - along).max() < 0.01 * np.abs(target).max()


@settings(max_examples=60, deadline=None)
@given(share=st.floats(0.001, 3.0))
def test_what_is_brakeable_can_be_braked(share: float) -> None:
    """A stop from the velocity that can be braked on a way takes just this way."""
    limits = robot('panda').limits
    way: Array = np.full(7, share)
    rows = zip(way, limits.acceleration, limits.jerk, strict=True)
    velocity = np.minimum([brakeable(*row) for row in rows], limits.velocity)
    stop = OnlineTrajectoryGenerator(limits).brake(RobotState(np.zeros(7), velocity, np.zeros(7)))
    assert stop is not None
    _, upper = stop.extremes
    free = velocity < limits.velocity
    assert upper[free] == pytest.approx(way[free], rel=1e-6)
    assert np.all(upper <= way + 1e-9)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_the_extremes_of_a_stop_are_those_of_its_places(seed: int) -> None:
    """Wherever it begins, also far from zero, and in whatever motion."""
    limits, rng = robot('panda').limits, np.random.default_rng(seed)
    state = RobotState(
        rng.uniform(limits.lower, limits.upper),
        rng.uniform(-1.0, 1.0, 7) * limits.velocity,
        rng.uniform(-1.0, 1.0, 7) * limits.acceleration,
    )
    stop = OnlineTrajectoryGenerator(limits).brake(state)
    assert stop is not None
    places = np.array([stop.at(time).position for time in np.linspace(0, stop.duration, 400)])
    assert places[0] == pytest.approx(state.position, abs=1e-12)
    lower, upper = stop.extremes
    assert lower == pytest.approx(places.min(axis=0), abs=1e-4)
    assert upper == pytest.approx(places.max(axis=0), abs=1e-4)


def test_a_plan_to_a_state_arrives() -> None:
    """Position, velocity and acceleration of the target are met at the end.

    A target that ruckig refuses is no exception in the loop.
    """
    generator = OnlineTrajectoryGenerator(robot('prbt').limits)
    start = RobotState(np.zeros(6), np.full(6, 0.2), np.full(6, 0.5))
    target = RobotState(np.full(6, 0.7), np.full(6, -0.3), np.full(6, 0.1))
    plan = generator.to_state(start, target)
    assert plan is not None
    end = plan.at(plan.duration)
    assert end.position == pytest.approx(target.position, abs=1e-9)
    assert end.velocity == pytest.approx(target.velocity, abs=1e-9)
    assert end.acceleration == pytest.approx(target.acceleration, abs=1e-6)
    assert generator.to_velocity(start, np.full(6, np.nan)) is None


def test_the_hard_brake_comes_to_rest() -> None:
    """The fallback slows each joint with its greatest deceleration, and stays at rest."""
    limits = robot('prbt').limits
    state = RobotState(np.zeros(6), np.linspace(-1.5, 1.5, 6), np.zeros(6))
    needed = float(np.max(np.abs(state.velocity) / limits.acceleration))
    for _ in range(int(needed / PERIOD) + 2):
        after = hard_brake(state, limits, PERIOD)
        assert np.all(np.abs(after.velocity) <= np.abs(state.velocity))
        state = after
    assert not state.moving

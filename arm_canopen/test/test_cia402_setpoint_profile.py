# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The set-points of modes 7 and 8 on the way to single targets and along a stream of them."""

from __future__ import annotations

from itertools import pairwise
import math
import random

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.cia402.modes.cyclic_position import SetpointProfile
from arm_canopen.cia402.parameters import ProfileLimits

CYCLE = 0.01  # [s]
LIMITS = ProfileLimits(1.0, 10.0, 10.0)
AMPLITUDE, RATE = 0.45, 2 * math.pi / 5  # [rad] and [rad/s] of a swing


def swing(now: float) -> float:
    """Return where a client wants an axis at a time in [s]."""
    return AMPLITUDE * (1 - math.cos(RATE * now))


def velocities(frequency: float, jitter: float, *, single: bool = False) -> list[float]:
    """Follow five seconds of the swing; return the velocity in each cycle.

    Args:
        frequency: How many targets come in a second.
        jitter: How much later than sent they arrive, at most, in [s].
        single: Take each for a single target.
    """
    rng, profile = random.Random(1), SetpointProfile(0.0)
    sent = [k / frequency for k in range(round(5 * frequency))]
    coming = sorted((at + rng.uniform(0.0, jitter), swing(at)) for at in sent)
    found = []
    for cycle in range(round(5 / CYCLE)):
        while coming and coming[0][0] <= cycle * CYCLE:
            (profile.go if single else profile.track)(coming.pop(0)[1])
        profile.step(CYCLE, LIMITS)
        found.append(profile.velocity)
    return found


def unevenness(track: list[float]) -> float:
    """Return the acceleration of a track as a multiple of that of the swing (root mean square)."""
    steps = [(after - before) / CYCLE for before, after in pairwise(track)]
    rms = math.sqrt(sum(step * step for step in steps) / len(steps))
    return rms / (AMPLITUDE * RATE**2 / math.sqrt(2))


@pytest.mark.parametrize(
    ('frequency', 'jitter', 'bound'),
    [(10.0, 0.0, 1.8), (50.0, 0.0, 1.3), (50.0, 0.005, 1.2), (100.0, 0.005, 1.1)],
)
def test_a_path_that_comes_in_targets_is_followed_at_its_speed(
    frequency: float, jitter: float, bound: float
) -> None:
    """Not by a dash to each of its points, as towards single targets that come as quickly."""
    assert unevenness(velocities(frequency, jitter)) < bound
    if frequency < 100.0:
        assert unevenness(velocities(frequency, jitter, single=True)) > 3 * bound


def test_a_stream_is_behind_by_two_intervals_and_its_braking_distance() -> None:
    """Else it could not stop at the newest target, should that be the last."""
    speed, frequency = 0.5, 50.0
    profile, lags = SetpointProfile(0.0), []
    for cycle in range(200):
        now = cycle * CYCLE
        if cycle % 2 == 0:
            profile.track(speed * now)
        profile.step(CYCLE, LIMITS)
        lags.append(speed * now - profile.position)
    braking = speed**2 / (2 * LIMITS.deceleration)
    assert max(lags[100:]) < 2 * speed / frequency + braking + speed * CYCLE
    assert profile.velocity == pytest.approx(speed, rel=0.02)


targets = st.lists(st.tuples(st.floats(-2.0, 2.0), st.integers(0, 30)), min_size=1, max_size=20)


@given(targets, st.floats(0.1, 3.0), st.floats(0.5, 20.0))
def test_no_stream_leads_beyond_its_targets_or_limits(
    stream: list[tuple[float, int]], speed: float, acceleration: float
) -> None:
    """Wherever they are, and whenever they come; in the end the axis stands at the last one."""
    limits, profile, before = (
        ProfileLimits(speed, acceleration, acceleration),
        SetpointProfile(0.0),
        0.0,
    )
    low = high = 0.0
    for target, cycles in [*stream, (stream[-1][0], 30 * 100)]:
        profile.track(target)
        low, high = min(low, target), max(high, target)
        for _ in range(cycles):
            position = profile.step(CYCLE, limits)
            assert low - 1e-6 <= position <= high + 1e-6
            assert abs(profile.velocity) <= speed * (1 + 1e-9)
            assert abs(profile.velocity - before) <= acceleration * CYCLE * (1 + 1e-9) + 1e-12
            before = profile.velocity
    assert (profile.position, profile.velocity) == (stream[-1][0], 0.0)
    assert profile.at_rest


def test_a_stream_may_be_quicker_than_a_single_target() -> None:
    """As far as the drive may (0x607F): 0x6081 is how quick a target is approached."""
    limits = ProfileLimits(0.1, 10.0, 10.0, speed_limit=0.4)
    for speed, reached in [(0.3, 0.3), (0.9, 0.4)]:
        profile = SetpointProfile(0.0)
        for cycle in range(200):
            profile.track(speed * cycle * CYCLE)
            profile.step(CYCLE, limits)
        assert profile.velocity == pytest.approx(reached, rel=0.01)
    profile.go(10.0)
    for _ in range(50):
        profile.step(CYCLE, limits)
    assert profile.velocity == pytest.approx(0.1)


def test_a_single_target_ends_a_stream() -> None:
    """It is approached as if none had been; so is the first one of the next stream."""
    plain, after = SetpointProfile(0.0), SetpointProfile(0.0)
    for _ in range(5):
        after.track(0.0)
        for _ in range(20):
            after.step(CYCLE, LIMITS)
    for begin in (SetpointProfile.go, SetpointProfile.track):
        after.go(None)
        for profile in (plain, after):
            begin(profile, 1.0)
        for _ in range(60):
            assert plain.step(CYCLE, LIMITS) == after.step(CYCLE, LIMITS)
        plain, after = SetpointProfile(0.0), SetpointProfile(0.0)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo computes from states, on motions whose figures are known."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from arm_bringup.demos.motion.samples import (
    away_from_line,
    cycles_between,
    peak_jerk,
    Sample,
    tool_speed,
    tracking_error,
)
from arm_model import Array

PERIOD = 0.01


def sample(time: float, jerk: Array, stamp: float | None = None, late: float = 0.0) -> Sample:
    """Return a state of a motion from rest with a constant jerk; one joint is 1 m of the tool."""
    position = jerk * time**3 / 6
    tool = np.array([position[0], 0.0, 0.0])
    return Sample(
        time if stamp is None else stamp,
        position,
        jerk * time**2 / 2,
        jerk * time,
        position - late,
        1.0,
        tool,
        tool,
    )


def state(cycle: int, position: float, velocity: float, acceleration: float) -> Sample:
    """Return a state of one joint."""
    rest = np.zeros(1)
    values = np.array([[position], [velocity], [acceleration]])
    return Sample(cycle * PERIOD, values[0], values[1], values[2], rest, 1.0, rest, rest)


@given(
    jerk=st.lists(st.floats(1.0, 90.0), min_size=1, max_size=7).map(np.array),
    begin=st.integers(1, 40),
    cycles=st.integers(1, 3),
    delay=st.floats(-0.009, 0.3),
)
def test_late_stamps_do_not_matter(jerk: Array, begin: int, cycles: int, delay: float) -> None:
    """The motion shows how many cycles lie between two states; none is taken for a jump."""
    first = sample(begin * PERIOD, jerk)
    end = (begin + cycles) * PERIOD
    second = sample(end, jerk, end + delay)
    assert cycles_between(first, second, PERIOD) == cycles
    limits = 2.0 * jerk
    assert peak_jerk([first, second], PERIOD, limits) < 1.0
    second = sample(end, jerk)
    assert peak_jerk([first, second], PERIOD, limits) == pytest.approx(0.5, rel=1e-6)


def test_too_much_jerk_is_seen() -> None:
    """One joint beyond its limit, in one cycle, is enough."""
    states = [sample(n * PERIOD, np.array([10.0, 10.0])) for n in range(1, 20)]
    assert peak_jerk(states, PERIOD, np.array([100.0, 5.0])) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ('what', 'jump'), [('position', 0.1), ('velocity', 0.3), ('acceleration', 20.0)]
)
@pytest.mark.parametrize('speed', [0.0, 0.5])
def test_a_set_point_that_jumps_is_seen(what: str, jump: float, speed: float) -> None:
    """A jump of the position, a stop at once, and an acceleration out of nothing."""
    states = []
    position = 0.0
    for n in range(20):
        now = {'position': position, 'velocity': speed, 'acceleration': 0.0}
        if n == 10:
            now[what] += jump
        states.append(state(n, now['position'], now['velocity'], now['acceleration']))
        position += speed * PERIOD
    limit = np.array([100.0])
    jumps = [n for n in range(19) if peak_jerk(states[n : n + 2], PERIOD, limit) > 1.0]
    assert jumps == [9, 10]


@given(
    jerks=st.lists(st.floats(-50.0, 50.0), min_size=6, max_size=30),
    skipped=st.sets(st.integers(0, 29)),
)
def test_a_motion_within_its_jerk_is_within_it(jerks: list[float], skipped: set[int]) -> None:
    """Whatever the jerk is from cycle to cycle, and whichever states get lost."""
    position = velocity = acceleration = 0.0
    states = []
    for n, jerk in enumerate(jerks):
        if n not in skipped:
            states.append(state(n, position, velocity, acceleration))
        position += velocity * PERIOD + acceleration * PERIOD**2 / 2 + jerk * PERIOD**3 / 6
        velocity += acceleration * PERIOD + jerk * PERIOD**2 / 2
        acceleration += jerk * PERIOD
    assert peak_jerk(states, PERIOD, np.array([50.0])) <= 1.0 + 1e-6


def test_the_same_cycle_twice_is_no_jerk() -> None:
    """A state that is published again says nothing new."""
    same = sample(0.1, np.array([10.0]))
    assert peak_jerk([same, same], PERIOD, np.array([1.0])) == 0.0


@pytest.mark.slow
@given(
    direction=st.tuples(*[st.floats(0.1, 2.0)] * 3).map(np.array),
    offset=st.floats(0.0, 1.0),
    ways=st.lists(st.floats(-5.0, 5.0), min_size=1, max_size=9),
)
def test_distance_from_a_line(direction: Array, offset: float, ways: list[float]) -> None:
    """Points on the line are on it; a shifted one is as far away as it was shifted."""
    begin = np.array([1.0, -2.0, 0.5])
    points = [begin + way * direction for way in ways]
    assert away_from_line(points, begin, direction) == pytest.approx(0.0, abs=1e-9)
    across = np.cross(direction, [1.0, -1.0, 2.0])
    across *= offset / np.linalg.norm(across)
    points.append(points[0] + across)
    assert away_from_line(points, begin, direction) == pytest.approx(offset, abs=1e-9)


def test_speed_where_it_is_steady() -> None:
    """Begin and end of a motion are not part of its speed; missing states do not matter."""
    states = []
    for n in [*range(40), *range(43, 100)]:
        velocity = np.array([0.1])
        tool = np.array([0.1 * n * PERIOD, 0.0, 0.0])
        position = np.array([0.1 * n * PERIOD])
        states.append(
            Sample(n * PERIOD, position, velocity, np.zeros(1), position, 1.0, tool, tool)
        )
    slow = [sample(n * PERIOD, np.array([0.0])) for n in range(125)]  # more than half of it
    assert tool_speed([*slow, *states, *slow[:5]], PERIOD) == pytest.approx(0.1)
    assert tool_speed([], PERIOD) == 0.0


def test_tracking_is_measured_a_cycle_later() -> None:
    """A drive that follows is where it was sent in the cycle before."""
    jerk = np.array([30.0])
    sent = [sample(n * PERIOD, jerk) for n in range(10, 20)]
    good = [
        Sample(b.time, b.position, b.velocity, b.acceleration, a.position, 1.0, b.tool, b.tool)
        for a, b in pairwise(sent)
    ]
    assert tracking_error(good, PERIOD) == pytest.approx(0.0, abs=1e-12)
    away = [sample(n * PERIOD, jerk, late=0.5) for n in range(10, 20)]
    assert tracking_error(away, PERIOD) > 0.4

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the motion profiles, over random starts, targets and limits."""

from __future__ import annotations

from itertools import pairwise
import math

from hypothesis import assume, given
from hypothesis import strategies as st
import pytest

from canopen_sim.drive.profile import (
    hold,
    Limits,
    Motion,
    plan_line,
    plan_move,
    plan_velocity,
    Point,
)

pytestmark = pytest.mark.slow

START = 1000.0  # [s]


def to_millionths(value: float) -> float:
    """Round to a resolution far below any real one; denormal numbers test only rounding."""
    return round(value, 6)


positions = st.floats(-1e6, 1e6).map(to_millionths)
velocities = st.floats(-1e5, 1e5).map(to_millionths)
rates = st.floats(1.0, 1e6)
limits = st.builds(Limits, st.floats(1.0, 1e5), rates, rates)
points = st.builds(Point, positions, velocities, st.just(0.0))


def samples(motion: Motion, count: int = 200) -> list[tuple[float, Point]]:
    """Return the motion at times from a little before to a little after it."""
    begin = motion.segments[0].start
    span = max(motion.end - begin, 1e-3)
    times = [begin + span * (k / count * 1.2 - 0.1) for k in range(count + 1)]
    edges = [segment.start for segment in motion.segments]
    return [(time, motion.at(time)) for time in sorted(times + edges)]


def scale(*values: float) -> float:
    """Return the size of rounding errors for numbers of these sizes."""
    return 1e-9 * (1.0 + sum(abs(value) for value in values))


def check_continuity(motion: Motion, acceleration: float) -> None:
    """Position and velocity have no jumps; where segments meet they agree."""
    reach = max(abs(segment.position) for segment in motion.segments)
    for before, after in pairwise(motion.segments):
        elapsed = after.start - before.start
        position = before.position + elapsed * (
            before.velocity + 0.5 * before.acceleration * elapsed
        )
        velocity = before.velocity + before.acceleration * elapsed
        # time itself is rounded, by so much at the size of a steady clock
        slack = 1e-6 * (1.0 + abs(before.velocity) + abs(velocity)) + scale(reach)
        assert after.position == pytest.approx(position, abs=slack)
        assert after.velocity == pytest.approx(velocity, abs=1e-6 * (1.0 + acceleration))


@given(start=points, target=positions, limits=limits)
def test_move_ends_exactly_at_its_target(start: Point, target: float, limits: Limits) -> None:
    """A move begins where it was started, and stands at its target ever after."""
    motion = plan_move(start, target, limits, START)
    first = motion.at(START)
    assert first.position == pytest.approx(
        start.position, abs=scale(start.position, start.velocity)
    )
    assert first.velocity == pytest.approx(start.velocity, abs=1e-6 * limits.deceleration)
    for time in (motion.end, motion.end + 1.0, motion.end + 1e6):
        assert motion.at(time) == Point(target, 0.0, 0.0)


@given(start=points, target=positions, limits=limits)
def test_move_keeps_its_limits(start: Point, target: float, limits: Limits) -> None:
    """Speed never exceeds the limit, or the start's own; accelerations are those given."""
    motion = plan_move(start, target, limits, START)
    fastest = max(limits.velocity, abs(start.velocity))
    for time, point in samples(motion):
        assert abs(point.velocity) <= fastest * (1.0 + 1e-9)
        if START <= time < motion.end:
            speeding_up = point.velocity * point.acceleration > 0.0
            limit = limits.acceleration if speeding_up else limits.deceleration
            # where the velocity passes zero, either may apply
            turning = abs(point.velocity) <= 1e-6 * limit
            assert abs(point.acceleration) <= limit * (1.0 + 1e-9) or turning
    check_continuity(motion, max(limits.acceleration, limits.deceleration))


@given(start=points, target=positions, limits=limits)
def test_move_lands_where_its_phases_lead(start: Point, target: float, limits: Limits) -> None:
    """The last phase arrives at the target by itself: the end is no jump."""
    motion = plan_move(start, target, limits, START)
    assume(len(motion.segments) > 1)
    last = motion.segments[-2]
    elapsed = motion.end - last.start
    arrival = last.position + elapsed * (last.velocity + 0.5 * last.acceleration * elapsed)
    slack = 1e-6 * (1.0 + abs(last.velocity)) + scale(target, start.position) * 10
    slack += 1e-9 * start.velocity**2 / limits.deceleration
    assert arrival == pytest.approx(target, abs=slack)


@given(
    distance=st.floats(-1e6, 1e6).filter(lambda d: abs(d) > 1e-3),
    limits=limits,
)
def test_move_from_rest_is_time_optimal(distance: float, limits: Limits) -> None:
    """From rest to rest no motion within the limits is faster than the trapezoid."""
    motion = plan_move(Point(0.0, 0.0, 0.0), distance, limits, 0.0)
    up, down = limits.acceleration, limits.deceleration
    length = abs(distance)
    peak = min(limits.velocity, math.sqrt(2.0 * length * up * down / (up + down)))
    ramps = peak / up + peak / down
    best = ramps + (length - 0.5 * peak * ramps) / peak
    assert motion.end == pytest.approx(best, rel=1e-6)


@given(start=points, target=positions, limits=limits)
def test_replanning_changes_nothing(start: Point, target: float, limits: Limits) -> None:
    """A move that is planned anew on its way arrives at the same time, and as fast."""
    assume(abs(start.velocity) <= limits.velocity)
    motion = plan_move(start, target, limits, 0.0)
    assume(motion.end > 1e-3)
    for fraction in (0.1, 0.5, 0.9):
        time = fraction * motion.end
        again = plan_move(motion.at(time), target, limits, time)
        slack = 1e-3 + 2.0 * math.sqrt(scale(target, start.position) / limits.deceleration)
        assert again.end == pytest.approx(motion.end, rel=1e-3, abs=slack)


@given(start=points, target=velocities, limits=limits)
def test_velocity_is_reached_and_kept(start: Point, target: float, limits: Limits) -> None:
    """A ramp ends exactly at its velocity, held to the limit, and keeps it."""
    motion = plan_velocity(start, target, limits, START)
    wanted = math.copysign(min(abs(target), limits.velocity), target)
    for later in (0.0, 1.0, 100.0):
        assert motion.at(motion.end + later).velocity == wanted
    assert motion.at(START).velocity == pytest.approx(start.velocity)
    check_continuity(motion, max(limits.acceleration, limits.deceleration))


@given(start=points, target=velocities, limits=limits)
def test_velocity_ramp_takes_as_long_as_it_must(
    start: Point, target: float, limits: Limits
) -> None:
    """The time of a ramp follows from its rates, also through a change of direction."""
    motion = plan_velocity(start, target, limits, 0.0)
    wanted = math.copysign(min(abs(target), limits.velocity), target)
    velocity = start.velocity
    if velocity * wanted < 0.0:
        best = abs(velocity) / limits.deceleration + abs(wanted) / limits.acceleration
    elif abs(wanted) > abs(velocity):
        best = (abs(wanted) - abs(velocity)) / limits.acceleration
    else:
        best = (abs(velocity) - abs(wanted)) / limits.deceleration
    assert motion.end == pytest.approx(best)


@given(position=positions, target=positions, duration=st.floats(1e-3, 10.0))
def test_line_arrives_in_time(position: float, target: float, duration: float) -> None:
    """A line is at its target when its time is over, and half way at half time."""
    motion = plan_line(position, target, duration, 0.0)
    assert motion.at(duration) == Point(target, 0.0, 0.0)
    middle = 0.5 * (position + target)
    assert motion.at(0.5 * duration).position == pytest.approx(middle, abs=1e-6)


@given(
    start=points,
    target=positions,
    limits=limits,
    cuts=st.lists(st.floats(0.0, 1.0), max_size=6),
)
def test_pieces_cover_the_time(
    start: Point, target: float, limits: Limits, cuts: list[float]
) -> None:
    """The pieces between any times join without gap, and begin where the motion is."""
    motion = plan_move(start, target, limits, 0.0)
    span = motion.end * 1.5 + 1.0
    edges = [0.0, *sorted(cut * span for cut in cuts), span]
    for begin, end in pairwise(edges):
        time = begin
        for point, duration in motion.pieces(begin, end):
            assert duration > 0.0
            assert point.position == pytest.approx(
                motion.at(time).position, abs=1e-6 * (1.0 + abs(start.velocity))
            )
            time += duration
        assert time == pytest.approx(end)


def test_hold_stands_still() -> None:
    """Before and after its start, a hold is where it is."""
    motion = hold(3.0, 10.0)
    assert [motion.at(time) for time in (0.0, 10.0, 1e9)] == [Point(3.0, 0.0, 0.0)] * 3

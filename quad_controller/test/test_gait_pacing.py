# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The pace of the control loop, in a time of the test's own."""

from __future__ import annotations

import itertools

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from quad_controller.nodes.control_loop import loop_figures, Pacer, WINDOW

PERIOD = 0.02  # [s]


def simulate(arrivals: list[float], duration: float) -> list[tuple[float, float | None]]:
    """Return the times of steps, each with the arrival that it used."""
    pacer = Pacer(PERIOD, 0.0)
    now, steps, waiting = 0.0, [], None
    queue = list(arrivals)
    while now < duration:
        deadline = pacer.deadline(waiting is not None)
        if queue and queue[0] < deadline:
            now = max(now, queue.pop(0))
            waiting = now
            if not pacer.takes(now):
                continue
        else:
            now = max(now, deadline)
        steps.append((now, waiting))
        pacer.stepped(now, waiting)
        waiting = None
    return steps


def test_without_feedback_steps_are_on_schedule() -> None:
    """The times are multiples of the period, however long a step takes."""
    times = [time for time, _ in simulate([], 1.0)]
    assert times == pytest.approx([index * PERIOD for index in range(len(times))])


@pytest.mark.slow
@settings(max_examples=30)
@given(
    offset=st.floats(0.0, 0.019),
    jitter=st.lists(st.floats(0.0, 0.0012), min_size=200, max_size=220),
)
def test_with_feedback_steps_follow_arrivals(offset: float, jitter: list[float]) -> None:
    """After a second of getting in step, every arrival is used at once."""
    arrivals = [offset + index * PERIOD + late for index, late in enumerate(jitter)]
    steps = simulate(arrivals, arrivals[-1])
    late = [time - used for time, used in steps[80:-1] if used is not None]
    assert len(late) >= len(steps) - 83
    assert max(late) < 1e-9


@given(st.floats(0.005, 0.05))
def test_the_rate_stays_whatever_the_feedback_does(between: float) -> None:
    """Feedback at 20 to 200 Hz changes the rate by no more than its pull allows."""
    arrivals = [index * between for index in range(int(10 / between))]
    steps = simulate(arrivals, 10.0)
    assert len(steps) == pytest.approx(500, rel=0.06)
    times = [time for time, _ in steps]
    least = min(b - a for a, b in itertools.pairwise(times))
    assert least > (1 - 2 * WINDOW) * PERIOD - 1e-9


def test_a_late_step_is_not_made_up_for() -> None:
    """After a pause the schedule goes on without a burst, and the pause is counted."""
    pacer = Pacer(PERIOD, 0.0)
    pacer.stepped(0.0, None)
    pacer.stepped(0.105, None)
    assert pacer.overruns == 4
    assert 0.105 < pacer.deadline(fresh=False) <= 0.125


def test_figures() -> None:
    """Jitter is the distance of intervals from the period."""
    steps = [(interval, 0.0002, 0.001) for interval in (0.02, 0.021, 0.018)]
    figures = loop_figures(steps, PERIOD)
    assert figures['jitter_max'] == pytest.approx(0.002)
    assert figures['jitter_p50'] == pytest.approx(0.001)
    assert figures['rate'] == pytest.approx(3 / 0.059)

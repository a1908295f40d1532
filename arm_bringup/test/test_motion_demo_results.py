# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo calls a failure, and the trajectories that it plans."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from arm_bringup.demos.figures import BusFigures
from arm_bringup.demos.motion.goals import beside, duration
from arm_bringup.demos.motion.results import MotionResults, Square
from arm_model import JointLimits


def limits(count: int, scale: float) -> JointLimits:
    """Return limits of joints with a range of 2 rad."""
    ones = np.ones(count)
    names = tuple(f'j{number}' for number in range(count))
    return JointLimits(names, -ones, ones, scale * ones, 3 * scale * ones, 20 * scale * ones)


@given(
    begin=st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6).map(np.array),
    scale=st.floats(0.2, 5.0),
)
def test_planned_trajectories_keep_the_limits(begin: np.ndarray, scale: float) -> None:
    """Sampled, a quintic of the planned time stays below every limit, within the range."""
    bounds = limits(6, scale)
    end = beside(begin, bounds, 0.5)
    assert np.all(np.abs(end) <= 1.0 + 1e-9)
    assert np.all(np.abs(end - begin) >= 0.4)
    time = duration(begin, end, bounds)
    u = np.linspace(0.0, 1.0, 501)[:, None]
    way = end - begin
    velocity = way * (30 * u**2 - 60 * u**3 + 30 * u**4) / time
    acceleration = way * (60 * u - 180 * u**2 + 120 * u**3) / time**2
    jerk = way * (60 - 360 * u + 360 * u**2) / time**3
    assert np.all(np.abs(velocity) < bounds.velocity)
    assert np.all(np.abs(acceleration) < bounds.acceleration)
    assert np.all(np.abs(jerk) < bounds.jerk)


def test_good_figures_are_no_problem() -> None:
    """A run as it should be has a row for each part and no problem."""
    results = MotionResults()
    results.square('square', Square(0.1, 0.1004, 1e-4, 2e-3))
    results.singularity(0.5, 0.49, 'singularity: x is lost here')
    results.motion(1.0, 0.01, BusFigures())
    assert results.problems == []
    assert len(results.lines()) == 5


def test_late_commands_judge_no_speed() -> None:
    """A computer too busy to jog stops the tool; the row says so, and other causes are judged."""
    results = MotionResults()
    results.square('square', Square(0.1, 0.0, 1e-4, 2e-3, gap=0.23))
    assert results.problems == []
    assert 'not judged: jog commands were up to 0.23 s apart' in results.lines()[0]
    results.square('square', Square(0.1, 0.0, 1e-4, 2e-3, gap=0.03))
    assert results.problems == ['square: the tool moved at 0.0000 m/s instead of 0.100 m/s']


def test_late_answers_judge_no_path() -> None:
    """Where a busy computer let PDOs come late, only what was commanded is judged."""
    results = MotionResults()
    results.square('square', Square(0.1, 0.1, 1e-4, 4e-3, missed=2))
    results.motion(1.0, 0.4, BusFigures(missed_pdos=2))
    assert results.problems == []
    results.square('square', Square(0.1, 0.1, 4e-3, 4e-3, missed=2))
    assert len(results.problems) == 1


@pytest.mark.parametrize(
    ('measure', 'words'),
    [
        (lambda r: r.square('square', Square(0.1, 0.1, 1e-4, 4e-3)), '4.0 mm off its line'),
        (
            lambda r: r.square('square', Square(0.1, 0.11, 1e-4, 1e-4, limited='x')),
            'instead of 0.100 m/s',
        ),
        (lambda r: r.square('square', Square(0.1, 0.09, 1e-4, 1e-4)), 'instead of 0.100 m/s'),
        (lambda r: r.singularity(0.5, 0.1, 'trapped'), 'came back 0.100 m of 0.500 m; trapped'),
        (lambda r: r.singularity(0.0, 0.0, ''), 'no reason given'),
        (lambda r: r.motion(1.2, 0.01, BusFigures()), '120 % of a limit'),
        (lambda r: r.motion(1.0, 0.4, BusFigures()), '0.400 rad from its set-point'),
    ],
)
def test_each_failure_has_its_reason(measure: object, words: str) -> None:
    """Whatever is beyond its bound ends the demo with an error that says it."""
    results = MotionResults()
    assert callable(measure)
    measure(results)
    (problem,) = results.problems
    assert words in problem


def test_an_arm_that_may_not_be_as_quick_has_done_well() -> None:
    """Without a file of limits its accelerations are low; the servo says so."""
    results = MotionResults()
    slow = Square(0.1, 0.07, 1e-4, 1e-4, limited='joint acceleration: elbow, 0.7x')
    results.square('square', slow)
    assert results.problems == []
    assert 'allow no more: joint acceleration: elbow' in results.lines()[0]

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The motor behind its demand: closed form against numerical integration, and its laws."""

from __future__ import annotations

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from canopen_sim import ServoModel
from canopen_sim.drive.axis import Axis
from canopen_sim.drive.profile import (
    Limits,
    Motion,
    plan_line,
    plan_move,
    plan_velocity,
    Point,
    Segment,
)
from canopen_sim.drive.servo import Servo

MODEL = ServoModel(lag=0.004, coasting=0.03)


def integrate(motion: Motion, speed: float, end: float, step: float = 1e-5) -> tuple[float, float]:
    """Return limiter output and motor position by small steps (the definition, literally)."""
    limiter = motor = motion.segments[0].position
    time = 0.0
    while time < end:
        time += step
        gap = motion.at(time).position - limiter
        limiter += math.copysign(min(abs(gap), speed * step), gap)
        motor += (limiter - motor) / MODEL.lag * step
    return limiter, motor


def follow(motion: Motion, speed: float, times: list[float]) -> Servo:
    """Return a servo that followed a motion, looking at it at some times."""
    servo = Servo(MODEL)
    servo.position = motion.segments[0].position
    servo.power_on()
    before = 0.0
    for time in times:
        servo.follow(motion, before, time, speed)
        before = time
    return servo


CASES = {
    'slow line': (plan_line(0.0, 10.0, 0.1, 0.0), 1000.0),
    'steep line': (plan_line(0.0, 100.0, 0.01, 0.0), 1000.0),
    'there and back': (
        Motion(
            (
                Segment(0.0, 0.0, 5000.0, 0.0),
                Segment(0.02, 100.0, -5000.0, 0.0),
                Segment(0.04, 0.0, 0.0, 0.0),
            )
        ),
        1000.0,
    ),
    'trapezoid within the speed': (
        plan_move(Point(0.0, 0.0, 0.0), 50.0, Limits(900.0, 20_000.0, 20_000.0), 0.0),
        1000.0,
    ),
    'trapezoid beyond the speed': (
        plan_move(Point(0.0, 0.0, 0.0), 50.0, Limits(2000.0, 50_000.0, 30_000.0), 0.0),
        1000.0,
    ),
    'ramp through the speed and back': (
        Motion(
            (
                Segment(0.0, 0.0, 0.0, 100_000.0),
                Segment(0.03, 45.0, 3000.0, -100_000.0),
                Segment(0.06, 90.0, 0.0, 0.0),
            )
        ),
        1000.0,
    ),
    'reversal beyond the speed': (
        plan_velocity(Point(0.0, 2000.0, 0.0), -2000.0, Limits(3000.0, 60_000.0, 60_000.0), 0.0),
        1000.0,
    ),
    'no limit': (plan_line(0.0, 100.0, 0.01, 0.0), math.inf),
}


@pytest.mark.parametrize('name', CASES)
@pytest.mark.parametrize('end', [0.005, 0.021, 0.05, 0.12])
def test_closed_form_is_the_integral(name: str, end: float) -> None:
    """The solution in closed form agrees with small steps, in one look as in many."""
    motion, speed = CASES[name]
    limiter, motor = integrate(motion, speed, end)
    for times in ([end], [end * k / 7 for k in range(1, 8)]):
        servo = follow(motion, speed, times)
        # small steps are late by half a step on the steepest demand, 10,000 inc/s
        assert servo.setpoint == pytest.approx(limiter, abs=0.2)
        assert servo.position == pytest.approx(motor, abs=0.2)


@given(
    times=st.lists(st.floats(0.0, 0.2), max_size=12),
    name=st.sampled_from(sorted(CASES)),
)
def test_looking_changes_nothing(times: list[float], name: str) -> None:
    """How often a motor is looked at has no influence on where it is."""
    motion, speed = CASES[name]
    once = follow(motion, speed, [0.2])
    often = follow(motion, speed, [*sorted(times), 0.2])
    assert often.position == pytest.approx(once.position, abs=1e-4)
    assert often.velocity == pytest.approx(once.velocity, abs=0.1)


@settings(max_examples=50)
@given(
    targets=st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=8),
    speed=st.floats(10.0, 1e4),
)
def test_motor_is_never_faster_than_its_speed(targets: list[float], speed: float) -> None:
    """Whatever jumps the set-points make, the motor keeps its speed, and arrives in the end."""
    axis = Axis(MODEL)
    axis.speed = speed
    axis.power_on(1e5)
    for target in targets:
        axis.follow(plan_line(axis.demand.position, target, 0.01, axis.time))
        for _ in range(5):
            before = axis.position
            axis.advance(axis.time + 0.004)
            assert abs(axis.velocity) <= speed * (1.0 + 1e-6)
            assert abs(axis.position - before) <= speed * 0.004 * (1.0 + 1e-6) + 1e-6
    axis.advance(axis.time + 1e5 / speed)
    assert axis.settled
    assert axis.position == pytest.approx(targets[-1], abs=1e-3)
    assert not axis.speed_limited


def test_following_error_at_speed() -> None:
    """At constant velocity the motor lags by velocity times lag."""
    axis = Axis(MODEL)
    axis.power_on(1e5)
    axis.follow(plan_velocity(axis.demand, 1000.0, Limits(1e9, 1e4, 1e4), 0.0))
    axis.advance(1.0)
    assert axis.following_error == pytest.approx(1000.0 * MODEL.lag)
    assert axis.velocity == pytest.approx(1000.0)


def test_coasting() -> None:
    """Without power the motor runs velocity times time constant further, and then rests."""
    axis = Axis(MODEL)
    axis.power_on(1e5)
    axis.follow(plan_velocity(axis.demand, 1000.0, Limits(1e9, 1e4, 1e4), 0.0))
    axis.advance(1.0)
    position = axis.position
    axis.power_off()
    assert not axis.settled
    for _ in range(100):
        axis.advance(axis.time + 0.01)
    assert axis.settled
    assert axis.velocity == 0.0
    assert axis.position - position == pytest.approx(1000.0 * MODEL.coasting, abs=0.01)


def test_stop_begins_at_the_motor_when_the_demand_ran_away() -> None:
    """A stop while the demand is far ahead ends near the motor, not at the demand."""
    axis = Axis(MODEL)
    axis.speed = 1000.0
    axis.power_on(1e5)
    axis.follow(plan_line(0.0, 1e6, 0.01, 0.0))
    axis.advance(0.1)
    position = axis.position
    axis.stop(10_000.0)
    axis.advance(2.0)
    assert axis.settled
    assert axis.position - position == pytest.approx(1000.0**2 / 20_000.0 + 4.0, abs=1.0)


def test_shift_moves_the_zero_only() -> None:
    """A shift changes positions, and neither velocity nor following error."""
    axis = Axis(MODEL)
    axis.power_on(1e5)
    axis.follow(plan_velocity(axis.demand, 1000.0, Limits(1e9, 1e4, 1e4), 0.0))
    axis.advance(1.0)
    before = (axis.position, axis.velocity, axis.following_error)
    axis.shift(500.0)
    assert axis.position == pytest.approx(before[0] + 500.0)
    assert (axis.velocity, axis.following_error) == pytest.approx(before[1:])
    axis.advance(1.1)
    assert axis.velocity == pytest.approx(1000.0)


def test_time_does_not_go_back() -> None:
    """An earlier time is ignored."""
    axis = Axis(MODEL)
    axis.power_on(1e5)
    axis.advance(5.0)
    axis.advance(4.0)
    assert axis.time == 5.0

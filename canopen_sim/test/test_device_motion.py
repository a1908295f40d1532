# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the simulated axis and of motion in every mode, whatever the master says."""

from __future__ import annotations

import math

from device_rig import ENABLE, FAULT_RESET, Rig, SHUTDOWN, SWITCH_ON
from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from canopen_sim import Fault, ServoModel
from canopen_sim.drive.axis import Axis, Limits

pytestmark = pytest.mark.slow

MODEL = ServoModel(lag=0.004, coasting=0.03)

rates = st.floats(1.0, 1e6)
limits = st.builds(Limits, st.floats(1.0, 1e5), rates, rates)
places = st.floats(-1e6, 1e6).map(lambda value: round(value, 6))
velocities = st.floats(-1e5, 1e5).map(lambda value: round(value, 6))


def axis_at(demand: float = 0.0, velocity: float = 0.0, time: float = 1000.0) -> Axis:
    """Return an axis with torque whose demand is in motion, at a time of a steady clock."""
    axis = Axis(MODEL)
    axis.advance(time)
    axis.power_on(1.0)
    axis.shift(demand)
    axis.demand_velocity = velocity
    return axis


def duration_of(axis: Axis) -> float:
    """Return how long a motion takes, from phase to phase."""
    begin = axis.time
    for _ in range(20):
        if axis.arrived:
            return axis.time - begin
        axis.advance(axis.phase_end)
    raise AssertionError('the demand does not arrive')


@given(places, velocities, places, limits, st.lists(st.floats(0.0, 1.0), max_size=6))
def test_a_move_keeps_its_limits_and_ends_at_its_target(
    start: float, velocity: float, target: float, bounds: Limits, looks: list[float]
) -> None:
    """From any state, and however often it is looked at, no faster and no steeper than allowed."""
    whole = axis_at(start, velocity)
    whole.move(target, bounds)
    duration = duration_of(whole)
    assert (whole.demand, whole.demand_velocity) == (target, 0.0)
    axis = axis_at(start, velocity)
    axis.move(target, bounds)
    begin, fastest = axis.time, max(bounds.velocity, abs(velocity)) * (1.0 + 1e-9)
    steepest = max(bounds.acceleration, bounds.deceleration)
    for look in sorted(looks):
        before, place, time = axis.demand_velocity, axis.demand, axis.time
        axis.advance(begin + look * duration)
        passed = axis.time - time
        rounding = 1e-9 * (abs(start) + abs(target)) + 1e-9 * fastest + 1e-3
        assert abs(axis.demand_velocity) <= fastest
        grows = abs(axis.demand_velocity) > abs(before)
        rate = bounds.acceleration if grows else bounds.deceleration
        if before * axis.demand_velocity < 0.0:  # it has turned, by either
            rate = steepest
        assert abs(axis.demand_velocity - before) <= rate * passed * (1.0 + 1e-6) + 1e-3
        assert abs(axis.demand - place) <= fastest * passed + rounding
    # a look rounds times, and what is left of a distance is gone again at the lowest rate
    rest = (
        1e-3
        + 2.0 * math.sqrt(1e-3 / bounds.deceleration)
        + 2.0 * math.sqrt(1e-3 / bounds.acceleration)
    )
    duration_of(axis)
    assert axis.demand == target
    assert axis.time - begin <= duration * (1.0 + 1e-6) + rest


@given(places, velocities, places, st.builds(Limits, st.floats(1.0, 1e7), rates, rates))
def test_a_move_ends_on_a_clock_of_months(
    start: float, velocity: float, target: float, bounds: Limits
) -> None:
    """Where times are rounded to 2 ns, phases that are shorter do not repeat for ever."""
    axis = axis_at(start, velocity, time=2e7)
    axis.move(target, bounds)
    duration_of(axis)
    assert (axis.demand, axis.demand_velocity) == (target, 0.0)


@given(st.lists(st.floats(0.0, 0.2), max_size=12), st.sampled_from([math.inf, 1000.0]))
def test_looking_changes_nothing(looks: list[float], speed: float) -> None:
    """How often a motor is looked at has no influence on where it is."""
    once, often = axis_at(), axis_at()
    for axis in (once, often):
        axis.speed = speed
        axis.move(120.0, Limits(3000.0, 50_000.0, 30_000.0))
    begin = once.time
    for look in sorted(looks):
        often.advance(begin + look)
    for axis in (once, often):
        axis.advance(begin + 0.1)
        axis.advance(max(begin + 0.1, often.time))
    once.advance(often.time)
    # the rate limiter works in steps of 1 ms, which begin where the looks are; at rest the motor
    # is said to stand at its demand when it is nearer than 0.0001 inc
    slack = 1e-4 if math.isinf(speed) else 1.0
    assert often.position == pytest.approx(once.position, abs=slack)


@pytest.mark.parametrize('speed', [math.inf, 1000.0])
@pytest.mark.parametrize('target', [10.0, 100.0])
def test_the_motor_follows_by_its_definition(target: float, speed: float) -> None:
    """Rate limiter and lag agree with small steps of their equations."""
    axis = axis_at()
    axis.speed = speed
    axis.line(target, 0.05)
    begin, step = axis.time, 1e-5
    limiter = motor = 0.0
    for number in range(12_000):
        demand = min(target, target * (number + 1) * step / 0.05)
        gap = demand - limiter
        limiter += math.copysign(min(abs(gap), speed * step), gap)
        motor += (limiter - motor) / MODEL.lag * step
        if number % 1000 == 999:
            axis.advance(begin + (number + 1) * step)
            # one step of the limiter, 1 ms at 1000 inc/s
            assert axis.position == pytest.approx(motor, abs=0.1 if math.isinf(speed) else 1.0)


def test_lag_coasting_and_stops() -> None:
    """The motor lags by velocity times lag, coasts by velocity times time, stops at the motor."""
    axis = axis_at()
    axis.ramp(1000.0, Limits(1e9, 1e4, 1e4))
    axis.advance(axis.time + 1.0)
    assert (axis.following_error, axis.velocity) == pytest.approx((1000.0 * MODEL.lag, 1000.0))
    axis.shift(500.0)
    assert (axis.following_error, axis.velocity) == pytest.approx((1000.0 * MODEL.lag, 1000.0))
    place = axis.position
    axis.power_off()
    axis.advance(axis.time + 1.0)
    axis.advance(axis.time - 5.0)  # earlier times are ignored
    assert (axis.settled, axis.velocity) == (True, 0.0)
    assert axis.position - place == pytest.approx(1000.0 * MODEL.coasting, abs=0.01)
    axis.power_on(1.0)
    axis.speed = 1000.0
    axis.line(1e6, 0.01)  # a demand that runs away
    axis.advance(axis.time + 0.1)
    place = axis.position
    axis.stop(10_000.0)
    axis.advance(axis.time + 2.0)
    assert axis.settled
    assert axis.position - place == pytest.approx(1000.0**2 / 20_000.0 + 4.0, abs=1.5)


SPEED = 3000.0  # [inc/s] 0x607F, the highest of all
STEP = 0.005  # [s]
MODES = st.sampled_from([0, 1, 2, 3, 4, 6, 7, 8, 9, 10])
WORDS = st.sampled_from(
    [
        *(ENABLE | bits for bits in (0, 0, 0x10, 0x30, 0x50, 0x70, 0x100, 0x210)),
        SHUTDOWN,
        SWITCH_ON,
        0x02,
        0x00,
        FAULT_RESET,
    ]
)
TARGETS = st.tuples(
    st.sampled_from([(0x607A, 0), (0x60FF, 0), (0x6071, 0), (0x6042, 0), (0x60C1, 1)]),
    st.integers(-3000, 3000),
)
STOPS = st.floats(-2000.0, 2000.0)
ACTIONS = st.one_of(
    st.tuples(st.just('mode'), MODES),
    st.tuples(st.just('word'), WORDS),
    st.tuples(st.just('word'), st.just(ENABLE)),
    st.tuples(st.just('target'), TARGETS),
    st.tuples(
        st.just('fault'), st.sampled_from([fault for fault in Fault if fault.value.of_drive])
    ),
    st.tuples(st.just('block'), STOPS),
    st.tuples(st.just('load'), st.floats(-500.0, 500.0)),
    st.tuples(st.just('method'), st.sampled_from([1, 8, 17, 24, 33, 35])),
    st.tuples(st.just('sync'), st.integers(1, 5)),
)


def perform(rig: Rig, kind: str, value: object) -> None:
    """Do one of the things that a master or the world can do."""
    match kind, value:
        case 'mode', int(mode):
            rig.put(0x6060, mode)
        case 'word', int(word):
            rig.command(word)
        case 'target', ((int(index), int(subindex)), int(target)):
            rig.put(index, target, subindex)
        case 'fault', Fault() as fault:
            rig.inject(fault, duration=9.0)
            rig.cure(fault)
        case 'block', float(place):
            rig.drive.block(place, rig.now)
            rig.drive.release(rig.now)
        case 'load', float(torque):
            rig.drive.set_load(torque, rig.now)
        case 'method', int(method):
            rig.put(0x6098, method)
        case 'sync', int(count):
            rig.cycles(count)


@settings(max_examples=80, deadline=None)
@given(st.lists(ACTIONS, min_size=5, max_size=25))
def test_motor_never_jumps(actions: list[tuple[str, object]]) -> None:
    """Over any sequence of modes, commands, faults and loads the motor moves at most at its speed.

    Homing renames positions; the mechanical position does not notice.
    """
    rig = Rig()
    rig.put(0x607F, int(SPEED))
    rig.put(0x6065, 0xFFFFFFFF)
    rig.command(SHUTDOWN, SWITCH_ON, ENABLE)
    place, time = 0.0, rig.now
    for kind, value in actions:
        perform(rig, kind, value)
        for _ in range(4):
            rig.run(STEP)
            moved = rig.position - rig.drive.origin
            assert abs(moved - place) <= SPEED * (rig.now - time) + 1e-3
            assert abs(rig.velocity) <= SPEED + 1e-3
            place, time = moved, rig.now


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from([(3, 0x60FF), (2, 0x6042)]),
    st.lists(st.tuples(st.integers(-2500, 2500), st.floats(0.01, 0.4)), min_size=1, max_size=10),
    st.integers(2000, 20_000),
)
def test_velocity_never_ramps_faster_than_its_profile(
    mode: tuple[int, int], commands: list[tuple[int, float]], ramp: int
) -> None:
    """In PV and VL the velocity keeps to its ramps, over random targets and halts."""
    rig = Rig()
    number, target = mode
    rig.put(0x6083, ramp)
    rig.put(0x6084, ramp)
    rig.put(0x6048, ramp, 1)
    rig.put(0x6049, ramp, 1)
    rig.enable(number)
    rig.command(ENABLE | 0x70)
    last = 0.0
    for value, duration in commands:
        rig.put(target, value)
        for _ in range(int(duration / STEP)):
            rig.run(STEP)
            velocity = rig.velocity
            assert abs(velocity - last) <= ramp * STEP + 0.1
            assert abs(velocity) <= 2500.1
            last = velocity
        rig.command(ENABLE | 0x70 | 0x100 * (value % 3 == 0))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.integers(-2000, 2000), st.booleans()), min_size=1, max_size=8))
def test_acknowledged_set_points_are_not_lost(setpoints: list[tuple[int, bool]]) -> None:
    """Each set-point that was acknowledged and not replaced at once is gone to, in its order."""
    rig = Rig()
    rig.put(0x6081, 5000)
    rig.enable(1)
    rig.run(0.05)
    expected: list[int] = []
    seen: list[float] = [rig.position]

    def watch(duration: float) -> None:
        for _ in range(int(duration / STEP)):
            rig.run(STEP)
            seen.append(rig.position)

    for target, blend in setpoints:
        rig.put(0x607A, target)
        rig.command(ENABLE | 0x10 | (0x200 if blend else 0))
        assert rig.statusword & 0x1000
        expected.append(target)
        rig.command(ENABLE)
        for _ in range(1000):
            if not rig.statusword & 0x1000:
                break
            watch(STEP)
    watch(2.0)
    assert abs(rig.position - expected[-1]) < 0.01
    passed = 0
    for target in expected:
        while not _between(seen, passed, target):
            passed += 1
            assert passed < len(seen), (target, expected)


def _between(seen: list[float], at: int, target: int) -> bool:
    """Return whether the motor was at a target from one look to the next."""
    after = seen[min(at + 1, len(seen) - 1)]
    return min(seen[at], after) - 1.0 <= target <= max(seen[at], after) + 1.0

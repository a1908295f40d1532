# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rates, gravity, times and plausibility: laws over random motions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
import math
import re
import subprocess
import sys
from typing import Any

from hypothesis import example, given
from hypothesis import strategies as st
import pytest

from quad_description import movable_joints, robot_urdf
from quad_description.rotations import (
    about_z,
    conjugate,
    down_in_body,
    from_rpy,
    IDENTITY,
    multiply,
    Quaternion,
    rotate,
    Vector,
)
from quad_hardware.estimation import Estimator, EstimatorSettings, ImuMounting, RateSource
from quad_hardware.filters import (
    AttitudeRate,
    CHARGE_REPORTS,
    FULL,
    gravity_from_acceleration,
    GravityCheck,
    JointRate,
    MedianFilter,
)
from quad_hardware.joints import JointMap, servo_of
from quad_hardware.protocol import Fault, LEG_MOTORS
from quad_hardware.report import (
    BoardWatch,
    check_torque_off,
    CONFIRMATIONS,
    DELAY,
    DEVICE_TIME_WRAP,
    FAULT_TEXTS,
    MAX_REFUSALS,
    NO_LOAD,
    Plausibility,
    Report,
    SampleClock,
    ServoWatch,
    TIMEOUT,
    TorqueOffResult,
)

ASKED, SENT = 10.0, 10.01  # [s]
LATE = ASKED + TIMEOUT
LIMP = dict.fromkeys(LEG_MOTORS, 0.0)
STATE = Report(
    arrival=0.0, wire_time=0.00127, attitude=(0.0, 0.0, 0.0), acceleration=(0.0, 0.0, 9.8),
    positions=LIMP, velocities=LIMP,
)  # fmt: skip


WEAK = {motor: 0.0 for motor in LEG_MOTORS if motor != 11}  # one does not report
R = TorqueOffResult


@pytest.mark.parametrize(
    ('loads', 'found', 'in_the_end'),
    [
        (LIMP, R.LIMP, R.LIMP),
        ({**LIMP, 11: -NO_LOAD}, R.LIMP, R.LIMP),
        ({**LIMP, 11: -12.0}, None, R.PULLS),
        ({**LIMP, 99: 12.0}, R.LIMP, R.LIMP),
        (WEAK, None, R.UNKNOWN),
        (dict.fromkeys(WEAK, 12.0), None, R.PULLS),
        (None, R.NOT_REPORTED, R.NOT_REPORTED),
        ({}, R.NOT_REPORTED, R.NOT_REPORTED),
    ],
)
def test_a_report_after_torque_off_shows_what_became_of_it(
    loads: Mapping[int, float] | None, found: R | None, in_the_end: R
) -> None:
    """Servos that pull may still let go; one that is not reported is not known to have.

    What was not sent let no servo go, whatever is reported meanwhile.
    """
    report = replace(STATE, loads=loads, arrival=SENT + DELAY + 2.0 * STATE.wire_time)
    assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, report.arrival) is found
    assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, LATE) is in_the_end
    assert check_torque_off(report, LEG_MOTORS, ASKED, None, report.arrival) is None
    assert check_torque_off(report, LEG_MOTORS, ASKED, None, LATE) is R.UNSENT
    assert in_the_end.succeeded is (in_the_end in {R.LIMP, R.NOT_REPORTED})


@given(st.floats(-1.0, DELAY + 0.5 * STATE.wire_time), st.sampled_from([LIMP, None]))
def test_a_report_of_before_shows_nothing(after: float, loads: Mapping[int, float] | None) -> None:
    """It was made while the servos held, or may have been on its way when they let go."""
    for report in (replace(STATE, loads=loads, arrival=SENT + after), None):
        assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, SENT + 0.1) is None
        assert check_torque_off(report, LEG_MOTORS, ASKED, SENT, LATE) is R.UNKNOWN
    assert not R.UNSENT.succeeded


ANGLES = st.floats(-3.1, 3.1)
ROTATIONS = st.builds(from_rpy, ANGLES, st.floats(-1.5, 1.5), ANGLES)
URDF = robot_urdf('lite')


def estimator_of(urdf: str = URDF, settings: EstimatorSettings | None = None) -> Estimator:
    """Make the estimator of a robot."""
    joints = JointMap(map(servo_of, movable_joints(urdf)))
    return Estimator(urdf, joints, settings or EstimatorSettings())


def spun(rate: Vector, time: float) -> Quaternion:
    """The rotation that a constant body rate makes."""
    speed = math.hypot(*rate)
    if speed < 1e-9:
        return IDENTITY
    x, y, z = (component / speed * math.sin(speed * time / 2) for component in rate)
    return x, y, z, math.cos(speed * time / 2)


@pytest.mark.parametrize(
    ('mounting', 'gyro', 'source', 'checked'),
    [
        (ImuMounting(), None, RateSource.AUTO, False),
        (ImuMounting(checked=True), None, RateSource.AUTO, True),
        (ImuMounting(checked=True), (0.0, 0.0, 0.0), RateSource.AUTO, False),
        (ImuMounting(checked=True), (0.0, 0.0, 0.0), RateSource.DIFFERENTIATED, True),
        (ImuMounting(checked=True, rates_checked=True), (0.0, 0.0, 0.0), RateSource.AUTO, True),
        (ImuMounting(rates_checked=True), (0.0, 0.0, 0.0), RateSource.AUTO, False),
    ],
)
def test_signs_are_checked_when_those_of_the_gyro_are(
    mounting: ImuMounting, gyro: Vector | None, source: RateSource, checked: bool
) -> None:
    """Where a gyro is reported and used, gravity alone proves nothing about it."""
    settings = EstimatorSettings(angular_velocity_source=source, mounting=mounting)
    state = estimator_of(settings=settings).step(replace(STATE, rates=gyro))
    assert state is not None
    assert state.imu is not None
    assert state.imu.is_uncertain is not checked


@given(ROTATIONS, st.tuples(*[st.floats(-4, 4)] * 3))
def test_a_constant_rate_is_found_from_any_attitude(start: Quaternion, rate: Vector) -> None:
    """In the frame of the body, through every wrap of yaw, once the filter has settled."""
    estimate = AttitudeRate(cutoff=12.0)
    for tick in range(30):
        found = estimate.update(tick * 0.02, multiply(start, spun(rate, tick * 0.02)))
    assert found == pytest.approx(rate, abs=1e-4)


def test_after_a_gap_the_rate_begins_at_rest() -> None:
    """A robot that was carried while it was silent did not spin; nor does time run backwards."""
    rates = AttitudeRate(cutoff=12.0)
    rates.update(0.0, IDENTITY)
    assert rates.update(0.02, about_z(0.1))[2] > 1.0
    assert rates.update(1.0, about_z(3.0)) == (0.0, 0.0, 0.0)
    assert rates.update(0.9, about_z(0.0)) == (0.0, 0.0, 0.0)
    joints = JointRate(cutoff=12.0)
    joints.update(0.0, {'a': 0.0})
    assert joints.update(0.02, {'a': 0.1})['a'] > 1.0
    assert joints.update(1.0, {'a': 9.0}) == {'a': 0.0}
    assert joints.update(1.02, {'b': 1.0}) == {'b': 0.0}


@pytest.mark.parametrize(
    ('period', 'worst', 'trot'), [(0.02, 0.2, 0.5), (0.038, 0.35, 1.3)], ids=['50 Hz', '26 Hz']
)
def test_differentiated_velocities_know_their_error(
    period: float, worst: float, trot: float
) -> None:
    """A joint that swings at 2.5 Hz in bytes: near its velocity, and the error is no surprise."""
    step, turn = math.radians(160.0) / 255, 5.0 * math.pi
    rates, errors, speeds = JointRate(cutoff=25.0), [], []
    for count in range(400):
        time = count * period
        place = round(0.3 * math.sin(turn * time) / step) * step
        speeds.append(0.3 * turn * math.cos(turn * time))
        errors.append(rates.update(time, {'a': place})['a'] - speeds[-1])
    square = sum(error * error for error in errors[5:])
    error = math.sqrt(square / len(errors[5:]))
    assert error < worst * math.sqrt(sum(speed * speed for speed in speeds) / len(speeds))
    assert max(0.8 * error, 0.95 * trot) < rates.error < 1.6 * max(error, trot)


@given(ROTATIONS)
def test_both_directions_of_gravity_agree_at_rest(attitude: Quaternion) -> None:
    """An accelerometer at rest reads upwards, so gravity is its opposite."""
    felt = rotate(conjugate(attitude), (0.0, 0.0, 9.8))
    assert gravity_from_acceleration(felt) == pytest.approx(down_in_body(attitude))
    assert check([(attitude, felt)] * 50) == pytest.approx(0.0, abs=1e-6)


def test_the_pushes_of_a_gait_are_no_disagreement() -> None:
    """A push is no tilt, and only what lasts for a second is one; before, nothing is said."""
    assert gravity_from_acceleration((9.0, 0.0, 9.8)) is None
    assert down_in_body(IDENTITY) == (0.0, 0.0, -1.0)
    steps = [(IDENTITY, (4.0 * (-1) ** (n // 5), 0.0, 9.8)) for n in range(50)]
    assert check(steps[:49]) is None
    assert check(steps) == pytest.approx(0.0, abs=1e-6)
    assert check([(IDENTITY, (9.0, 0.0, 9.8))] * 50) is None
    swapped = [(IDENTITY, (9.8, 0.0, 0.0))] * 50
    assert check(swapped) == pytest.approx(math.pi / 2)


def check(reports: list[tuple[Quaternion, Vector]]) -> float | None:
    """Return what a check finds in reports."""
    gravity = GravityCheck()
    for attitude, felt in reports:
        gravity.take(attitude, felt)
    return gravity.error


@given(st.lists(st.floats(0.0, 0.01), min_size=2, max_size=60))
def test_the_clock_of_the_robot_takes_the_jitter_away(delays: list[float]) -> None:
    """Steps are those of the robot, and no report is dated after its arrival."""
    clock, times = SampleClock(), []
    start = DEVICE_TIME_WRAP - 0.1  # the counter wraps on the way
    for tick, delay in enumerate(delays):
        made = tick * 0.02
        arrival = made + delay + STATE.wire_time
        device = round((start + made) % DEVICE_TIME_WRAP, 3)
        times.append(clock.time(replace(STATE, arrival=arrival, device_time=device)))
        assert times[-1] <= arrival - STATE.wire_time + 1e-9
    quickest = min(range(len(delays)), key=delays.__getitem__)
    steps = [b - a for a, b in zip(times[quickest:], times[quickest + 1 :], strict=False)]
    assert all(abs(step - 0.02) < 1e-5 + 1e-3 for step in steps)


def test_a_report_that_is_held_up_is_no_restart_of_the_board() -> None:
    """On the way it may lie for most of a second; a clock that is further off began anew.

    From then on it is dated anew; without a counter, the arrival counts.
    """
    watch, clock = BoardWatch(), SampleClock()
    times = [(0.0, 50.0), (0.02, 50.02), (0.54, 50.04), (2.06, 50.06)]
    states = [replace(STATE, arrival=arrival, device_time=device) for arrival, device in times]
    assert [watch.restarted(state) for state in states] == [False, False, False, True]
    clock.time(states[0])
    begun = replace(STATE, arrival=1.0, device_time=0.5)
    assert clock.time(begun) == pytest.approx(1.0 - STATE.wire_time)
    assert clock.time(replace(STATE, arrival=5.0)) == 5.0 - STATE.wire_time / 2


@given(st.floats(-60.0, 60.0).filter(lambda error: abs(error) > 0.101))
def test_a_damaged_clock_ages_no_other_report(error: float) -> None:
    """The report is refused; and where it was the first after a pause, the rest gets over it."""
    plausibility, clock = Plausibility(LEG_MOTORS), SampleClock()
    ages = []
    for tick in range(60):
        time = 10.0 + tick * 0.02
        wrong = error if tick == 10 else 0.0
        state = replace(STATE, arrival=time, device_time=70.0 + tick * 0.02 + wrong)
        assert bool(plausibility.check(state)) is (tick == 10)
        ages.append(time - clock.time(state))
    assert max(ages[40:]) < 0.003
    assert min(ages) >= 0.0


def test_reports_that_were_held_up_keep_their_times() -> None:
    """All of a pause come at once; the clock of the robot still shows when they were made."""
    plausibility, clock = Plausibility(LEG_MOTORS), SampleClock()
    for tick in range(100):
        made = tick * 0.02
        arrival = 0.8 if 0.4 < made < 0.8 else made
        state = replace(STATE, arrival=arrival + STATE.wire_time, device_time=made)
        assert plausibility.check(state) == ''
        assert clock.time(state) == pytest.approx(made, abs=1e-3)


def test_one_damaged_report_does_not_empty_the_battery() -> None:
    """Nor a charge that cannot be; a battery that is low is reported within half a second."""
    charge = MedianFilter()
    assert charge.take(None, FULL) is None
    assert [charge.take(value, FULL) for value in (80.0, 80.0, 3.0, 200.0, 80.0)] == [80.0] * 5
    assert [charge.take(5.0, FULL) for _ in range(CHARGE_REPORTS)][-1] == 5.0


@pytest.mark.parametrize(
    'change',
    [
        {'attitude': (0.0, 1e9, 0.0)},
        {'attitude': (0.0, math.nan, 0.0)},
        {'acceleration': (0.0, 0.0, 3e4)},
        {'acceleration': (math.inf, 0.0, 0.0)},
        {'rates': (0.0, 0.0, math.nan)},
    ],
)
def test_a_dead_imu_is_no_reason_to_refuse_the_joints(
    change: dict[str, tuple[float, float, float]],
) -> None:
    """A damaged frame is refused; an IMU that stays so is of no use, and its joints count."""
    plausibility = Plausibility(LEG_MOTORS)
    assert plausibility.check(STATE) == ''
    dead = [replace(STATE, arrival=0.02 * tick, **change) for tick in range(1, 20)]  # type: ignore[arg-type]
    answers = [bool(plausibility.check(state)) for state in dead]
    assert answers == [True] * MAX_REFUSALS + [False] * (len(dead) - MAX_REFUSALS)
    assert plausibility.imu_problem
    for _ in range(MAX_REFUSALS + 3):  # joints that cannot be are refused, however often
        assert 'motor 11 at' in plausibility.check(replace(dead[-1], positions={11: 1e5}))
        assert 'motor 12 at' in plausibility.check(replace(dead[-1], velocities={12: -1e5}))
    alive = replace(STATE, arrival=0.5, attitude=(0.0, 0.0, 170.0))
    assert plausibility.check(alive) == ''
    assert not plausibility.imu_problem


@given(st.floats(), st.floats())
def test_a_motor_that_is_not_fitted_may_report_anything(angle: float, speed: float) -> None:
    """The slots of an arm that is not there are nobody's; on a robot that has one they count."""
    garbage = replace(
        STATE, positions={**STATE.positions, 54: angle}, velocities={**STATE.velocities, 52: speed}
    )
    plausibility = Plausibility(LEG_MOTORS)
    assert [plausibility.check(state) for state in (STATE, garbage, STATE)] == [''] * 3
    broken = replace(STATE, positions={**STATE.positions, 54: math.nan})
    assert 'not finite' in Plausibility((*LEG_MOTORS, 54)).check(broken)


def test_a_jump_is_believed_when_it_stays() -> None:
    """One damaged report is refused; a robot that really is elsewhere is not."""
    plausibility = Plausibility(LEG_MOTORS)
    plausibility.check(STATE)
    jumped = replace(STATE, positions=dict.fromkeys(LEG_MOTORS, 90.0))
    answers = [bool(plausibility.check(jumped)) for _ in range(MAX_REFUSALS + 2)]
    assert answers == [True] * MAX_REFUSALS + [False] * 2
    turned = replace(jumped, attitude=(0.0, 0.0, 179.0))
    assert 'attitude' in plausibility.check(turned)
    later = replace(turned, arrival=1.0)
    assert plausibility.check(later) == ''
    wrapped = replace(turned, arrival=1.02, attitude=(0.0, 0.0, -179.0))
    assert plausibility.check(wrapped) == ''


@given(st.floats(-180.0, 180.0), st.floats(-180.0, 180.0), st.floats(88.0, 90.0))
@example(0.0, 170.0, 90.0)
def test_an_attitude_nose_up_is_no_jump(roll: float, other: float, pitch: float) -> None:
    """Roll and yaw may leap there from one report to the next, and the body hardly turns."""
    plausibility = Plausibility(LEG_MOTORS)
    plausibility.check(replace(STATE, attitude=(roll, pitch, 0.0)))
    leapt = replace(STATE, arrival=0.02, attitude=(other, pitch, other - roll))
    assert plausibility.check(leapt) == ''


@pytest.mark.parametrize(
    ('wrong', 'words'),
    [
        ({'faults': Fault.SERVO_SILENT}, 'servo silent'),
        ({'faults': Fault.OVERHEATED}, 'overheated'),
        ({'temperatures': {12: 74.0}}, 'motor 12 above 70 degrees'),
        ({'temperatures': {99: 74.0}}, ''),
        ({'faults': 1}, ''),
    ],
)
def test_servos_that_carry_no_longer_are_a_problem_of_the_robot(
    wrong: dict[str, Any], words: str
) -> None:
    """When several reports in a row say so, until as many say otherwise."""
    estimator, said = estimator_of(), []
    for tick, is_wrong in enumerate((0, 1, 1, 0, 1, 1, 1, 0, 1, 0, 0, 1, 0, 0, 0, 0)):
        state = estimator.step(replace(STATE, arrival=0.02 * tick, **(wrong if is_wrong else {})))
        assert state is not None
        said.append(state.servo_problem)
    assert [words in each for each in said if each] == [True] * 8 * bool(words)
    assert [bool(each) for each in said[6:14]] == [bool(words)] * 8


SERVO_FAULTS = (Fault.OVERLOAD, Fault.OVERHEATED, Fault.SERVO_SILENT)
SERVO_REPORTS = st.builds(
    lambda faults, felt: replace(STATE, faults=faults, temperatures=felt),
    st.integers(0, 31),
    st.dictionaries(st.sampled_from(LEG_MOTORS), st.floats(20.0, 90.0)),
)


@given(
    st.sampled_from(SERVO_FAULTS),
    st.lists(SERVO_REPORTS, max_size=6),
    st.lists(SERVO_REPORTS, min_size=CONFIRMATIONS, max_size=CONFIRMATIONS),
)
def test_a_servo_fault_is_confirmed_whatever_the_others_do(
    fault: Fault, before: list[Report], during: list[Report]
) -> None:
    """A bit in each of some reports in a row is a problem; out of each of them, it is none."""
    watch = ServoWatch(LEG_MOTORS)
    for report in before:
        watch.check(report)
    said = [watch.check(replace(report, faults=report.faults | fault)) for report in during]
    assert FAULT_TEXTS[fault] in said[-1]
    said = [watch.check(replace(report, faults=report.faults & ~fault)) for report in during]
    assert FAULT_TEXTS[fault] not in said[-1]


def test_a_hot_servo_stays_hot_until_it_is_cool() -> None:
    """Though it is below what made it so, and whatever another does."""
    watch, said = ServoWatch(LEG_MOTORS), ''
    for temperature, hot in ((65.0, False), (71.0, True), (61.0, True), (60.0, False)):
        for _ in range(CONFIRMATIONS):
            said = watch.check(replace(STATE, temperatures={12: 72.0, 42: temperature}))
        assert re.search(r'servo of motor [\d, ]*\b12\b', said)
        assert (re.search(r'servo of motor [\d, ]*\b42\b', said) is not None) is hot


def test_a_joint_that_is_not_reported_is_where_it_was_sent() -> None:
    """Protocol v1 reports one servo of the arm not; the state says which joint that is."""
    urdf = robot_urdf('lite', arm=True)
    estimator, names = estimator_of(urdf), [joint.name for joint in movable_joints(urdf)]
    targets = [0.01 * place for place in range(len(names))]
    estimator.command(targets[:12])
    estimator.command(targets)
    estimator.command([0.0] * 12)
    state = estimator.step(STATE)
    assert state is not None
    assert state.joints is not None
    assert state.joints.unmeasured == tuple(range(12, len(names)))
    assert state.joints.positions[12:] == tuple(targets[12:])
    assert list(state.joints.measured(names)) == names[:12]


def test_estimation_needs_no_serial_port() -> None:
    """Recorded reports can be read where pyserial is not installed."""
    program = (
        'import sys; sys.modules["serial"] = None\n'
        'from quad_hardware.estimation import Estimator, EstimatorSettings\n'
        'from quad_hardware.joints import JointMap, servo_of\n'
        'from quad_hardware.report import Report'
    )
    subprocess.run([sys.executable, '-c', program], check=True)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The laws of the wave: it begins where the joint stands, is smooth, and stays within limits."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
import math

from hypothesis import assume, example, given
from hypothesis import strategies as st
import pytest
from urdf_reader import JointRange

from arm_bringup.demos.wave.plan import (
    plan_swing,
    plan_wave,
    quintic_step,
    STEP_CURVATURE,
    STEP_SLOPE,
    stop_duration,
    Swing,
    WaveStyle,
)
from arm_bringup.demos.wave.source import WaveSource, WaveState
from arm_bringup.exceptions import WaveError
from arm_canopen import Refusal, RefusalCause

pytestmark = pytest.mark.slow

CYCLE = 0.01  # [s]
STYLE = WaveStyle()
HALTED = Refusal(RefusalCause.HALTED)


@dataclass(frozen=True)
class Feedback:
    """What a master reports of a drive, as far as the wave looks at it."""

    name: str
    position: float
    setpoint: float
    refusal: Refusal | None = None


class Arm:
    """Drives that follow at once, or not at all; keeps every set-point."""

    def __init__(self, limits: list[JointRange], starts: list[float]) -> None:
        phases = [0.9 * i for i in range(len(limits))]
        pairs = zip(limits, phases, strict=True)
        self.swings = [plan_swing(each, phase, STYLE) for each, phase in pairs]
        self.source = WaveSource(self.swings, STYLE)
        self.held: set[str] = set()
        self.tracks = {
            swing.name: [start] for swing, start in zip(self.swings, starts, strict=True)
        }

    def run(self, duration: float) -> None:
        """Go on for some time in [s]."""
        for _ in range(round(duration / CYCLE)):
            feedback = [
                Feedback(name, track[-1], track[-1], HALTED if name in self.held else None)
                for name, track in self.tracks.items()
            ]
            setpoints = self.source.update(0.0, CYCLE, feedback)  # type: ignore[arg-type]
            for (name, track), setpoint in zip(self.tracks.items(), setpoints, strict=True):
                follows = setpoint is not None and name not in self.held
                track.append(setpoint if follows and setpoint is not None else track[-1])

    def check(self) -> None:
        """Check the bounds on speed and acceleration by differences, also across phases."""
        for swing in self.swings:
            track = self.tracks[swing.name]
            steps = [b - a for a, b in pairwise(track)]
            turns = [b - a for a, b in pairwise(steps)]
            assert max(map(abs, steps)) <= swing.velocity * CYCLE * (1 + 1e-9)
            assert max(map(abs, turns)) <= STYLE.acceleration * CYCLE**2 * (1 + 1e-6) + 1e-12


limits = st.builds(
    lambda lower, width, velocity: JointRange('', lower, lower + width, velocity),
    st.floats(-7, 7),
    st.floats(0.01, 12),
    st.floats(0.05, 8),
)


def named(plan: list[tuple[JointRange, float]]) -> Arm:
    """Build an arm from limits and starting points that are shares of twice the range."""
    joints = [
        JointRange(f'joint{i}', each.lower, each.upper, each.velocity)
        for i, (each, _) in enumerate(plan)
    ]
    starts = [
        (each.lower + each.upper) / 2 + share * (each.upper - each.lower) for each, share in plan
    ]
    return Arm(joints, starts)


plans = st.lists(st.tuples(limits, st.floats(-1, 1)), min_size=1, max_size=3)


@given(st.floats(0, 1), st.floats(1e-4, 0.1))
@example(0.9999999999999999, 0.0625)
def test_the_step_has_two_continuous_derivatives_within_its_constants(x: float, d: float) -> None:
    """Differences never exceed the greatest slope and curvature, also across its ends."""
    before, here, after = (quintic_step(x + offset) for offset in (-d, 0.0, d))
    assert here <= 1.0
    assert -1e-15 <= after - here <= STEP_SLOPE * d * (1 + 1e-9) + 1e-15
    assert abs(after - 2 * here + before) <= STEP_CURVATURE * d * d * (1 + 1e-6) + 1e-14


@given(plans)
def test_the_first_setpoint_is_where_the_joint_stands(
    plan: list[tuple[JointRange, float]],
) -> None:
    """Nothing jumps: the first cycle moves less than the acceleration allows."""
    arm = named(plan)
    arm.source.start()
    arm.run(CYCLE)
    for track in arm.tracks.values():
        assert track[1] == pytest.approx(track[0], abs=STYLE.acceleration * CYCLE**2)


@given(plans, st.floats(0.1, 20), st.floats(0.1, 12))
def test_speed_and_acceleration_stay_within_the_plan(
    plan: list[tuple[JointRange, float]], stop_after: float, start_after: float
) -> None:
    """Through entry, swing, a stop at any time and a start at any time after it."""
    arm = named(plan)
    arm.source.start()
    arm.run(stop_after)
    arm.source.stop()
    arm.run(start_after)
    arm.source.start()
    arm.run(5.0)
    arm.check()


@given(plans)
def test_positions_stay_between_start_and_swing(plan: list[tuple[JointRange, float]]) -> None:
    """A joint within its limits stays there; one outside goes in and never farther out."""
    arm = named(plan)
    arm.source.start()
    arm.run(15.0)
    for swing, (each, _) in zip(arm.swings, plan, strict=True):
        track = arm.tracks[swing.name]
        assert min(track) >= min(track[0], each.lower) - 1e-12
        assert max(track) <= max(track[0], each.upper) + 1e-12
        late = track[-round(STYLE.period / CYCLE) :]
        if len(track) * CYCLE > swing.entry_duration(track[0], STYLE) + STYLE.period:
            assert max(late) - min(late) == pytest.approx(2 * swing.amplitude, rel=1e-3)
            margin = (1 - STYLE.range_share) * (each.upper - each.lower) / 2
            assert each.lower + margin <= min(late) + 1e-12
            assert max(late) <= each.upper - margin + 1e-12


@given(plans, st.floats(0.1, 12))
def test_a_stop_ends_in_standstill(
    plan: list[tuple[JointRange, float]], stop_after: float
) -> None:
    """After its duration the wave is idle, leaves the drives where they are, and stands still."""
    arm = named(plan)
    arm.source.start()
    arm.run(stop_after)
    arm.source.stop()
    arm.run(arm.source.stop_duration + 2 * CYCLE)
    assert arm.source.report.state is WaveState.IDLE
    for track in arm.tracks.values():
        assert track[-1] == track[-2]
        assert abs(track[-3] - track[-4]) <= STYLE.acceleration * CYCLE**2


def panda() -> Arm:
    """Build the seven joints of the Panda at zero, two of them outside or at their limits."""
    table = [(-2.9, 2.9), (-1.76, 1.76), (-2.9, 2.9), (-3.07, -0.07), (-2.9, 2.9), (-0.02, 3.75)]
    joints = [JointRange(f'joint{i}', *pair, 2.175) for i, pair in enumerate(table)]
    return Arm(joints, [0.0] * len(joints))


def test_a_released_axis_stays_out_and_the_others_go_on() -> None:
    """Until the next start, at which it enters from where it stands then."""
    arm = panda()
    arm.source.start()
    arm.run(8.0)
    arm.source.released('joint1', Refusal(RefusalCause.SINGLE_TARGET))
    arm.run(1.0)
    tracks = arm.tracks
    assert len(set(tracks['joint1'][-90:])) == 1
    assert len(set(tracks['joint0'][-90:])) > 80
    assert [axis.name for axis in arm.source.report.axes if not axis.active] == ['joint1']
    tracks['joint1'][-1:] = [1.5] * 3  # moved elsewhere by someone else, and at rest
    before = len(tracks['joint1'])
    arm.source.start()
    arm.run(3.0)
    tracks['joint1'] = tracks['joint1'][before - 2 :]
    arm.check()
    assert tracks['joint1'][0] == 1.5
    assert len(set(tracks['joint1'])) > 250


def test_an_axis_that_cannot_follow_leaves_by_itself() -> None:
    """It does not come back when it can follow again, only at a start."""
    arm = panda()
    arm.source.start()
    arm.run(1.0)
    arm.held.add('joint2')
    arm.run(0.3)
    arm.held.clear()
    arm.run(0.3)
    assert len(set(arm.tracks['joint2'][-50:])) == 1


def test_a_start_during_a_stop_waits_for_standstill() -> None:
    """And then goes on."""
    arm = panda()
    arm.source.start()
    arm.run(5.0)
    arm.source.stop()
    arm.run(0.2)
    arm.source.start()
    arm.run(0.2)
    states = [arm.source.report.state]
    arm.run(5.0)
    states.append(arm.source.report.state)
    assert states == [WaveState.STOPPING, WaveState.RUNNING]
    arm.check()


def test_the_report_measures_error_and_range() -> None:
    """Drives that are one cycle behind show the way of a cycle as error; the range is theirs."""
    arm = panda()
    arm.source.start()
    arm.run(20.0)
    for swing, axis in zip(arm.swings, arm.source.report.axes, strict=True):
        assert axis.samples > 1900
        assert axis.error_max == 0.0  # these drives are where they are sent to
        late = arm.tracks[swing.name]
        assert axis.highest == pytest.approx(max(late), abs=0.01)
        assert axis.lowest == pytest.approx(min(late), abs=0.01)


@pytest.mark.parametrize('offset', [0.01, -0.02])
def test_the_path_error_is_the_distance_to_the_last_setpoint(offset: float) -> None:
    """A drive that stands off by a constant has that as maximum and as root mean square."""
    source = WaveSource([Swing('joint', 0.0, 0.1, 0.0, 1.0, 1.0)], STYLE)
    source.start()
    position = 0.0
    for _ in range(100):
        feedback = [Feedback('joint', position, 0.0)]
        setpoint = source.update(0.0, CYCLE, feedback)[0]  # type: ignore[arg-type]
        assert setpoint is not None
        position = setpoint + offset
    report = source.report.axes[0]
    assert report.error_max == pytest.approx(abs(offset))
    assert report.error_rms == pytest.approx(abs(offset))


def test_before_a_start_and_after_a_stop_nothing_is_commanded() -> None:
    """Idle answers None for every axis; a stop while idle changes nothing."""
    arm = panda()
    arm.source.stop()
    arm.run(1.0)
    assert all(len(set(track)) == 1 for track in arm.tracks.values())
    assert arm.source.report.state is WaveState.IDLE


@given(limits, st.sampled_from(['range', 'velocity']))
def test_a_joint_that_cannot_swing_is_refused_by_name(each: JointRange, what: str) -> None:
    """An empty range or no speed is an error of the URDF, said with the joint's name."""
    assume(each.upper > each.lower)
    wrong = (
        JointRange('elbow', each.upper, each.lower, each.velocity)
        if what == 'range'
        else JointRange('elbow', each.lower, each.upper, 0.0)
    )
    with pytest.raises(WaveError, match='elbow'):
        plan_swing(wrong, 0.0, STYLE)


def test_a_joint_without_a_range_swings_about_zero() -> None:
    """A continuous joint has a finite amplitude."""
    swing = plan_swing(JointRange('wheel', -math.inf, math.inf, 1.0), 0.0, STYLE)
    assert swing.centre == 0.0
    assert 0 < swing.amplitude <= STYLE.amplitude


def test_a_limit_of_thousands_makes_no_stop_of_hours() -> None:
    """Baxter's URDF has a velocity limit of 10000 rad/s for its head."""
    style = WaveStyle()
    swing = plan_swing(JointRange('head_pan', -1.6, 1.6, 10000.0), 0.0, style)
    assert swing.velocity == style.max_velocity
    assert stop_duration([swing], style) < 2 * style.period


def test_the_wave_has_a_swing_for_each_drive_with_a_joint() -> None:
    """In the order of the drives, spread over one wave; other drives and joints are left out."""
    limits = {name: JointRange(name, -1.0, 1.0, 1.0) for name in ('a', 'finger', 'b')}
    swings = plan_wave(limits, ['b', 'gripper', 'a'], STYLE)
    assert [swing.name for swing in swings] == ['b', 'a']
    assert swings[0].phase - swings[1].phase == pytest.approx(math.pi)


def test_a_bus_without_a_joint_of_the_robot_is_refused() -> None:
    """The names on both sides are named: they differ by a prefix, usually."""
    limits = {'panda_joint1': JointRange('panda_joint1', -1.0, 1.0, 1.0)}
    with pytest.raises(WaveError, match='drives: joint1; joints: panda_joint1'):
        plan_wave(limits, ['joint1'], STYLE)

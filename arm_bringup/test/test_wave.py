# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The laws of the wave: it begins where the joint stands, is smooth, leaves what others move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
import math

from hypothesis import assume, example, given
from hypothesis import strategies as st
import pytest
from urdf_reader import JointRange

from arm_bringup.demos.figures import DriveFigures
from arm_bringup.demos.wave.axis import READY_WITHIN, STANDING
from arm_bringup.demos.wave.plan import (
    plan_swing,
    plan_wave,
    quintic_step,
    STEP_SLOPE,
    WaveStyle,
)
from arm_bringup.demos.wave.wave import Wave
from arm_bringup.exceptions import WaveError

pytestmark = pytest.mark.slow

PERIOD = 0.04  # [s] between targets
OBSERVED = 5  # targets between two observations
STYLE = WaveStyle()
ENABLED = DriveFigures(online=True, state='Operation enabled', mode='Cyclic position')


class Arm:
    """Drives that are where they are sent, unless somebody else has them; keeps their tracks."""

    def __init__(self, limits: list[JointRange], starts: list[float]) -> None:
        self.swings = [plan_swing(each, 0.9 * i, STYLE) for i, each in enumerate(limits)]
        self.wave = Wave(self.swings, STYLE)
        self.drives = {
            swing.name: replace(ENABLED, setpoint=start, position=start, following_error=0.01)
            for swing, start in zip(self.swings, starts, strict=True)
        }
        self.foreign: set[str] = set()
        self.tracks = {name: [drive.setpoint] for name, drive in self.drives.items()}
        self.now = 0.0
        self._count = 0

    def run(self, duration: float) -> None:
        """Go on for some time in [s]; what is known of the drives comes more rarely."""
        for _ in range(round(duration / PERIOD)):
            if self._count % OBSERVED == 0:
                self.wave.observe(self.drives, self.now)
            self._count += 1
            self.now += PERIOD
            for name in self.drives:
                target = self.wave.target(name, self.now)
                if target is not None and name not in self.foreign:
                    self.move(name, target)
            for name, drive in self.drives.items():
                self.tracks[name].append(drive.setpoint)

    def move(self, name: str, to: float) -> None:
        """Move a drive."""
        self.drives[name] = replace(self.drives[name], setpoint=to, position=to)


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
def test_the_step_has_a_slope_within_its_constant(x: float, d: float) -> None:
    """It rises from 0 to 1 and never passes either, also across its ends."""
    before, after = quintic_step(x), quintic_step(x + d)
    assert 0.0 <= before <= 1.0
    assert -1e-15 <= after - before <= STEP_SLOPE * d * (1 + 1e-9) + 1e-15


@given(plans)
def test_a_joint_moves_from_where_it_stands_no_faster_than_planned(
    plan: list[tuple[JointRange, float]],
) -> None:
    """Through entry and swing; one beyond its limits goes in, and never farther out."""
    arm = named(plan)
    arm.wave.start()
    arm.run(20.0)
    for swing, (each, _) in zip(arm.swings, plan, strict=True):
        track = arm.tracks[swing.name]
        steps = [abs(after - before) for before, after in pairwise(track)]
        assert max(steps) <= swing.velocity * PERIOD * (1 + 1e-9)
        moving = next(step for step in steps if step)
        assert moving <= 0.05 * swing.velocity * PERIOD  # from rest
        assert min(track) >= min(track[0], each.lower) - 1e-12
        assert max(track) <= max(track[0], each.upper) + 1e-12
        entered = swing.entry_duration(track[0], STYLE) + 1.0
        if entered + STYLE.period < 20.0:
            late = track[round(entered / PERIOD) :]
            assert max(late) - min(late) == pytest.approx(2 * swing.amplitude, rel=1e-3)


def panda() -> Arm:
    """Build the first joints of the Panda at zero, two of them outside or at their limits."""
    table = [(-2.9, 2.9), (-1.76, 1.76), (-2.9, 2.9), (-3.07, -0.07), (-2.9, 2.9), (-0.02, 3.75)]
    joints = [JointRange(f'joint{i}', *pair, 2.175) for i, pair in enumerate(table)]
    return Arm(joints, [0.0] * len(joints))


def halted(arm: Arm) -> None:
    """Let somebody halt a drive."""
    arm.foreign.add('joint1')


def elsewhere(arm: Arm) -> None:
    """Let somebody send it elsewhere."""
    arm.foreign.add('joint1')
    arm.move('joint1', 1.5)


def in_mode_1(arm: Arm) -> None:
    """Let somebody select another mode, in which its set-point follows by chance."""
    arm.drives['joint1'] = replace(arm.drives['joint1'], mode='Profile position')


def disabled(arm: Arm) -> None:
    """Let somebody disable it."""
    arm.drives['joint1'] = replace(arm.drives['joint1'], state='Switched on', message='off')


@pytest.mark.parametrize(
    ('take', 'reason'),
    [
        (halted, 'its set-point stands at'),
        (elsewhere, 'its set-point stands at 1.500'),
        (in_mode_1, 'it is in mode Profile position'),
        (disabled, 'it is not enabled: off'),
    ],
)
def test_a_drive_that_somebody_else_has_gets_no_target_until_the_next_start(
    take: Callable[[Arm], None], reason: str
) -> None:
    """The others go on; given back, it enters from where it stands then."""
    arm = panda()
    arm.wave.start()
    arm.run(8.0)
    assert arm.wave.departures() == []
    take(arm)
    arm.run(2.0)
    (text,) = arm.wave.departures()
    assert text.startswith('joint1 left the wave')
    assert reason in text
    assert arm.wave.target('joint1', arm.now) is None
    assert list(arm.wave.active) == [f'joint{i}' for i in (0, 2, 3, 4, 5)]
    arm.foreign.clear()
    arm.drives['joint1'] = replace(arm.drives['joint1'], mode=ENABLED.mode, state=ENABLED.state)
    rest = arm.drives['joint1'].setpoint
    arm.run(1.0)
    assert arm.drives['joint1'].setpoint == rest
    assert len(set(arm.tracks['joint0'][-20:])) == 20
    arm.wave.start()
    arm.run(0.6)
    assert 'joint1' in arm.wave.active
    assert arm.drives['joint1'].setpoint == pytest.approx(rest, abs=0.1)
    arm.run(5.0)
    assert abs(arm.drives['joint1'].setpoint - rest) > 0.1


def test_a_drive_that_stands_for_a_moment_stays() -> None:
    """A message may come twice, or targets late."""
    arm = panda()
    arm.wave.start()
    arm.run(8.0)
    arm.foreign.add('joint1')
    arm.run((STANDING - 1) * OBSERVED * PERIOD)
    arm.foreign.clear()
    arm.run(3.0)
    assert 'joint1' in arm.wave.active


@pytest.mark.parametrize('moves', [True, False])
def test_a_drive_that_moves_or_has_no_mode_yet_is_waited_for_a_little(*, moves: bool) -> None:
    """What is known of it may be older than the answer of its service; later is too late."""
    arm = panda()
    arm.wave.start()

    def keep(duration: float) -> None:
        for _ in range(round(duration / (OBSERVED * PERIOD))):
            if moves:
                arm.move('joint1', arm.drives['joint1'].setpoint + 0.1)
            else:
                in_mode_1(arm)
            arm.run(OBSERVED * PERIOD)
        assert 'joint1' not in arm.wave.active
        arm.drives['joint1'] = replace(arm.drives['joint1'], mode=ENABLED.mode)
        arm.run(3 * OBSERVED * PERIOD)

    keep(READY_WITHIN - 1.0)
    assert 'joint1' in arm.wave.active
    arm.wave.stop()
    arm.wave.start()
    keep(READY_WITHIN + 1.0)
    assert 'joint1' not in arm.wave.active


def test_before_a_start_and_after_a_stop_nobody_is_sent_anywhere() -> None:
    """The stop returns who was."""
    arm = panda()
    arm.run(1.0)
    assert all(arm.wave.target(name, arm.now) is None for name in arm.drives)
    assert list(arm.wave.stop()) == []
    arm.wave.start()
    arm.run(1.0)
    assert list(arm.wave.stop()) == list(arm.drives)
    arm.run(1.0)
    assert all(arm.wave.target(name, arm.now) is None for name in arm.drives)
    assert arm.wave.departures() == []


def test_range_and_following_error_are_measured_while_a_drive_is_in_the_wave() -> None:
    """By what its messages say: every fifth of a second."""
    arm = panda()
    arm.wave.start()
    arm.run(20.0)
    for name, figures in arm.wave.figures.items():
        assert figures.active
        assert (figures.error_max, figures.error_rms) == pytest.approx((0.01, 0.01))
        assert figures.highest == pytest.approx(max(arm.tracks[name]), abs=0.01)
        assert figures.lowest == pytest.approx(min(arm.tracks[name]), abs=0.01)
    error = replace(arm.drives['joint0'], following_error=-0.03)
    arm.wave.observe({'joint0': error}, arm.now)
    figures = arm.wave.figures['joint0']
    assert figures.error_max == pytest.approx(0.03)
    assert 0.01 < figures.error_rms < 0.02


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


def test_a_limit_of_thousands_is_no_speed_of_a_wave() -> None:
    """Baxter's URDF has a velocity limit of 10000 rad/s for its head."""
    swing = plan_swing(JointRange('head_pan', -1.6, 1.6, 10000.0), 0.0, STYLE)
    assert swing.velocity == STYLE.max_velocity


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

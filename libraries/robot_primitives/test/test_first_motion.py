# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion: guard, judgement, correction of a bus.yml."""

from __future__ import annotations

from dataclasses import replace
import math

from hypothesis import assume, given
from hypothesis import strategies as st
import pytest

from first_motion import (
    AxisScales,
    CAUSES,
    corrected,
    DriveFacts,
    JointKind,
    judge,
    MotionGuard,
    MotionPlan,
    Order,
    Outcome,
    Sample,
    Seen,
    too_far,
    too_fast,
    Verdict,
)
from first_motion.guard import IDLE_TIME, LOOP_GAP, STALL_TIME

PERIOD = 0.03  # [s]
PLAN = MotionPlan(start=0.5, distance=0.02, speed=0.01, increment=1e-4, others={'elbow': 1.0})
FACTS = DriveFacts(scale=1000.0)


def scales(
    position: float, velocity: float, *, offset: float = 0.0, by_group: bool = False
) -> AxisScales:
    """Return those of an axis whose torque is in the drive's unit."""
    return AxisScales(by_group, position, 1 / position, velocity, 1 / velocity, 1.0, 1.0, offset)


class Joint:
    """A joint that follows its guard at a constant speed."""

    def __init__(self, plan: MotionPlan, now: float = 100.0) -> None:
        self.guard = MotionGuard(plan, now)
        self.now = now
        self.position = plan.start
        self.moves = False

    def step(self, *, held: bool, factor: float = 1.0, gap: float = PERIOD) -> Order:
        """Advance; the joint does what was ordered before."""
        plan = self.guard.plan
        self.now += gap
        if self.moves:
            step = math.copysign(plan.speed * gap, plan.distance) * factor
            left = plan.target - self.position
            self.position += left if step * left > 0 and abs(left) < abs(step) else step
        order = self.guard.step(self.now, Sample(self.position), held=held, busy=False)
        if order is not Order.NONE:
            self.moves = order is Order.GO
        return order


@given(
    keys=st.lists(st.booleans(), max_size=400),
    distance=st.floats(0.005, 0.1),
    sign=st.sampled_from((1, -1)),
)
def test_the_joint_moves_only_while_the_key_is_held(
    keys: list[bool], distance: float, sign: int
) -> None:
    """Whatever the person does: one order at each edge, and never a motion without the key."""
    joint = Joint(MotionPlan(0.5, sign * distance, 0.01, 1e-4))
    for held in keys:
        order = joint.step(held=held)
        assert joint.guard.moving is joint.moves
        assert not (joint.moves and not held)
        if order is Order.END:
            assert joint.guard.outcome is Outcome.REACHED
            assert abs(joint.position - joint.guard.plan.target) <= 0.03 * distance + 1e-4
            return
    assert joint.guard.outcome is Outcome.RUNNING


def test_a_held_up_loop_is_a_release() -> None:
    """The key has to be pressed anew: no question was put meanwhile."""
    joint = Joint(PLAN)
    assert joint.step(held=False) is Order.NONE
    assert joint.step(held=True) is Order.GO
    assert joint.step(held=True, gap=LOOP_GAP * 1.1, factor=0.1) is Order.HALT
    assert joint.step(held=True) is Order.NONE
    assert joint.step(held=False) is Order.NONE
    assert joint.step(held=True) is Order.GO


def test_a_key_that_was_held_before_does_not_count() -> None:
    """It was pressed for something else; what is pressed after it was up counts."""
    joint = Joint(PLAN)
    for _ in range(20):
        assert joint.step(held=True) is Order.NONE
        assert joint.guard.needs_release
    assert joint.step(held=False) is Order.NONE
    assert joint.step(held=True) is Order.GO


def test_a_busy_drive_is_halted_but_not_ordered_to_go() -> None:
    """A halt may not wait for anything."""
    guard = MotionGuard(PLAN, 0.0)
    sample = Sample(PLAN.start)
    assert guard.step(0.05, sample, held=False, busy=False) is Order.NONE
    assert guard.step(0.1, sample, held=True, busy=True) is Order.NONE
    assert guard.step(0.2, sample, held=True, busy=False) is Order.GO
    assert guard.step(0.3, sample, held=False, busy=True) is Order.HALT


@pytest.mark.parametrize(
    ('factor', 'outcome'),
    [
        (1.0, Outcome.REACHED),
        (-1.0, Outcome.OTHER_WAY),
        (5.0, Outcome.TOO_FAST),
        (0.0, Outcome.STALLED),
    ],
)
def test_what_ends_a_motion(factor: float, outcome: Outcome) -> None:
    """By what the drive reports."""
    joint = Joint(PLAN)
    joint.step(held=False)
    steps = 0
    while joint.step(held=True, factor=factor) is not Order.END:
        steps += 1
        assert steps * PERIOD < STALL_TIME + 3.0
    assert joint.guard.outcome is outcome
    assert joint.guard.outcome.is_judged is (outcome in {Outcome.REACHED, Outcome.STALLED})


@pytest.mark.parametrize(
    ('sample', 'outcome', 'words'),
    [
        (Sample(0.5, problem='fault: it is hot'), Outcome.PROBLEM, 'it is hot'),
        (Sample(math.nan), Outcome.PROBLEM, 'no position'),
        (Sample(0.5, following_error=-0.02), Outcome.FOLLOWING_ERROR, 'does not follow'),
        (Sample(0.5, others={'elbow': 1.02}), Outcome.OTHER_JOINT, 'elbow'),
        (Sample(0.53), Outcome.TOO_FAR, '50%'),
    ],
)
def test_errors_end_a_motion_with_their_reason(
    sample: Sample, outcome: Outcome, words: str
) -> None:
    """Even while no key is held: what moves by itself has to be stopped, too."""
    plan = MotionPlan(0.5, 0.02, 0.01, 1e-4, following_limit=0.01, others={'elbow': 1.0})
    guard = MotionGuard(plan, 0.0)
    assert guard.step(0.03, sample, held=False, busy=False) is Order.END
    assert guard.outcome is outcome
    assert words in guard.detail
    assert guard.step(0.06, Sample(0.5), held=True, busy=False) is Order.END


def test_a_joint_that_stands_behind_its_start_went_the_other_way() -> None:
    """Its targets did not go on, as they stay near the joint."""
    guard, now = MotionGuard(PLAN, 0.0), 0.0
    held = False
    while guard.outcome is Outcome.RUNNING:
        now += PERIOD
        position = PLAN.start - (0.002 if held else 0.0)
        guard.step(now, Sample(position), held=held, busy=False)
        held = True
    assert guard.outcome is Outcome.OTHER_WAY
    assert 'different signs' in guard.detail


@pytest.mark.parametrize('name', ['start', 'distance', 'speed', 'increment'])
def test_a_motion_that_cannot_be_guarded_is_refused(name: str) -> None:
    """Nothing is beyond a limit that is no number."""
    for value in (math.nan, math.inf):
        with pytest.raises(ValueError, match=name):
            replace(PLAN, **{name: value})  # type: ignore[arg-type]  # of numbers alone
    with pytest.raises(ValueError, match='is no motion'):
        MotionPlan(0.5, 0.0, 0.01, 1e-4)


def test_a_first_motion_is_short_and_slow() -> None:
    """Both are refused; what is no number is neither."""
    kind = JointKind.TURNS
    assert not too_far(kind, -math.radians(20))
    assert not too_fast(kind, math.radians(5))
    for distance in (0.0, math.radians(21), -math.inf, math.nan):
        assert 'a first motion is short, up to 20 deg' in too_far(kind, distance)
    for speed in (0.0, -0.01, math.radians(6), math.inf, math.nan):
        assert 'a first motion is slow' in too_fast(kind, speed)


def test_nobody_there_and_enough() -> None:
    """It does not wait without end; Enter ends it before the target."""
    guard = MotionGuard(PLAN, 0.0)
    assert guard.step(IDLE_TIME + 1, Sample(PLAN.start), held=False, busy=False) is Order.END
    assert guard.outcome is Outcome.IDLE
    guard = MotionGuard(PLAN, 0.0)
    assert guard.finish() is Order.END
    assert guard.outcome is Outcome.IDLE
    guard = MotionGuard(PLAN, 0.0)
    assert guard.step(0.05, Sample(PLAN.start), held=False, busy=False) is Order.NONE
    assert guard.step(0.1, Sample(PLAN.start), held=True, busy=False) is Order.GO
    assert guard.finish() is Order.END
    assert guard.outcome is Outcome.FINISHED


@given(
    cause=st.sampled_from(CAUSES),
    by_eye=st.floats(0.85, 1.15),
    reported=st.floats(0.01, 0.1) | st.floats(-0.1, -0.01),
    sign=st.sampled_from((1, -1)),
)
def test_a_usual_mistake_is_found_by_an_estimate(
    cause: object, by_eye: float, reported: float, sign: int
) -> None:
    """By eye, with an error of 15 %; the correction makes what is reported what is seen."""
    assert isinstance(cause, type(CAUSES[0]))
    kind = min(cause.kinds, key=lambda each: each.value)
    truth = cause.factor * reported * sign
    seen = Seen(1 if truth > 0 else -1, abs(truth) * by_eye)
    judgement = judge(kind, reported, reported, seen, FACTS)
    wanted = Verdict.WRONG_SCALE if sign > 0 else Verdict.WRONG_SIGN_AND_SCALE
    assert judgement.verdict is wanted
    assert judgement.causes[0] == cause
    axis = scales(1000.0, 1000.0)
    values = corrected(axis, judgement.sign, judgement.causes[0].factor)
    increments = reported * axis.scale_pos_to_dev
    assert increments * values['scale_pos_from_dev'] == pytest.approx(truth)
    assert truth * values['scale_pos_to_dev'] == pytest.approx(increments)


@given(
    by_eye=st.floats(0.75, 1.3),
    reported=st.floats(0.01, 0.1) | st.floats(-0.1, -0.01),
    sign=st.sampled_from((1, -1)),
    gear=st.none() | st.floats(2.0, 200.0),
    distance=st.booleans(),
)
def test_a_right_scale_is_left_alone(
    by_eye: float, reported: float, sign: int, gear: float | None, *, distance: bool
) -> None:
    """Whatever the gear; of the direction alone the sign is concluded."""
    facts = DriveFacts(scale=1000.0, gear=gear, factor_scale=1000.0)
    assume(gear is None or gear > 2.5)
    seen = Seen(sign if reported > 0 else -sign, abs(reported) * by_eye if distance else None)
    judgement = judge(JointKind.TURNS, reported, reported, seen, facts)
    assert judgement.verdict is (Verdict.RIGHT if sign > 0 else Verdict.WRONG_SIGN)
    assert judgement.sign == sign


def test_what_the_drive_says_goes_before_the_usual_causes() -> None:
    """A gear of 50 and 180/pi cannot be distinguished by eye: both are named."""
    facts = DriveFacts(scale=1000.0, gear=50.0, factor_scale=50_000.0)
    judgement = judge(JointKind.TURNS, 0.02, 0.02, Seen(1, 0.02 / 53), facts)
    assert [round(1 / cause.factor, 1) for cause in judgement.causes] == [50.0, 57.3]
    assert 'factor group' in judgement.causes[0].text
    unusual = judge(JointKind.TURNS, 0.02, 0.02, Seen(1, 0.02 * 17), FACTS)
    assert unusual.verdict is Verdict.WRONG_SCALE
    assert unusual.causes == ()
    assert unusual.measured == pytest.approx(17)


@pytest.mark.parametrize(
    ('reported', 'seen', 'verdict', 'words'),
    [
        (0.0, Seen(0), Verdict.NO_MOTION, 'brake'),
        (0.02, Seen(0), Verdict.ENCODER_ONLY, 'larger distance'),
        (0.001, Seen(1), Verdict.NOT_REPORTED, 'encoder'),
        (0.02, Seen(0, other_joint=True), Verdict.OTHER_JOINT, 'node_id'),
    ],
)
def test_what_no_scale_explains_has_a_remedy(
    reported: float, seen: Seen, verdict: Verdict, words: str
) -> None:
    """And changes nothing in bus.yml."""
    judgement = judge(JointKind.TURNS, 0.02, reported, seen, FACTS)
    assert judgement.verdict is verdict
    assert not verdict.wants_change
    assert words in judgement.remedy


def test_corrected_scales() -> None:
    """Torque turns with the position; a velocity in other units keeps its size, zero its place."""
    axis = scales(100.0, 9.55, offset=0.5, by_group=True)
    values = corrected(axis, -1, 0.25)
    assert values == {
        'scale_from_factor_group': False,
        'scale_pos_to_dev': -400.0,
        'scale_pos_from_dev': -0.0025,
        'scale_vel_to_dev': -9.55,
        'scale_vel_from_dev': pytest.approx(-1 / 9.55),
        'scale_eff_to_dev': -1.0,
        'scale_eff_from_dev': -1.0,
        'offset_pos_from_dev': -0.125,
    }
    assert 'scale_eff_to_dev' not in corrected(scales(1000.0, 1000.0), 1, 2.0)
    odd = scales(-1000.0, 1000.0)
    assert 'scale_eff_to_dev' not in corrected(odd, -1, 1.0)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A first motion on the page: targets by heartbeats, what was seen, and the file it corrects."""

from __future__ import annotations

import math
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import pytest
import yaml

from first_motion import (
    AxisScales,
    DriveFacts,
    JointKind,
    judge,
    MotionPlan,
    Outcome,
    Sample,
    Verdict,
)
from robot_viewer.page.first_motion import (
    Axis,
    BusPlace,
    correction_lines,
    correction_of,
    GuardedTargets,
    LEAD_TIME,
    MAX_STEP_TIME,
    motion_plan,
    MotionRequest,
    problem_of,
    RELEASED_AFTER,
    Saw,
)
from robot_viewer.page.live import HEARTBEAT

PLAN = MotionPlan(start=0.5, distance=0.1, speed=0.05, increment=1e-4)
SCALES = AxisScales(False, 1000.0, 0.001, 1000.0, 0.001, 1.0, 1.0, 0.0)
AXIS = Axis(
    JointKind.TURNS,
    AxisScales(False, 1e4, 1e-4, 1e4, 1e-4, 1.0, 1.0, 0.0),
    DriveFacts(1e4),
    BusPlace(Path('none'), 0, 0, 'shoulder', None),
)
BUS = 'nodes:\n  shoulder:\n    node_id: 2  # mine\n    scale_pos_to_dev: 1000.0\n'


@given(beats=st.lists(st.booleans(), min_size=1, max_size=300), sign=st.sampled_from((1, -1)))
def test_a_target_for_a_heartbeat_and_none_without(beats: list[bool], *, sign: int) -> None:
    """Whatever the button does: slow steps in one direction, and never beyond the target."""
    plan = MotionPlan(0.5, sign * 0.1, 0.05, 1e-4)
    motion, now, position = let_go(plan), 10.0, 0.5
    for beats_now in beats:
        now += HEARTBEAT
        if beats_now:
            motion.beat(now)
        target = motion.step(now, Sample(position))
        if target is None:
            continue
        assert beats_now
        assert 0.0 <= (target - position) * sign <= plan.speed * MAX_STEP_TIME + 1e-9
        assert (target - plan.start) / plan.distance <= 1.0 + 1e-9
        position = target


def let_go(plan: MotionPlan) -> GuardedTargets:
    """Prepare a motion, and look while nobody holds the button; ends at 10.0."""
    motion = GuardedTargets(plan, 9.0)
    for number in range(1, 11):
        assert motion.step(9.0 + 0.1 * number, Sample(plan.start)) is None
    return motion


@given(delays=st.lists(st.floats(0.0, RELEASED_AFTER - 0.01), min_size=1, max_size=99))
def test_a_button_that_was_held_before_moves_nothing(delays: list[float]) -> None:
    """It was pressed for another motion, perhaps on another page; let go it counts."""
    motion, now = GuardedTargets(PLAN, 10.0), 10.0
    for delay in delays:
        now += delay
        motion.beat(now)
        assert motion.step(now, Sample(0.5)) is None
        assert not motion.guard.moving
        assert motion.press_anew or now == 10.0
    now += RELEASED_AFTER
    assert motion.step(now, Sample(0.5)) is None
    motion.beat(now + 0.01)
    assert motion.step(now + 0.02, Sample(0.5)) is None
    assert motion.guard.moving
    assert not motion.press_anew


def test_a_touch_moves_nothing_and_a_late_heartbeat_no_farther() -> None:
    """And whoever lets go, or whose heartbeats stay away, commands nothing any more."""
    motion = let_go(PLAN)
    motion.beat(10.02)
    assert motion.step(10.03, Sample(0.5)) is None
    motion.beat(10.06)
    first = motion.step(10.07, Sample(0.5))
    assert first == pytest.approx(0.5 + 0.05 * 0.04)
    assert motion.step(10.1, Sample(0.5)) is None
    motion.beat(10.19)
    assert motion.step(10.2, Sample(0.5)) == pytest.approx(0.5 + 0.05 * (0.04 + MAX_STEP_TIME))
    assert motion.commanded == pytest.approx(0.05 * (0.04 + MAX_STEP_TIME))
    motion.release()
    assert motion.step(10.23, Sample(0.505)) is None
    assert not motion.guard.moving
    motion.beat(10.24)
    assert motion.step(10.25 + RELEASED_AFTER, Sample(0.505)) is None
    assert motion.guard.outcome is Outcome.RUNNING


@pytest.mark.parametrize('sign', [1, -1])
def test_the_target_of_a_stuck_joint_stays_near_it(sign: int) -> None:
    """It would jump when it comes free; that it is stuck is a result, and no error."""
    request = MotionRequest('shoulder', sign * 0.02, 0.05)
    plan = motion_plan(request, AXIS, 0.5, {'elbow': 1.0, 'lost': math.nan})
    assert plan.others == {'elbow': 1.0}
    motion, now, farthest = let_go(plan), 10.0, 0.5
    while motion.guard.outcome is Outcome.RUNNING:
        now += HEARTBEAT
        motion.beat(now)
        target = motion.step(now, Sample(0.5))
        farthest = farthest if target is None else target
        assert abs(farthest - 0.5) <= 0.05 * LEAD_TIME + plan.noise + 1e-9
    assert motion.guard.outcome is Outcome.STALLED
    assert (farthest - 0.5) * sign > 0.9 * 0.05 * LEAD_TIME


def test_a_joint_that_leaves_its_targets_ends_the_motion() -> None:
    """Before it is a quarter beyond the distance."""
    plan = motion_plan(MotionRequest('shoulder', 0.2, 0.05), AXIS, 0.5, {})
    motion, now, position = let_go(plan), 10.0, 0.5
    while motion.guard.outcome is Outcome.RUNNING:
        now += HEARTBEAT
        motion.beat(now)
        motion.step(now, Sample(position))
        position += 0.14 * HEARTBEAT  # below three times the speed
    assert motion.guard.outcome is Outcome.FOLLOWING_ERROR
    assert position < plan.target


@pytest.mark.parametrize('start', [math.nan, math.inf])
def test_a_start_that_is_no_number_is_refused(start: float) -> None:
    """No position would be too far from it."""
    with pytest.raises(ValueError, match='no motion can be guarded'):
        motion_plan(MotionRequest('shoulder', 0.2, 0.05), AXIS, start, {})


@pytest.mark.parametrize(
    ('saw', 'reported', 'verdict'),
    [
        (Saw.LIKE_PICTURE, 0.1, Verdict.RIGHT),
        (Saw.LIKE_PICTURE, -0.1, Verdict.RIGHT),
        (Saw.OTHER_WAY, -0.1, Verdict.WRONG_SIGN),
        (Saw.OTHER_WAY, 0.1, Verdict.WRONG_SIGN),
        (Saw.NOTHING, 0.1, Verdict.ENCODER_ONLY),
        (Saw.OTHER_JOINT, 0.1, Verdict.OTHER_JOINT),
        (Saw.LIKE_PICTURE, 0.0, Verdict.NOT_REPORTED),
    ],
)
def test_what_was_seen_is_compared_with_the_picture(
    saw: Saw, reported: float, verdict: Verdict
) -> None:
    """Which shows what the drive reports."""
    commanded = math.copysign(0.1, reported)
    seen = saw.seen(reported, abs(reported) or 0.1)
    facts = DriveFacts(1000.0)
    assert judge(JointKind.TURNS, commanded, reported, seen, facts).verdict is verdict


def test_a_correction_is_shown_and_written_once(tmp_path: Path) -> None:
    """Into the very file that the robot was started with; an own copy of it is left alone."""
    path, copy = tmp_path / 'bus.yml', tmp_path / 'copy.yml'
    for each in (path, copy):
        each.write_text(BUS)
    stat = path.stat()
    place = BusPlace(path, stat.st_ino, stat.st_mtime_ns, 'shoulder', None)
    says = DriveFacts(1000.0, gear=50.0)
    axis = Axis(JointKind.TURNS, SCALES, says, place)
    judgement = judge(JointKind.TURNS, 0.1, 0.1, Saw.OTHER_WAY.seen(0.1, 0.002), says)
    assert len(judgement.causes) == 2, 'a gear of 50, or degrees'
    assert correction_of(axis, judgement, None) is None, 'a person chooses'
    correction = correction_of(axis, judgement, judgement.causes[0])
    assert correction is not None
    lines = correction_lines(place, correction)
    assert yaml.safe_load(lines) == correction.values
    assert 'the gear of 50 (0x6091) is missing' in lines
    assert not BusPlace(copy, stat.st_ino, stat.st_mtime_ns, 'shoulder', None).is_here
    assert place.is_here
    assert place.write(correction) == path
    written = yaml.safe_load(path.read_text())['nodes']['shoulder']
    assert written == {'node_id': 2, **correction.values}
    assert '# mine' in path.read_text()
    assert not place.is_here
    with pytest.raises(ValueError, match='changed since the robot was started'):
        place.write(correction)


@pytest.mark.parametrize(
    ('state', 'mode', 'age', 'words'),
    [
        ('Operation enabled', 'Cyclic position', 0.1, ''),
        ('Operation enabled', 'Cyclic position', 0.6, 'joint_states'),
        ('Switched on', 'Cyclic position', 0.1, 'not enabled'),
        ('Operation enabled', 'Interpolated position', 0.1, ''),
        ('Operation enabled', 'Profile position', 0.1, 'goes on when the page is lost: choose'),
        ('Operation enabled', 'Cyclic velocity', 0.1, 'position mode below Drives'),
        ('Operation enabled', '', 0.1, 'no mode'),
        ('', '', 0.1, 'no diagnostics'),
    ],
)
def test_why_a_drive_is_not_moved(state: str, mode: str, age: float, words: str) -> None:
    """With what to do."""
    problem = problem_of({'state': state, 'mode': mode}, age)
    assert words in problem
    assert bool(problem) is bool(words)

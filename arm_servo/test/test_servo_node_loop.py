# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The standalone loop cycle by cycle, on ideal drives elsewhere."""

from __future__ import annotations

from itertools import combinations, pairwise
import math
import threading
import time

import numpy as np
import pytest
from servo_commands import Elsewhere, jog_elsewhere, no_speed_jumps, outcome, swing

from arm_servo import MotionCore
from arm_servo.motion_thread import JointFeedback, MotionThread
from arm_trajectory import GoalCode


def test_nothing_is_sent_before_something_moves() -> None:
    """An idle loop leaves the drives alone, and does not send again what was reached."""
    arm = Elsewhere()
    arm.run(20)
    assert not arm.points
    goal = swing(arm)
    arm.gateway.request(goal)
    arm.run(400)
    sent = len(arm.points)
    assert sent > 200
    arm.run(20)
    assert len(arm.points) == sent
    assert arm.at == pytest.approx(goal.points[0].positions, abs=1e-6)


@pytest.mark.parametrize('aside', [0.003, 0.019, 0.2])
def test_it_begins_where_others_have_moved_the_arm(aside: float) -> None:
    """A way that is no more than a cycle's at full speed is not made in one cycle either."""
    arm = Elsewhere().following()
    jog_elsewhere(arm, 20)
    arm.run(80)
    arm.at = arm.at + aside
    arm.run(2)
    before, sent = np.array(arm.at), len(arm.points)
    jog_elsewhere(arm, 2)
    assert np.abs(arm.path()[sent] - before).max() < 1e-4


def test_an_arm_that_stands_a_little_off_is_not_sent_there() -> None:
    """What a drive lacks to its set-point at rest does not shift the next motion."""
    arm = Elsewhere().following()
    jog_elsewhere(arm, 20)
    arm.run(80)
    for was_seen_to_move in (True, False):
        last, sent, arm.sag = arm.path()[-1], len(arm.points), 0.01
        arm.run(3)
        jog_elsewhere(arm, 2)
        off = np.abs(arm.path()[sent] - last).max()
        assert (off > 0.005) == was_seen_to_move
        assert was_seen_to_move or off < 1e-4
        arm.run(80)


@pytest.mark.parametrize('what', ['cycle', 'core'])
def test_a_cycle_that_raises_is_the_end_and_the_arm_comes_to_rest(
    what: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The thread reports the error, and brakes without the core before it ends."""
    arm = Elsewhere().following()
    jog_elsewhere(arm, 30)
    failed = threading.Event()

    def step(*_: object) -> None:
        raise ArithmeticError('no solution')

    if what == 'cycle':
        monkeypatch.setattr(arm.cycle, 'step', step)
    else:  # which ends all that was commanded
        monkeypatch.setattr(MotionCore, 'step', step)
    thread = MotionThread(arm.cycle, 0.001)
    before = len(arm.points)
    thread.start(failed.set)
    assert failed.wait(10.0)
    thread.stop()
    assert isinstance(thread.error, ArithmeticError)
    assert not arm.points[-1].state.moving
    speeds = [point.state.velocity[0] for point in arm.points[before - 1 :]]
    most = arm.gateway.model.limits.acceleration[0]
    assert max(a - b for a, b in pairwise(speeds)) <= 1.01 * most * 0.001


def test_a_stall_is_no_burst_of_cycles() -> None:
    """Cycles that were missed are left out: of n in a row at most the first is late."""
    arm, cycle_period = Elsewhere(), 0.01
    begins: list[float] = []
    enough = threading.Event()

    def step(now: float, period: float) -> None:
        begins.append(time.monotonic())
        if len(begins) == 3:
            time.sleep(8.5 * cycle_period)  # the stall
        if len(begins) == 15:
            enough.set()

    arm.cycle.step = step  # type: ignore[method-assign]
    thread = MotionThread(arm.cycle, cycle_period)
    thread.start()
    assert enough.wait(10.0)
    thread.stop()
    for (i, first), (j, last) in combinations(enumerate(begins), 2):
        assert last - first > (j - i - 1) * cycle_period - 1e-4


def test_the_arm_comes_to_rest_on_its_path_when_joint_states_are_lost() -> None:
    """Set-points slow down to rest, the trajectory ends with the reason; then all goes on."""
    arm = Elsewhere()
    arm.is_published = False
    (refusal,) = jog_elsewhere(arm, 1)  # before the first one
    assert 'no joint states of joint_1_s' in refusal
    arm.is_published = True
    arm.run(3)
    command = arm.gateway.request(swing(arm, 0.5))
    arm.run(80)
    arm.is_published = False
    arm.run(200)
    assert outcome(command).code is GoalCode.INVALID_GOAL
    assert 'no joint states' in outcome(command).reason
    path = arm.path()
    assert np.ptp(path - path[:, :1] - (path[0] - path[0, 0]), axis=1).max() < 1e-6  # on the line
    no_speed_jumps(path, arm.gateway.model.limits.acceleration)
    assert not arm.points[-1].state.moving
    arm.is_published = True
    arm.run(5)
    assert arm.gateway.snapshot.blocked == ''


def test_numbers_that_are_none_do_not_count() -> None:
    """A joint that only publishes NaN is silent."""
    feedback = JointFeedback(['a', 'b'], 0.2)
    feedback.receive(['b', 'a', 'other'], [math.nan, 1.0, 2.0], [0.0, math.nan, 0.0], 1.0)
    state, blocked = feedback.state(1.0)
    assert state is None
    assert 'of b for' in blocked
    feedback.receive(['b'], [0.5], [], 1.1)
    state, blocked = feedback.state(1.15)
    assert blocked == ''
    assert state is not None
    assert state.position.tolist() == [1.0, 0.5]

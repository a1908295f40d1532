# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories are planned beside the cycle, and take over without a jump."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
import time

import numpy as np
import pytest
from servo_drives import Drives, PERIOD

from arm_canopen import Refusal, RefusalCause
from arm_servo.exceptions import GoalCode, GoalError, NotReadyError
from arm_servo.execution import Execution
from arm_servo.goal import GoalPoint, TrajectoryGoal
from arm_servo.nodes.planner import Planner
from arm_servo.otg import MotionState
from arm_servo.set_point import Source

Done = Callable[[], bool]


def wave(drives: Drives, count: int) -> TrajectoryGoal:
    """Return a trajectory of many points, 0.05 s apart, that ends where it began."""
    begin = np.array([axis.setpoint for axis in drives.axes])
    points = []
    for number in range(1, count + 1):
        share = number / count
        points.append(
            GoalPoint(0.5 + 0.05 * number, (begin + 0.2 * np.sin(np.pi * share) ** 2).tolist())
        )
    return TrajectoryGoal(drives.desk.model.joints, points)


def run_until(drives: Drives, done: Done) -> None:
    """Run cycles at their pace."""
    deadline = time.monotonic() + 20.0
    while not done():
        drives.run()
        time.sleep(PERIOD)
        assert time.monotonic() < deadline


def ready() -> tuple[Drives, Planner]:
    """Return drives that follow, and their planner."""
    drives = Drives()
    drives.attach()
    drives.run(2)
    return drives, Planner(drives.desk, lambda: None)


@pytest.mark.parametrize('moving', [False, True])
def test_a_long_trajectory_begins_without_a_jump(moving: bool) -> None:
    """Speeds change by no more than the acceleration limit, from rest and out of a jog."""
    drives, planner = ready()
    goal = wave(drives, 60)
    if moving:
        drives.desk.submit(lambda core, now: core.jog({'panda_joint1': 0.4}, now, 30.0))
        drives.run(50)
    before = len(drives.path) - 2
    future = planner.follow(goal)
    run_until(drives, future.done)
    execution = future.result(0.0)
    drives.run(450)
    path = np.array(drives.path)[before:]
    jumps = np.abs(np.diff(path, 2, axis=0)) / PERIOD**2
    assert (jumps.max(axis=0) <= 1.02 * drives.desk.model.limits.acceleration).all()
    assert execution.ending is not None
    assert execution.ending.code is GoalCode.SUCCESSFUL, execution.ending.reason
    assert path[-1] == pytest.approx(goal.points[-1].positions, abs=1e-6)


def test_one_trajectory_takes_over_from_another_in_motion() -> None:
    """It is planned from where the first will be, and joins it there."""
    drives, planner = ready()
    first = planner.follow(wave(drives, 60))
    run_until(drives, first.done)
    drives.run(120)
    before = len(drives.path) - 2
    goal = wave(drives, 20)
    second = planner.follow(goal)
    run_until(drives, second.done)
    drives.run(300)
    path = np.array(drives.path)[before:]
    jumps = np.abs(np.diff(path, 2, axis=0)) / PERIOD**2
    assert (jumps.max(axis=0) <= 1.02 * drives.desk.model.limits.acceleration).all()
    assert path[-1] == pytest.approx(goal.points[-1].positions, abs=1e-6)
    ending = first.result(0.0).ending
    assert ending is not None
    assert 'took over' in ending.reason


def test_a_trajectory_that_was_cancelled_before_it_began_does_not_begin() -> None:
    """The arm stays where it is."""
    drives, planner = ready()
    future = planner.follow(wave(drives, 60))
    assert future.cancel()
    planner._worker.submit(lambda: None).result(5.0)  # the planning before is done
    drives.run(50)
    assert drives.desk.snapshot.source is Source.NONE


def test_a_jog_that_ends_while_a_long_goal_is_planned_does_no_harm() -> None:
    """It comes to rest first, and the trajectory begins there: nobody can foresee a jog."""
    drives, planner = ready()
    goal = wave(drives, 300)
    drives.desk.submit(lambda core, now: core.jog({'panda_joint1': 0.4}, now, 0.5))
    drives.run(45)
    future = planner.follow(goal)
    run_until(drives, future.done)
    execution = future.result(0.0)
    off = 0.0
    for _ in range(300):
        drives.run()
        desired = execution.feedback.desired.position
        off = max(off, float(np.abs(drives.path[-1] - desired).max()))
    assert off < 1e-3


@pytest.mark.parametrize('always', [False, True])
def test_an_arm_that_was_moved_meanwhile_is_planned_for_again(
    always: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The way from elsewhere is another, and not looked at; if it never rests, words say so."""
    drives, planner = ready()
    plan = drives.desk.plan
    goal = TrajectoryGoal(
        drives.desk.model.joints, [GoalPoint(4.0, wave(drives, 2).points[0].positions)]
    )
    begins: list[float] = []

    def slow(goal: TrajectoryGoal, state: MotionState) -> Execution:
        begins.append(float(state.position[0]))
        execution = plan(goal, state)
        if always or len(begins) == 1:
            drives.desk.submit(lambda core, now: core.jog({'panda_joint1': 0.5}, now, 0.3))
            until = time.monotonic() + 10.0
            while abs(drives.axes[0].setpoint - begins[-1]) < 0.1 and time.monotonic() < until:
                time.sleep(PERIOD)
        return execution

    monkeypatch.setattr(drives.desk, 'plan', slow)
    future = planner.follow(goal)
    run_until(drives, future.done)
    if always:
        with pytest.raises(GoalError, match='panda_joint1 was moved by'):
            future.result(0.0)
        assert drives.desk.snapshot.source is not Source.TRAJECTORY
        return
    assert len(begins) == 2
    assert begins[1] - begins[0] > 0.05
    execution = future.result(0.0)
    drives.run(5)
    assert drives.path[-1] == pytest.approx(execution.feedback.desired.position, abs=0.02)


def test_a_goal_that_is_refused_does_not_stop_a_jog() -> None:
    """What moves the arm goes on."""
    drives, planner = ready()
    goal = wave(drives, 300)
    drives.desk.submit(lambda core, now: core.jog({'panda_joint1': 0.4}, now, 30.0))
    drives.run(45)
    wrong = replace(goal, joints=['elbow', *goal.joints[1:]])
    future = planner.follow(wrong)
    run_until(drives, future.done)
    with pytest.raises(GoalError, match='elbow'):
        future.result(0.0)
    drives.run(5)
    assert drives.desk.snapshot.source is Source.JOG


def test_refusals_reach_whoever_asked() -> None:
    """What is wrong with the goal, with the drives, and what the owner forbids."""
    drives, planner = ready()
    wrong: Future[Execution] = planner.follow(TrajectoryGoal(['elbow'], []))
    run_until(drives, wrong.done)
    with pytest.raises(GoalError, match='elbow'):
        wrong.result(0.0)
    drives.source.released('panda_joint1', Refusal(RefusalCause.SINGLE_TARGET))
    drives.run(3)
    blocked = planner.follow(wave(drives, 40))
    run_until(drives, blocked.done)
    with pytest.raises(NotReadyError, match='panda_joint1'):
        blocked.result(0.0)
    drives.attach()  # and at once a goal, before the next cycle
    accepted = planner.follow(wave(drives, 40))
    run_until(drives, accepted.done)
    accepted.result(0.0)

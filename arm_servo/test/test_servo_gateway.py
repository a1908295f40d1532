# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands through the gateway: prepared beside the cycle, begun in it, without a jump."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import threading
from typing import Any

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import table, texts
import numpy as np
import pytest
from servo_commands import Drives, jog, move_by, PERIOD, SteppedWorker, twist

from arm_canopen import Refusal, RefusalCause
from arm_model import CommandError, RobotModel
from arm_servo import MotionCore, NotReadyError, PauseRequest, Source, StopRequest
from arm_servo.core.gateway import MAX_ATTEMPTS, MAX_QUEUED_MOTIONS, MotionCommand, start_worker
from arm_servo.core.preparation import CommandBasis, Motion
from arm_servo.core.requests import MAX_CYCLE_AGE
from arm_trajectory import GoalCode, GoalError, GoalPoint, StateMovedError, TrajectoryGoal

pytestmark = pytest.mark.slow

JOINT = 'panda_joint1'


def wave(drives: Drives, count: int, age: float = 0.0) -> TrajectoryGoal:
    """Return a trajectory of many points, 0.05 s apart, that ends where it began."""
    begin = np.array([axis.setpoint for axis in drives.axes])
    shares = np.arange(1, count + 1) / count
    rows = begin + 0.2 * np.sin(np.pi * shares[:, None]) ** 2
    points = [GoalPoint(0.55 + 0.05 * n, row.tolist()) for n, row in enumerate(rows)]
    return TrajectoryGoal(drives.gateway.model.joints, points, age=age)


def taken_away(worker: SteppedWorker | None = None) -> Drives:
    """Return drives of which others have one, until a command gets it back."""
    drives = Drives(worker=worker).following()
    drives.gateway.get_ready = drives.source.get_ready
    drives.source.released(JOINT, Refusal(RefusalCause.SINGLE_TARGET))
    drives.run(3)
    assert drives.gateway.snapshot.blocked
    return drives


def begun(drives: Drives, command: MotionCommand, most: int = 200) -> None:
    """Run cycles until a motion has begun or was refused."""
    for _ in range(most):
        if command.future.done():
            return
        drives.run()
    raise AssertionError(f'it has not begun after {most} cycles')


def test_a_jog_that_ends_while_a_long_goal_is_planned_does_no_harm() -> None:
    """It comes to rest first, and the trajectory begins there: a jog cannot be foreseen."""
    drives = Drives().following()
    goal = wave(drives, 300)
    jog(drives.gateway, {JOINT: 0.4}, drives.now, 0.5)
    drives.run(45)
    command = drives.gateway.request(goal)
    begun(drives, command)
    assert command.execution is not None
    for _ in range(300):
        drives.run()
        desired = command.execution.feedback.desired.position
        assert drives.path[-1] == pytest.approx(desired, abs=1e-3)


@pytest.mark.parametrize('always', [False, True])
def test_an_arm_that_was_moved_meanwhile_is_planned_for_again(always: bool) -> None:
    """The path from elsewhere is another, and was not checked; at last the goal is refused."""
    worker = SteppedWorker()
    drives = Drives(worker=worker).following()
    there = wave(drives, 2).points[0].positions
    goal = TrajectoryGoal(drives.gateway.model.joints, [GoalPoint(4.0, there)])
    jog(drives.gateway, {JOINT: 0.5}, drives.now, 60.0 if always else 0.5)
    drives.run(30)
    command, plans = drives.gateway.request(goal), 0
    while not command.future.done():
        drives.run(30)  # the arm has moved since the plan's basis
        plans += worker.run()
        drives.run()
        assert plans <= MAX_ATTEMPTS
    if always:
        assert plans == MAX_ATTEMPTS
        assert isinstance(command.future.exception(), StateMovedError)
        assert drives.gateway.snapshot.source is Source.JOG
        return
    execution = command.execution
    assert execution is not None
    assert plans >= 2
    drives.run(5)
    assert drives.path[-1] == pytest.approx(execution.feedback.desired.position, abs=0.02)


def test_no_thread_is_started_in_a_cycle(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even by the first motion: the thread that prepares it is there from the start."""
    cycle = threading.get_ident()
    started: list[str] = []
    start = threading.Thread.start

    def noted(thread: threading.Thread) -> None:
        if threading.get_ident() == cycle:
            started.append(thread.name)
        start(thread)

    worker = start_worker()
    drives = Drives(worker=worker).following()
    monkeypatch.setattr(threading.Thread, 'start', noted)
    command = move_by(drives.gateway, {JOINT: 0.02})
    drives.run()  # which hands it over
    worker.shutdown()
    begun(drives, command)
    assert command.future.exception() is None
    assert started == []


def test_a_flood_is_refused() -> None:
    """What cannot be carried out in time is not kept for later."""
    drives = Drives().following()
    commands = [move_by(drives.gateway, {JOINT: 0.0001}) for _ in range(MAX_QUEUED_MOTIONS + 10)]
    assert isinstance(commands[-1].future.exception(0.0), NotReadyError)
    drives.run(2 * len(commands))
    assert all(command.future.done() for command in commands)


def test_a_zero_is_no_command_to_an_arm_that_does_not_follow() -> None:
    """It is not refused, so it neither shows in the status nor keeps the arm from recovering."""
    drives = Drives().following()
    drives.source.released(JOINT, Refusal(RefusalCause.SINGLE_TARGET))
    drives.run(3)
    zero = twist(drives.gateway, [0.0] * 6, drives.now)
    drives.run()
    assert zero.exception() is None
    assert drives.gateway.refused == -np.inf


def test_displacements_by_nothing_change_nothing() -> None:
    """Not a trajectory either; what is wrong is reported."""
    drives = Drives().following()
    command = drives.gateway.request(wave(drives, 20))
    begun(drives, command)
    drives.run(30)
    nothing = move_by(drives.gateway, {JOINT: 0.0})
    wrong = move_by(drives.gateway, {'elbow': 0.0})
    drives.run(4)
    assert nothing.future.result(0.0) is None
    assert nothing.ended.result(0.0).code is GoalCode.SUCCESSFUL
    assert isinstance(wrong.future.exception(0.0), CommandError)
    assert not command.ended.done()
    drives.run(300)
    assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL


def test_a_jog_that_is_refused_ends_nothing() -> None:
    """One that has expired, or one in a pause: what was requested before it begins."""
    worker = SteppedWorker()
    drives = Drives(worker=worker).following()
    begin = drives.path[-1]
    command = move_by(drives.gateway, {JOINT: 0.1})
    drives.run()
    late = jog(drives.gateway, {JOINT: 0.4}, drives.now, -0.2)
    drives.run()
    worker.run()
    drives.run(100)
    assert isinstance(late.exception(0.0), NotReadyError)
    assert command.ended.result(0.0).code is GoalCode.SUCCESSFUL
    assert drives.path[-1][0] - begin[0] == pytest.approx(0.1, abs=1e-6)


@pytest.mark.parametrize(
    'stops', [[StopRequest()], [PauseRequest(), PauseRequest(is_paused=False)]]
)
def test_a_jog_does_not_overtake_a_stop_that_comes_while_its_drives_are_fetched(
    stops: Sequence[StopRequest | PauseRequest],
) -> None:
    """The stop was called later: the arm stays where it is, also when a pause is over by then."""
    drives = Drives().following()
    before = drives.path[-1].tolist()

    def stop() -> bool:
        for request in stops:
            drives.gateway.command(request)
        return False

    drives.gateway.get_ready = stop
    jogged = jog(drives.gateway, {JOINT: 0.4}, drives.now, 1.0)
    drives.run(20)
    with pytest.raises(NotReadyError, match='stopped before it had begun'):
        jogged.result(0.0)
    assert drives.path[-1].tolist() == before


def test_the_time_in_which_drives_are_fetched_is_no_age_of_a_jog() -> None:
    """The cycle did not stand still; the jog itself says how long it counts."""
    drives = Drives().following()

    def fetch() -> bool:
        drives.now += 2.0 * MAX_CYCLE_AGE
        return True

    drives.gateway.get_ready = fetch
    jogged = jog(drives.gateway, {JOINT: 0.4}, drives.now, 5.0)
    drives.run(2)
    assert jogged.exception(0.0) is None
    assert drives.gateway.snapshot.source is Source.JOG


def test_a_zero_stops_its_jog_however_late_the_cycle_carries_it_out() -> None:
    """A stop is never refused, while the jog before it goes on to count."""
    drives = Drives().following()
    jog(drives.gateway, {JOINT: 0.4}, drives.now, 30.0)
    drives.run(50)
    zero = jog(drives.gateway, {JOINT: 0.0}, drives.now)
    drives.now += 2.0 * MAX_CYCLE_AGE
    drives.run(100)
    assert zero.exception(0.0) is None
    assert drives.gateway.snapshot.source is Source.NONE
    assert drives.path[-1].tolist() == drives.path[-2].tolist()


def test_a_long_trajectory_waits_until_a_fast_jog_has_been_braked() -> None:
    """That takes more than a second where the acceleration is the default of MoveIt."""
    limits = {
        name: {**each, 'has_acceleration_limits': False} for name, each in table('panda').items()
    }
    drives = Drives(model=RobotModel(*texts('panda'), limits)).following()
    begin = [axis.setpoint for axis in drives.axes]
    jog(drives.gateway, {JOINT: 2.0}, drives.now, 1.5)
    drives.run(150)
    assert drives.path[-1][0] - drives.path[-2][0] > 1.2 * PERIOD
    points = [GoalPoint(20.0, begin)]
    command = drives.gateway.request(TrajectoryGoal(drives.gateway.model.joints, points))
    drives.run(300)
    assert command.future.result(0.0) is not None


@pytest.mark.parametrize('before', ['rest', 'jog', 'trajectory'])
@pytest.mark.parametrize('points', [20, 60])
@given(st.integers(0, 25), st.sampled_from([-0.5, -0.9, -0.3]))
@settings(max_examples=6, deadline=None)
def test_a_stamped_trajectory_keeps_its_times(
    before: str, points: int, worked: int, age: float
) -> None:
    """However long its preparation takes: it begins at its stamp, and not that much later."""
    worker = SteppedWorker()
    drives = Drives(worker=worker).following()
    if before == 'trajectory':
        drives.gateway.request(wave(drives, 40))
        drives.run(2)
        worker.run()
        drives.run(10)
    elif before == 'jog':
        jog(drives.gateway, {JOINT: 0.05}, drives.now, 0.05)
        drives.run(3)
    requested = drives.now
    command = drives.gateway.request(wave(drives, points, age))
    drives.run(1 + (worked if age < -0.4 and before == 'rest' else 0))
    for _ in range(120):
        worker.run()
        drives.run()
    execution = command.future.result(0.0)
    assert execution is not None
    due = drives.now - requested + age
    assert execution.feedback.time == pytest.approx(due, abs=1.6 * PERIOD)


def test_a_long_goal_that_is_refused_at_rest_does_not_end_a_jog(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The jog is held for it, and goes on: where it has come to rest, there is no way any more."""
    drives = Drives().following()
    plan, attempts = MotionCore.plan, 0

    def plan_once(core: MotionCore, request: Any, basis: CommandBasis) -> Motion | None:
        nonlocal attempts
        attempts += isinstance(request, TrajectoryGoal)
        if attempts > 1:
            raise GoalError(GoalCode.INVALID_GOAL, 'the elbow would collide')
        return plan(core, request, basis)

    monkeypatch.setattr(MotionCore, 'plan', plan_once)
    goal = wave(drives, 300)
    jog(drives.gateway, {JOINT: 0.4}, drives.now, 30.0)
    drives.run(40)
    command = drives.gateway.request(goal)
    begun(drives, command)
    assert isinstance(command.future.exception(0.0), GoalError)
    assert attempts == 2
    drives.run(40)
    assert drives.gateway.snapshot.source is Source.JOG
    assert (drives.path[-1][0] - drives.path[-2][0]) / PERIOD == pytest.approx(0.4, abs=1e-3)


@pytest.mark.parametrize('is_wrong', [False, True])
def test_a_goal_that_is_refused_takes_no_drive_from_anyone(is_wrong: bool) -> None:
    """Others move the arm: it is tried from where the arm stands before they are thrown out."""
    drives = taken_away()
    goal = wave(drives, 20)
    if is_wrong:
        goal = replace(goal, points=[replace(goal.points[0], positions=[9.0] * 7)])
    before = len(drives.attachments)
    command = drives.gateway.request(goal)
    begun(drives, command)
    assert isinstance(command.future.exception(0.0), GoalError) is is_wrong
    assert len(drives.attachments) == before + (not is_wrong)
    assert bool(drives.gateway.snapshot.blocked) is is_wrong


def test_a_motion_that_a_stop_made_void_takes_no_drive_from_anyone() -> None:
    """The stop came while it was tried from where the arm stands."""
    worker = SteppedWorker()
    drives = taken_away(worker)
    before = len(drives.attachments)
    command = drives.gateway.request(wave(drives, 20))
    drives.gateway.command(StopRequest())
    while worker.run():
        drives.run()
    assert isinstance(command.future.exception(0.0), NotReadyError)
    assert len(drives.attachments) == before


def test_a_motion_is_tried_from_where_the_arm_is_when_its_turn_comes() -> None:
    """The one before has got the drives back, and leads to where there is room for this one."""
    drives = taken_away()
    begin = drives.path[-1][0]
    room = begin - drives.gateway.model.limits.lower[0]
    there = move_by(drives.gateway, {JOINT: 0.3})
    back = move_by(drives.gateway, {JOINT: -room - 0.1})
    drives.run(600)
    assert there.future.exception(0.0) is None
    assert back.future.exception(0.0) is None
    assert drives.path[-1][0] == pytest.approx(begin - room + 0.2, abs=1e-6)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""No stop is overtaken: every kind of stop at every moment of every kind of command.

A command goes through the cycle and a worker; the tests decide when each takes its next step, so
a stop is put between any two of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from servo_commands import Drives, Elsewhere, jog, move_by, PERIOD, SteppedWorker, twist

from arm_canopen import Refusal, RefusalCause
from arm_model import Array, combined, Pose
from arm_servo import JogRequest, PauseRequest, PoseCommand, Source, StopRequest, TwistCommand
from arm_servo.controllers.controller import JOGGING
from arm_servo.core.gateway import CommandGateway, MotionCommand
from arm_trajectory import GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

SETTLED = 400  # cycles in which everything has come to rest
AT_REST = 50  # cycles without motion after which nothing begins by itself any more

Give = Callable[[CommandGateway, float, Array], MotionCommand | None]


def _twist(gateway: CommandGateway, now: float, _at: Array) -> None:
    twist(gateway, [0.0, 0.1, 0.1, 0.0, 0.0, 0.3], now, 60.0)


def _jog(gateway: CommandGateway, now: float, _at: Array) -> None:
    jog(gateway, {gateway.model.joints[0]: 0.5}, now, 60.0)


def _pose(gateway: CommandGateway, now: float, at: Array) -> None:
    there = combined(gateway.model.pose(at), Pose(np.eye(3), np.array([0.0, 0.05, 0.05])))
    gateway.command(JogRequest(PoseCommand(there), now + 60.0))


def _displacement(gateway: CommandGateway, _now: float, _at: Array) -> MotionCommand:
    return move_by(gateway, {gateway.model.joints[0]: 0.4})


def _goal(gateway: CommandGateway, at: Array, count: int, age: float = 0.0) -> TrajectoryGoal:
    steps = np.linspace(0.0, 0.3, count + 1)[1:]
    points = [
        GoalPoint(1.0 + 3.0 * number / count, [at[0] + step, *at[1:].tolist()])
        for number, step in enumerate(steps.tolist())
    ]
    return TrajectoryGoal(gateway.model.joints, points, age=age)


def _trajectory(gateway: CommandGateway, _now: float, at: Array) -> MotionCommand:
    return gateway.request(_goal(gateway, at, 3))


def _long_trajectory(gateway: CommandGateway, _now: float, at: Array) -> MotionCommand:
    return gateway.request(_goal(gateway, at, 80))


def _stamped_trajectory(gateway: CommandGateway, _now: float, at: Array) -> MotionCommand:
    return gateway.request(_goal(gateway, at, 3, age=-0.15))


JOGS: dict[str, Give] = {
    'twist': _twist,
    'jog': _jog,
    'pose': _pose,
    'displacement': _displacement,
}
TRAJECTORIES: dict[str, Give] = {
    'trajectory': _trajectory,
    'long trajectory': _long_trajectory,
    'stamped trajectory': _stamped_trajectory,
}
COMMANDS = JOGS | TRAJECTORIES

STEPS = st.lists(st.sampled_from(['cycle', 'cycle', 'work']), max_size=14)
LATER = st.sampled_from([0, 0, 0, 5, 20, 60])
"""Cycles between the steps of the command and the stop: 0 for while it is prepared."""


class Bench:
    """An arm, the worker of its commands, and what has happened since the stop."""

    def __init__(self, arm: Drives | Elsewhere, worker: SteppedWorker) -> None:
        self.arm, self.gateway, self._worker = arm, arm.gateway, worker
        self.arm.run(3)

    @property
    def at(self) -> Array:
        """Where the arm was sent last."""
        point = self.gateway.snapshot.set_point
        assert point is not None
        return point.state.position

    def take(self, steps: list[str]) -> None:
        """Step the cycle and the worker."""
        for step in steps:
            if step == 'cycle':
                self.arm.run()
            else:
                self._worker.run()

    def settle(self) -> list[Array]:
        """Run until all is prepared and at rest; return where the arm was in each cycle."""
        path = [self.where]
        for _ in range(SETTLED):
            self._worker.run()
            self.arm.run()
            path.append(self.where)
            rested = len(path) > AT_REST and (path[-AT_REST] == path[-1]).all()
            if rested and self._worker.is_idle:
                return path
        raise AssertionError('the arm does not come to rest')

    @property
    def where(self) -> Array:
        """Where the drives were sent."""
        if isinstance(self.arm, Elsewhere):
            return np.array(self.arm.at)
        return np.array([axis.setpoint for axis in self.arm.axes])


def bench(at_topics: bool = False) -> Bench:
    """Return an arm that follows."""
    worker = SteppedWorker()
    if at_topics:
        return Bench(Elsewhere(worker=worker), worker)
    drives = Drives(worker=worker)
    drives.attach()
    return Bench(drives, worker)


def stays_at_rest(path: list[Array], limits: Array, speed: float) -> None:
    """Make sure that the arm only brakes from the stop on, and rests at last."""
    speeds = np.abs(np.diff(np.array(path), axis=0)) / PERIOD
    # what was in this very cycle still counts; then nothing gets faster
    assert speeds.max() <= 1.1 * speed + 2.0 * float(limits.max()) * PERIOD + 1e-9


def run_to_stop(
    arm: Bench, kind: str, steps: list[str], later: int
) -> tuple[MotionCommand | None, float, bool]:
    """Give a command and let it go some way; return it, the speed, and whether it stands still."""
    command = COMMANDS[kind](arm.gateway, arm.arm.now, arm.at)
    arm.take(steps)
    before = arm.where
    for _ in range(later):
        arm.take(['work'])
        before = arm.where
        arm.take(['cycle'])
    snapshot = arm.gateway.snapshot
    assert snapshot.set_point is not None
    state, limits = snapshot.set_point.state, arm.gateway.model.limits
    coming = state.acceleration**2 / (2.0 * limits.jerk)  # while the acceleration is taken back
    speed = float((np.abs(state.velocity) + coming).max())
    speed = max(speed, float(np.abs(arm.where - before).max()) / PERIOD)
    return command, speed, snapshot.source is Source.NONE


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER)
@example('displacement', ['cycle'], 0)
@example('displacement', ['cycle', 'work'], 0)
@example('long trajectory', ['cycle', 'work', 'cycle'], 0)
@example('stamped trajectory', ['cycle', 'work', 'cycle'], 5)
@settings(max_examples=30, deadline=None)
def test_a_pause_is_never_overtaken(kind: str, steps: list[str], later: int) -> None:
    """``~/pause``: the arm rests; a trajectory goes on with ``~/resume``, nothing before it."""
    arm = bench()
    command, speed, is_idle = run_to_stop(arm, kind, steps, later)
    begin = arm.where
    arm.gateway.command(PauseRequest())
    path = arm.settle()
    stays_at_rest(path, arm.gateway.model.limits.acceleration, speed)
    if is_idle:
        assert np.abs(path[-1] - begin).max() == 0.0
    arm.gateway.command(PauseRequest(is_paused=False))
    arm.take(['cycle', 'work'] * 10)
    if command is not None and kind in TRAJECTORIES:
        assert command.execution is not None, command.future.exception()


@given(st.sampled_from(sorted(JOGS)), STEPS)
@example('displacement', ['cycle'])
@example('displacement', ['cycle', 'work'])
@settings(max_examples=30, deadline=None)
def test_a_pause_that_ends_at_once_counts(kind: str, steps: list[str]) -> None:
    """``~/pause`` and ``~/resume`` before a jog has begun: it does not begin afterwards."""
    arm = bench()
    command, _, is_idle = run_to_stop(arm, kind, steps, 0)
    assume(is_idle)
    begin = arm.where
    arm.gateway.command(PauseRequest())
    arm.gateway.command(PauseRequest(is_paused=False))
    path = arm.settle()
    assert np.abs(path[-1] - begin).max() == 0.0
    assert command is None or command.future.done()


@given(st.sampled_from(sorted(JOGS)), STEPS, LATER)
@example('displacement', ['cycle'], 0)
@example('displacement', ['cycle', 'work'], 0)
@settings(max_examples=30, deadline=None)
def test_a_pause_of_the_servo_is_never_overtaken(kind: str, steps: list[str], later: int) -> None:
    """``~/pause_servo``: whatever was commanded before it does not move the arm after it."""
    arm = bench()
    command, speed, is_idle = run_to_stop(arm, kind, steps, later)
    begin = arm.where
    arm.gateway.command(StopRequest('the servo was paused', JOGGING))
    path = arm.settle()
    stays_at_rest(path, arm.gateway.model.limits.acceleration, speed)
    if is_idle:
        assert np.abs(path[-1] - begin).max() == 0.0
    assert arm.gateway.snapshot.source is Source.NONE
    assert command is None or command.future.done()


@given(st.sampled_from([*sorted(TRAJECTORIES), 'displacement']), STEPS, LATER, st.booleans())
@settings(max_examples=30, deadline=None)
def test_a_cancel_is_never_overtaken(
    kind: str, steps: list[str], later: int, jogged: bool
) -> None:
    """A goal that was canceled does not move the arm, however far it had come."""
    arm = bench()
    if jogged:  # then a long trajectory lets the arm come to rest first
        jog(arm.gateway, {arm.gateway.model.joints[0]: 0.3}, arm.arm.now, 0.3)
        arm.take(['cycle'] * 10)
    command, speed, is_idle = run_to_stop(arm, kind, steps, later)
    assert command is not None
    begin = arm.where
    arm.gateway.cancel(command, 'canceled')
    path = arm.settle()
    if not jogged:
        stays_at_rest(path, arm.gateway.model.limits.acceleration, speed)
        if is_idle:
            assert np.abs(path[-1] - begin).max() == 0.0
    assert arm.gateway.snapshot.source is Source.NONE
    assert command.future.done()
    if command.execution is not None:
        assert command.execution.ending is not None
        is_arrived = command.execution.ending.reason == 'the goal is reached'
        assert command.execution.ending.canceled or is_arrived


@pytest.mark.parametrize('is_disabled', [False, True])
@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER, STEPS)
@example('displacement', ['cycle'], 0, ['cycle'])
@example('displacement', ['cycle', 'work'], 0, ['cycle'])
@example('trajectory', ['cycle', 'work'], 0, ['cycle'])
@example('trajectory', ['cycle'], 0, ['cycle', 'cycle'])
@settings(max_examples=20, deadline=None)
def test_a_halt_is_never_overtaken(
    is_disabled: bool, kind: str, steps: list[str], later: int, halted: list[str]
) -> None:
    """``~/halt`` or a disable of one drive: back again, nothing from before moves the arm."""
    arm = bench()
    drives = arm.arm
    assert isinstance(drives, Drives)
    command, speed, is_idle = run_to_stop(arm, kind, steps, later)
    begin = arm.where
    healthy = drives.axes[2]
    if is_disabled:
        drives.axes[2] = replace(
            healthy, followable=False, refusal=Refusal(RefusalCause.NOT_ENABLED), velocity=0.0
        )
    else:
        drives.source.released(healthy.name, Refusal(RefusalCause.HALTED))
    drives.run()  # the cycle sees it
    arm.take(halted)
    if is_disabled:
        drives.axes[2] = replace(healthy, velocity=0.0)
    drives.attach()
    path = arm.settle()
    stays_at_rest(path, arm.gateway.model.limits.acceleration, speed)
    if is_idle:
        assert np.abs(path[-1] - begin).max() == 0.0
    assert arm.gateway.snapshot.source is Source.NONE
    assert command is None or command.future.done()


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER)
@settings(max_examples=20, deadline=None)
def test_the_end_of_the_program_is_never_overtaken(
    kind: str, steps: list[str], later: int
) -> None:
    """Ctrl-C: the arm comes to rest, and nothing begins any more."""
    arm = bench(at_topics=True)
    topics = arm.arm
    assert isinstance(topics, Elsewhere)
    command, speed, is_idle = run_to_stop(arm, kind, steps, later)
    begin = arm.where
    topics.cycle.closing = 'the program ends'
    path = arm.settle()
    stays_at_rest(path, arm.gateway.model.limits.acceleration, speed)
    if is_idle:
        assert np.abs(path[-1] - begin).max() == 0.0
    assert topics.cycle.at_rest
    assert command is None or command.future.done()


def goes_on(path: Array, limits: Array) -> None:
    """Make sure that no speed jumps."""
    changes = np.abs(np.diff(path, 2, axis=0)) / PERIOD**2
    assert (changes <= 1.02 * limits + 1e-6).all()


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER, st.sampled_from(sorted(COMMANDS)), STEPS)
@example('long trajectory', ['cycle', 'work', 'cycle'], 0, 'jog', ['cycle'])
@example('stamped trajectory', ['cycle'], 0, 'displacement', ['cycle'])
@example('displacement', ['cycle', 'work'], 0, 'twist', ['cycle'])
@settings(max_examples=80, deadline=None)
def test_the_newest_of_two_commands_counts(
    older: str, steps: list[str], later: int, newer: str, more: list[str]
) -> None:
    """Every kind at every moment of every other: none takes the arm from a newer one."""
    arm = bench()
    first, *_ = run_to_stop(arm, older, steps, later)
    arm.take(['cycle'])
    second = COMMANDS[newer](arm.gateway, arm.arm.now, arm.at)
    arm.take(more)
    was_newer = False
    for _ in range(60):
        arm.take(['work', 'cycle'])
        source = arm.gateway.snapshot.source
        if newer in {'twist', 'jog', 'pose'}:
            assert source is Source.JOG
            continue
        assert second is not None
        is_newer = second.motion is not None
        assert is_newer or not was_newer
        was_newer = is_newer
        if is_newer and source is not Source.NONE:
            kind = Source.TRAJECTORY if newer in TRAJECTORIES else Source.TARGET
            assert source is kind
    if newer in JOGS and newer != 'displacement':
        assert first is None or first.ended.done()
    else:
        assert second is not None
        assert second.motion is not None, second.future.exception()
        if first is not None and older != newer:
            assert first.ended.done()
    assert isinstance(arm.arm, Drives)
    goes_on(np.array(arm.arm.path), arm.gateway.model.limits.acceleration)


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER, st.booleans())
@settings(max_examples=30, deadline=None)
def test_a_command_of_nothing_changes_nothing(
    kind: str, steps: list[str], later: int, is_displaced: bool
) -> None:
    """Zeros of somebody else, at every moment of every command: it goes on as without them."""
    # motions are prepared one after the other, so another one begins at another cycle
    assume(not (is_displaced and kind in {'displacement', *TRAJECTORIES}))
    paths = []
    for is_disturbed in (False, True):
        arm = bench()
        assert isinstance(arm.arm, Drives)
        run_to_stop(arm, kind, steps, later)
        for _ in range(30):
            if is_disturbed and is_displaced:
                move_by(arm.gateway, {arm.gateway.model.joints[0]: 0.0})
            elif is_disturbed:
                still = TwistCommand(np.zeros(6))
                arm.gateway.command(JogRequest(still, arm.arm.now + 1.0, client='somebody else'))
            arm.take(['work', 'work', 'cycle'])
        paths.append(np.array(arm.arm.path))
    assert paths[1] == pytest.approx(paths[0], abs=1e-12)


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER)
@example('displacement', ['cycle', 'work', *['cycle'] * 7], 60)  # it has just arrived
@settings(max_examples=30, deadline=None)
def test_a_core_that_raises_ends_every_command(kind: str, steps: list[str], later: int) -> None:
    """At every moment of every command: it ends once, with words, and nothing begins after it."""
    arm = bench()
    drives = arm.arm
    assert isinstance(drives, Drives)
    command, *_ = run_to_stop(arm, kind, steps, later)
    motion = None if command is None else command.motion
    is_over = motion is not None and motion.outcome is not None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arm.gateway._core, 'step', lambda *_: 1 // 0)
        with pytest.raises(ZeroDivisionError):
            drives.run()
    if command is not None and command.motion is None:
        arm.take(['work'] * 3)
    if command is not None:
        assert is_over or 'ZeroDivisionError' in command.ended.result(0.0).reason
    assert arm.gateway.snapshot.source is Source.NONE
    drives.attach()
    begin = arm.where
    path = arm.settle()
    assert np.abs(path[-1] - begin).max() == 0.0

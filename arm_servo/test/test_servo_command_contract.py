# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""No stop is overtaken: every kind of stop at every moment of every kind of command.

A command goes through the cycle and a worker; the tests decide when each takes its next step, so
a stop is put between any two of them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from servo_commands import (
    Drives,
    Elsewhere,
    jog,
    move_by,
    no_speed_jumps,
    PERIOD,
    SteppedWorker,
    twist,
)

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


@dataclass(frozen=True, slots=True, eq=False)
class Begun:
    """What was under way when a stop came."""

    command: MotionCommand | None
    speed: float  # [rad/s], with what it comes to while the acceleration is taken back
    place: Array
    is_idle: bool  # whether nothing moves the arm yet


class Bench:
    """An arm, the worker of its commands, and what has happened since the stop."""

    def __init__(self, at_topics: bool = False) -> None:
        self._worker = SteppedWorker()
        self.arm: Drives | Elsewhere
        if at_topics:
            self.arm = Elsewhere(worker=self._worker)
        else:
            self.arm = Drives(worker=self._worker).following(0)
        self.gateway, self.limits = self.arm.gateway, self.arm.gateway.model.limits
        self.arm.run(3)

    @property
    def drives(self) -> Drives:
        """The drives of this process."""
        assert isinstance(self.arm, Drives)
        return self.arm

    @property
    def at(self) -> Array:
        """Where the arm was sent last."""
        point = self.gateway.snapshot.set_point
        assert point is not None
        return point.state.position

    @property
    def where(self) -> Array:
        """Where the drives were sent."""
        if isinstance(self.arm, Elsewhere):
            return np.array(self.arm.at)
        return np.array([axis.setpoint for axis in self.drives.axes])

    def take(self, steps: list[str]) -> None:
        """Step the cycle and the worker."""
        for step in steps:
            if step == 'cycle':
                self.arm.run()
            else:
                self._worker.run()

    def begin(self, kind: str, steps: list[str], later: int) -> Begun:
        """Give a command and let it go some way."""
        command = COMMANDS[kind](self.gateway, self.arm.now, self.at)
        self.take(steps)
        before = self.where
        for _ in range(later):
            self.take(['work'])
            before = self.where
            self.take(['cycle'])
        snapshot = self.gateway.snapshot
        assert snapshot.set_point is not None
        state = snapshot.set_point.state
        coming = state.acceleration**2 / (2.0 * self.limits.jerk)
        speed = float((np.abs(state.velocity) + coming).max())
        speed = max(speed, float(np.abs(self.where - before).max()) / PERIOD)
        return Begun(command, speed, self.where, snapshot.source is Source.NONE)

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

    def only_brakes(self, begun: Begun) -> None:
        """Make sure that the arm only brakes from the stop on, and rests at last."""
        path = self.settle()
        speeds = np.abs(np.diff(np.array(path), axis=0)) / PERIOD
        # what was in this very cycle still counts; then nothing gets faster
        more = 2.0 * float(self.limits.acceleration.max()) * PERIOD
        assert speeds.max() <= 1.1 * begun.speed + more + 1e-9
        if begun.is_idle:
            assert np.abs(path[-1] - begun.place).max() == 0.0


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER)
@example('displacement', ['cycle'], 0)
@example('displacement', ['cycle', 'work'], 0)
@example('long trajectory', ['cycle', 'work', 'cycle'], 0)
@example('stamped trajectory', ['cycle', 'work', 'cycle'], 5)
@settings(max_examples=30, deadline=None)
def test_a_pause_is_never_overtaken(kind: str, steps: list[str], later: int) -> None:
    """``~/pause``: the arm rests; a trajectory goes on with ``~/resume``, nothing before it."""
    arm = Bench()
    begun = arm.begin(kind, steps, later)
    arm.gateway.command(PauseRequest())
    arm.only_brakes(begun)
    arm.gateway.command(PauseRequest(is_paused=False))
    arm.take(['cycle', 'work'] * 10)
    if begun.command is not None and kind in TRAJECTORIES:
        assert begun.command.execution is not None, begun.command.future.exception()


@given(st.sampled_from([*sorted(TRAJECTORIES), 'displacement']), STEPS, LATER, st.booleans())
@settings(max_examples=30, deadline=None)
def test_a_cancel_is_never_overtaken(
    kind: str, steps: list[str], later: int, jogged: bool
) -> None:
    """A goal that was canceled does not move the arm, however far it had come."""
    arm = Bench()
    if jogged:  # then a long trajectory lets the arm come to rest first
        jog(arm.gateway, {arm.gateway.model.joints[0]: 0.3}, arm.arm.now, 0.3)
        arm.take(['cycle'] * 10)
    begun = arm.begin(kind, steps, later)
    command = begun.command
    assert command is not None
    arm.gateway.cancel(command, 'canceled')
    if jogged:
        arm.settle()
    else:
        arm.only_brakes(begun)
    assert arm.gateway.snapshot.source is Source.NONE
    assert command.future.done()
    if command.execution is not None:
        assert command.execution.ending is not None
        is_arrived = command.execution.ending.reason == 'the goal is reached'
        assert command.execution.ending.canceled or is_arrived


def pause_servo(arm: Bench, _steps: list[str]) -> None:
    """Stop jogs and displacements, as ``~/pause_servo`` does."""
    arm.gateway.command(StopRequest('the servo was paused', JOGGING))


def pause_briefly(arm: Bench, _steps: list[str]) -> None:
    """Pause and resume the arm before a jog has begun."""
    arm.gateway.command(PauseRequest())
    arm.gateway.command(PauseRequest(is_paused=False))


def halt(arm: Bench, steps: list[str]) -> None:
    """Halt a drive, as its ``~/halt`` does, and take it back some steps later."""
    arm.drives.source.released(arm.drives.axes[2].name, Refusal(RefusalCause.HALTED))
    arm.take(['cycle', *steps])  # the cycle sees it
    arm.drives.attach()


def disable(arm: Bench, steps: list[str]) -> None:
    """Disable a drive, and enable it some steps later."""
    axis, disabled = arm.drives.axes[2], Refusal(RefusalCause.NOT_ENABLED)
    arm.drives.axes[2] = replace(axis, followable=False, refusal=disabled, velocity=0.0)
    arm.take(['cycle', *steps])
    arm.drives.axes[2] = replace(axis, velocity=0.0)
    arm.drives.attach()


def end(arm: Bench, _steps: list[str]) -> None:
    """End the program, as Ctrl-C does."""
    assert isinstance(arm.arm, Elsewhere)
    arm.arm.cycle.closing = 'the program ends'


@pytest.mark.parametrize('stop', [pause_servo, pause_briefly, halt, disable, end])
@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER, STEPS)
@example('displacement', ['cycle'], 0, ['cycle'])
@example('displacement', ['cycle', 'work'], 0, ['cycle'])
@example('trajectory', ['cycle', 'work'], 0, ['cycle'])
@example('trajectory', ['cycle'], 0, ['cycle', 'cycle'])
@settings(max_examples=20, deadline=None)
def test_a_stop_is_never_overtaken(
    stop: Callable[[Bench, list[str]], None],
    kind: str,
    steps: list[str],
    later: int,
    halted: list[str],
) -> None:
    """Whatever was commanded before it does not move the arm after it, also back again."""
    if stop in {pause_servo, pause_briefly} and kind not in JOGS:
        kind = 'displacement'  # trajectories go on after these stops
    if stop is pause_briefly:  # before two steps are over no displacement has begun
        steps, later = steps[:2], 0
    arm = Bench(at_topics=stop is end)
    begun = arm.begin(kind, steps, later)
    assume(stop is not pause_briefly or begun.is_idle)
    stop(arm, halted)
    arm.only_brakes(begun)
    assert arm.gateway.snapshot.source is Source.NONE
    assert begun.command is None or begun.command.future.done()
    assert isinstance(arm.arm, Drives) or arm.arm.cycle.at_rest


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER, st.sampled_from(sorted(COMMANDS)), STEPS)
@example('long trajectory', ['cycle', 'work', 'cycle'], 0, 'jog', ['cycle'])
@example('stamped trajectory', ['cycle'], 0, 'displacement', ['cycle'])
@example('displacement', ['cycle', 'work'], 0, 'twist', ['cycle'])
@settings(max_examples=50, deadline=None)
def test_the_newest_of_two_commands_counts(
    older: str, steps: list[str], later: int, newer: str, more: list[str]
) -> None:
    """Every kind at every moment of every other: none takes the arm from a newer one."""
    arm = Bench()
    first = arm.begin(older, steps, later).command
    arm.take(['cycle'])
    second = COMMANDS[newer](arm.gateway, arm.arm.now, arm.at)
    arm.take(more)
    was_newer = False
    for _ in range(60):
        arm.take(['work', 'cycle'])
        source = arm.gateway.snapshot.source
        if second is None:
            assert source is Source.JOG
            continue
        is_newer = second.motion is not None
        assert is_newer or not was_newer
        was_newer = is_newer
        if is_newer and source is not Source.NONE:
            kind = Source.TRAJECTORY if newer in TRAJECTORIES else Source.TARGET
            assert source is kind
    assert second is None or second.motion is not None, second.future.exception()
    if first is not None and older != newer:
        assert first.ended.done()
    no_speed_jumps(np.array(arm.drives.path), arm.limits.acceleration)


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
        arm = Bench()
        arm.begin(kind, steps, later)
        for _ in range(30):
            if is_disturbed and is_displaced:
                move_by(arm.gateway, {arm.gateway.model.joints[0]: 0.0})
            elif is_disturbed:
                still = TwistCommand(np.zeros(6))
                arm.gateway.command(JogRequest(still, arm.arm.now + 1.0, client='somebody else'))
            arm.take(['work', 'work', 'cycle'])
        paths.append(np.array(arm.drives.path))
    assert paths[1] == pytest.approx(paths[0], abs=1e-12)


@given(st.sampled_from(sorted(COMMANDS)), STEPS, LATER)
@example('displacement', ['cycle', 'work', *['cycle'] * 7], 60)  # it has just arrived
@settings(max_examples=30, deadline=None)
def test_a_core_that_raises_ends_every_command(kind: str, steps: list[str], later: int) -> None:
    """At every moment of every command: it ends once, with words, and nothing begins after it."""
    arm = Bench()
    command = arm.begin(kind, steps, later).command
    motion = None if command is None else command.motion
    is_over = motion is not None and motion.outcome is not None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arm.gateway._core, 'step', lambda *_: 1 // 0)
        with pytest.raises(ZeroDivisionError):
            arm.drives.run()
    if command is not None:
        if command.motion is None:
            arm.take(['work'] * 3)
        assert is_over or 'ZeroDivisionError' in command.ended.result(0.0).reason
    assert arm.gateway.snapshot.source is Source.NONE
    assert set(arm.drives.run()) == {None}  # until its drives are taken back
    arm.drives.attach()
    begin = arm.where
    assert np.abs(arm.settle()[-1] - begin).max() == 0.0
    assert None not in arm.drives.run()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Cores behind a gateway, cycle by cycle: commands, ideal drives without a bus, arms elsewhere."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import replace
from functools import cache
from typing import Any

from core_commands import ending
from model_robots import ready, robot, table, texts
import numpy as np

from arm_canopen import AxisFeedback, DriveState, MotionSource, Setpoint
from arm_model import Array, RobotModel
import arm_servo
from arm_servo import MotionCore, SetPoint
from arm_servo.core.gateway import CommandGateway, MotionCommand
from arm_servo.core.requests import by_joint
from arm_servo.drive_source import DriveSource
from arm_servo.motion_thread import FollowingLimits, FollowingWatch, JointFeedback, MotionCycle
from arm_trajectory import GoalPoint, TrajectoryGoal

PERIOD = 0.01


class Drives:
    """Drives that go to their set-points at once."""

    def __init__(
        self,
        name: str = 'panda',
        worker: Executor | None = None,
        model: RobotModel | None = None,
        begin: Sequence[float] | None = None,
        settings: arm_servo.CoreSettings | None = None,
    ) -> None:
        self.now = 100.0
        core = MotionCore(model or robot(name), settings)
        # commands to the core that moves them
        self.gateway = CommandGateway(core, worker or InlineWorker(), lambda: self.now)
        self.source = DriveSource(self.gateway, self._attached)  # the source under test
        self.gateway.get_ready = lambda: False  # a test says when
        self.axes = [
            AxisFeedback(joint, True, DriveState.OPERATION_ENABLED, 8, at, 0.0, at, True)
            for joint, at in zip(
                self.gateway.model.joints, begin or ready(name).tolist(), strict=True
            )
        ]  # state of each drive; to be changed by tests
        self.path: list[Array] = []  # positions commanded so far, a row for each cycle
        self.attachments: list[MotionSource] = []

    def attach(self) -> None:
        """Give the source its drives."""
        self.source.get_ready()

    def following(self, cycles: int = 2) -> Drives:
        """Give the source its drives, and run some cycles."""
        self.attach()
        self.run(cycles)
        return self

    def _attached(self, source: MotionSource) -> Future[None]:
        self.attachments.append(source)
        future = Future[None]()
        future.set_result(None)
        return future

    def run(self, cycles: int = 1) -> Sequence[Setpoint | None]:
        """Run some cycles; return the set-points of the last."""
        answer: Sequence[Setpoint | None] = []
        for _ in range(cycles):
            self.now += PERIOD
            answer = self.source.update(self.now, PERIOD, self.axes)
            for number, point in enumerate(answer):
                if point is not None:
                    self.axes[number] = replace(
                        self.axes[number],
                        position=point.position,
                        setpoint=point.position,
                        velocity=point.velocity,
                    )
            self.path.append(np.array([axis.setpoint for axis in self.axes]))
        return answer


class Elsewhere:
    """An arm whose drives take set-points, and publish their state."""

    def __init__(
        self, following: FollowingLimits | None = None, worker: Executor | None = None
    ) -> None:
        model = robot('gp110')
        self.now = 50.0
        self.at = np.array(ready('gp110'))  # where it is in [rad]
        self.is_published = True  # whether its state is published
        self.moves = True  # whether it goes to set-points
        self.delay = 0  # how many set-points it is behind
        self.sag = 0.0  # how far it stands below its set-points in [rad]
        self.points: list[SetPoint] = []  # all set-points so far
        self._way: deque[Array] = deque()
        self.gateway = CommandGateway(
            MotionCore(model), worker or InlineWorker(), lambda: self.now
        )
        self.feedback = JointFeedback(model.joints, 0.2)
        watch = FollowingWatch(model.limits, following or FollowingLimits(), PERIOD)
        self.cycle = MotionCycle(self.gateway, self.feedback, self.take, watch)

    def take(self, point: SetPoint) -> None:
        """Go to a set-point, at once or some cycles later."""
        self.points.append(point)
        self._way.append(np.array(point.state.position))
        while len(self._way) > self.delay:
            here = self._way.popleft()
            self.at = here if self.moves else self.at

    def run(self, cycles: int = 1) -> None:
        """Run some cycles."""
        for _ in range(cycles):
            self.now += PERIOD
            if self.is_published:
                at = (self.at - self.sag).tolist()
                self.feedback.receive(self.gateway.model.joints, at, [], self.now)
            self.cycle.step(self.now, PERIOD)

    def following(self) -> Elsewhere:
        """Run some cycles, so that its place is known."""
        self.run(5)
        return self

    def path(self) -> Array:
        """Return the positions commanded so far, a row for each."""
        return np.array([point.state.position for point in self.points])


def swing(arm: Elsewhere, far: float = 0.3) -> TrajectoryGoal:
    """Return a trajectory of all joints."""
    return TrajectoryGoal(arm.gateway.model.joints, [GoalPoint(2.0, (arm.at + far).tolist())])


def jog_elsewhere(arm: Elsewhere, cycles: int, speed: float = 0.5) -> list[str]:
    """Jog the first joint with a command in each cycle; return why commands were refused."""
    refusals = []
    for _ in range(cycles):
        future = jog(arm.gateway, {'joint_1_s': speed}, arm.now)
        arm.run()
        if (error := future.exception(0.0)) is not None:
            refusals.append(str(error))
    return refusals


class InlineWorker(Executor):
    """Does what it is given at once."""

    def submit(self, job: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Do a job."""
        future: Future[Any] = Future()
        future.set_result(job(*args, **kwargs))
        return future


class SteppedWorker(Executor):
    """Does a job when the test says so."""

    def __init__(self) -> None:
        self._jobs: deque[Callable[[], object]] = deque()

    def submit(self, job: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Keep a job."""
        self._jobs.append(lambda: job(*args, **kwargs))
        return Future()

    @property
    def is_idle(self) -> bool:
        """Whether nothing is left to be done."""
        return not self._jobs

    def run(self) -> bool:
        """Do the next job; return whether there was one."""
        if not self._jobs:
            return False
        self._jobs.popleft()()
        return True


def jog(
    gateway: CommandGateway, velocities: Mapping[str, float], now: float, duration: float = 0.1
) -> Future[None]:
    """Jog joints."""
    command = arm_servo.JointCommand(*by_joint(gateway.model, velocities, 'velocities'))
    return gateway.command(arm_servo.JogRequest(command, now + duration))


def twist(
    gateway: CommandGateway, numbers: Sequence[float], now: float, duration: float = 0.1
) -> Future[None]:
    """Jog the tool."""
    command = arm_servo.TwistCommand(np.array(numbers))
    return gateway.command(arm_servo.JogRequest(command, now + duration))


def move_by(gateway: CommandGateway, displacements: Mapping[str, float]) -> MotionCommand:
    """Move joints on."""
    return gateway.request(arm_servo.DisplacementRequest(displacements))


def outcome(command: MotionCommand) -> arm_servo.Outcome:
    """Return how a trajectory has ended."""
    assert command.execution is not None, command.future.exception()
    return ending(command.execution)


def no_speed_jumps(path: Array, limits: Array) -> None:
    """Make sure that no speed jumps, in rows of a path that belong to successive cycles."""
    changes = np.abs(np.diff(path, 2, axis=0)) / PERIOD**2
    assert (changes.max(axis=0) <= 1.02 * limits + 1e-6).all()


@cache
def held_panda() -> tuple[str, str, dict[str, Any]]:
    """Return the texts of a Panda in a world, as the Setup Assistant writes a virtual joint."""
    urdf, srdf = texts('panda')
    world = '<virtual_joint name="v" type="fixed" parent_frame="world" child_link="panda_link0"/>'
    return urdf, srdf.replace('</robot>', f'{world}</robot>'), table('panda')

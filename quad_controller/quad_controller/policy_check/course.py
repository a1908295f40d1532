# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A test course of commanded velocities, and its results for a policy or the gait.

Both run in the same controller as on the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import functools
import math
import operator
from typing import TYPE_CHECKING

import numpy as np

from quad_description import Quadruped

from ..exceptions import CheckError, QuadControllerError
from ..gait.parameters import AS_TUNED, GaitParameters
from ..gait.velocity import REST, Velocity
from ..policy.contract.model import CommandRanges
from ..policy.network import Floats
from ..policy.runner import PolicyRunner
from ..states.controller import Controller
from ..states.modes import State, StateParameters

if TYPE_CHECKING:
    from quad_sim import CommandTiming, Watched

    from .arenas import PhysicsArena, SerialArena

STAND_TIME = 2.5  # [s] to stand up, and for the policy to take over
STAND_TIMEOUT = 8.0  # [s]
SETTLE_TIME = 1.0  # [s] to take up speed
FALLEN = math.radians(60.0)
REST_TIME = 1.0  # [s] at the end, to come to rest on all feet
PUSH_INTERVAL = 2.0  # [s]
MAX_INTERRUPTIONS = 8
MAX_FALLS = 4  # on the way of one command, without those of pushes; it is left after them
AXES = {'forward': 'x', 'lateral': 'y', 'turn': 'yaw'}
TOP = Velocity(0.3, 0.15, 1.5)
"""Fastest commands of the course: those of the gait."""
SPEEDS = 3


def axis_of(command: Velocity) -> str:
    """Return the main axis of a command, a key of :data:`AXES`."""
    shares = [abs(part) / top for part, top in zip(command, TOP, strict=True)]
    return list(AXES)[shares.index(max(shares))]


@dataclass(frozen=True, slots=True)
class Passage:
    """Results for one command."""

    commanded: Velocity
    went: Velocity  # mean velocity, in the robot's own frame
    time: float  # how long it walked in [s]
    falls: int  # how often it fell, or its watchdogs ended the walk
    tilt: float  # largest tilt in [rad]
    torque_saturation: float  # share of the time that a servo is at its largest torque
    speed_saturation: float  # share of the time that a joint is at its largest speed
    smoothness: float  # root mean square of the second difference of the targets in [rad]
    cost_of_transport: float  # work of the servos for weight and way; NaN on the spot
    # of the commands on the wire; None where there are no real clocks
    timing: CommandTiming | None = None

    @property
    def axis(self) -> str:
        """Main axis of the command, a key of :data:`AXES`."""
        return axis_of(self.commanded)

    @property
    def error(self) -> float:
        """Velocity error over the ground in [m/s]."""
        return math.hypot(self.went.x - self.commanded.x, self.went.y - self.commanded.y)

    @property
    def turning_error(self) -> float:
        """Turning rate error in [rad/s]."""
        return abs(self.went.yaw - self.commanded.yaw)


@dataclass(frozen=True, slots=True)
class CourseFigures:
    """Results for a course."""

    passages: tuple[Passage, ...]  # of each command

    @property
    def falls(self) -> int:
        """Number of falls."""
        return sum(each.falls for each in self.passages)

    @property
    def falls_per_minute(self) -> float:
        """Falls per minute of walking."""
        time = sum(each.time for each in self.passages)
        return 60.0 * self.falls / time if time > 0.0 else math.inf

    def mean(self, name: str, axis: str | None = None) -> float:
        """Return the mean of an attribute over the passages of an axis, or all; NaN if none."""
        values = [
            getattr(each, name) for each in self.passages if axis is None or each.axis == axis
        ]
        there = [value for value in values if not math.isnan(value)]
        return float(np.mean(there)) if there else math.nan

    @property
    def timing(self) -> CommandTiming | None:
        """Timing of the commands on the wire; None in virtual time."""
        there = [each.timing for each in self.passages if each.timing is not None]
        return functools.reduce(operator.add, there) if there else None


def course_for(ranges: CommandRanges | None) -> tuple[Velocity, ...]:
    """Return three speeds per axis within the policy's command ranges, and one backward."""
    commands = []
    limits = ranges or [(-math.inf, math.inf)] * len(AXES)
    for axis, (least, most) in zip(AXES.values(), limits, strict=True):
        for reach, sign, parts in ((most, 1.0, range(1, SPEEDS + 1)), (-least, -1.0, [2])):
            top = min(getattr(TOP, axis), reach)
            if top > 0.0:
                commands += [
                    Velocity(**{axis: sign * round(top * part / SPEEDS, 4)}) for part in parts
                ]
    return tuple(commands)


class CourseWalker:
    """Walks courses in an arena, and stands up again after each fall."""

    def __init__(
        self,
        arena: PhysicsArena | SerialArena,
        robot: Quadruped,
        policy: PolicyRunner | None,
        gait: GaitParameters = AS_TUNED,
    ) -> None:
        """Put the robot on its feet, driven by a policy or the gait."""
        self._arena, self._backend = arena, arena.backend
        self._robot, self._policy, self._gait = robot, policy, gait
        self._mode = State.WALK if policy is None else State.POLICY
        self.interruptions = 0  # walks that the machine cut off, and not the robot
        self.failure = ''  # why it fell last in a course; empty if it did not
        self.restart()

    def restart(self) -> None:
        """Put the robot on its feet, with a new controller."""
        self._state, self._dt = self._arena.stand(), self._backend.period
        states = StateParameters(period=self._backend.period)
        self.controller = Controller(self._robot, self._gait, states, policy=self._policy)
        self.forget()

    def forget(self) -> None:
        """Reset the statistics of targets and observations."""
        self.observed: list[Floats] = []  # what the policy saw so far
        self._targets: list[np.ndarray] = []
        self._bends, self._bend_count = 0.0, 0

    @property
    def smoothness(self) -> float:
        """Root mean square of the targets' second difference in [rad]."""
        return math.sqrt(self._bends / self._bend_count) if self._bend_count else 0.0

    @property
    def is_down(self) -> bool:
        """Whether the robot fell or stopped walking."""
        imu = self._state.imu
        fallen = imu is not None and imu.tilt > FALLEN
        return fallen or self.controller.status.state is not self._mode

    @property
    def trouble(self) -> str:
        """Why the robot does not walk; empty if it does."""
        status = self.controller.status
        if status.faults:
            return '; '.join(status.faults)
        if status.state is not self._mode:
            return f'{self._mode.value} was left for {status.title}'
        return ''

    def stand_up(self) -> None:
        """Stand up, ready to walk.

        Raises:
            QuadControllerError: The robot does not stand up; the message has the reason.
        """
        self.step(REST)  # modes are refused before the robot is known
        answer = self.controller.set_mode(self._mode.value)
        self.run(STAND_TIME, REST)
        for _ in range(round((STAND_TIMEOUT - STAND_TIME) / self._backend.period)):
            if not self.trouble:
                return
            self.step(REST)
        if self.trouble:
            raise QuadControllerError(self.trouble if answer.accepted else answer.message)

    def run(self, duration: float, velocity: Velocity) -> None:
        """Command a velocity for some time [s]."""
        for _ in range(round(duration / self._backend.period)):
            self.step(velocity)

    def step(self, velocity: Velocity) -> None:
        """Command a velocity for one period."""
        self.controller.set_velocity(velocity)
        output = self.controller.step(self._state, self._dt)
        before, self._state = self._state, self._backend.step(output.targets)
        passed = self._state.time - before.time  # a report may have been lost
        self._dt = passed if passed > 0.0 else self._backend.period
        if output.asked is not None and output.asked.answer.observation is not None:
            self.observed.append(output.asked.answer.observation[0])
        if output.targets is not None:
            self._add_targets(np.array(output.targets))

    def _add_targets(self, targets: np.ndarray) -> None:
        self._targets = [*self._targets[-2:], targets]
        if len(self._targets) == 3:
            first, second, third = self._targets
            self._bends += float(np.mean((third - 2.0 * second + first) ** 2))
            self._bend_count += 1

    def walk(
        self,
        commands: Sequence[Velocity],
        duration: float,
        *,
        push: float = 0.0,
        seed: int = 1,
        max_falls: int = MAX_FALLS,
    ) -> CourseFigures:
        """Walk as commanded; every two seconds, push in a random direction by [m/s]."""
        random = np.random.default_rng(seed)
        self.failure = ''
        passages = [
            self._passage(command, duration, push, random, max_falls) for command in commands
        ]
        self.seen = np.array(self.observed)  # what a policy saw last, a row for each step
        self.run(REST_TIME, REST)
        return CourseFigures(tuple(passages))

    def _passage(
        self,
        command: Velocity,
        duration: float,
        push: float,
        random: np.random.Generator,
        max_falls: int,
    ) -> Passage:
        period = self._backend.period
        total, between = round(duration / period), round(PUSH_INTERVAL / period)
        most = max_falls + (total // between if push else 0)
        falls, steps, bends = 0, 0, 0.0
        parts: list[Watched] = []
        while steps < total and falls < most:
            ready, began = not self.is_down or self._stand_again(), steps
            fell = not ready or not self._settle(command)
            self._arena.interruption = ''
            self._arena.robot.begin()
            self.forget()
            while not fell and steps < total:
                steps += 1
                self.step(command)
                fell = self.is_down
                if push and steps % between == 0:
                    angle = random.uniform(0.0, math.tau)
                    self._arena.robot.kick(push * math.cos(angle), push * math.sin(angle))
            if fell and self._excused():
                steps = began
                continue
            if fell and ready:
                self.failure = self.trouble or 'it fell'
            if steps > began:
                parts.append(self._arena.robot.read())
                bends = max(bends, self.smoothness)
            falls += fell
            if not ready:
                break
        return _passage_of(command, parts, falls, bends)

    def _settle(self, command: Velocity) -> bool:
        """Accelerate; return whether the robot did not fall."""
        for _ in range(round(SETTLE_TIME / self._backend.period)):
            self.step(command)
            if self.is_down:
                return False
        return True

    def _excused(self) -> bool:
        """Return whether the machine caused the fall by pausing controller or robot."""
        if not self._arena.interruption:
            return False
        self.interruptions += 1
        if self.interruptions > MAX_INTERRUPTIONS:
            raise CheckError(
                f'the machine is too busy for real time ({self.interruptions} walks were cut off, '
                f'the last one by: {self._arena.interruption}); try again when it has less to do'
            )
        return True

    def _stand_again(self) -> bool:
        """Stand up again; return whether the robot is ready to walk."""
        self.restart()
        try:
            self.stand_up()
        except QuadControllerError as error:  # it falls at once, or is not allowed to walk
            self.failure = str(error)
            return False
        return True


def _passage_of(
    command: Velocity, parts: Sequence[Watched], falls: int, smoothness: float
) -> Passage:
    """Combine the parts between falls into the results of one command."""
    nothing = math.nan
    if not parts:
        lost = Velocity(nothing, nothing, nothing)
        return Passage(command, lost, 0.0, falls, nothing, nothing, nothing, nothing, nothing)
    whole = functools.reduce(operator.add, parts)
    way = whole.metered
    over_ground = bool(command.x or command.y) and way.path > 0.0
    return Passage(
        commanded=command,
        went=Velocity(way.x, way.y, way.yaw).scaled(1.0 / way.time),
        time=way.time,
        falls=falls,
        tilt=way.tilt,
        torque_saturation=way.torque_saturation,
        speed_saturation=way.speed_saturation,
        smoothness=smoothness,
        cost_of_transport=way.energy / way.weight / way.path if over_ground else nothing,
        timing=whole.timing if whole.timing.latencies else None,
    )

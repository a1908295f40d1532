# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A walk on any back end, through the same controller that runs on the robot."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from quad_description import Backend, Quadruped, RobotState

from ..exceptions import QuadControllerError
from ..gait.parameters import AS_TUNED, GaitParameters
from ..gait.velocity import REST, Velocity
from ..policy.interface import Policy
from ..policy.network import Floats
from ..states.controller import Controller
from ..states.modes import State
from ..states.parameters import StateParameters

STAND_TIME = 2.5  # [s] to stand up, and for the policy to take over
STAND_TIMEOUT = 8.0  # [s]
SETTLE_TIME = 1.5  # [s] to take up speed
FALLEN = math.radians(60.0)


@dataclass(frozen=True, slots=True)
class Walked:
    """How a walk went."""

    velocity: Velocity  # mean velocity in the robot's own frame
    tilt: float  # largest angle between the body's z axis and up in [rad]
    trouble: str  # why it ended early; empty when it did not
    observed: Floats  # what the policy saw, an observation in each row


class WalkingRobot:
    """A back end and the controller that walks it.

    Attributes:
        controller: The controller.
        tilt: Largest tilt so far in [rad].
        travelled: Way and turning so far, in the robot's own frame, in [m] and [rad].
        observed: What the policy saw so far.
    """

    def __init__(
        self,
        backend: Backend,
        robot: Quadruped,
        policy: Policy | None,
        state: RobotState,
        gait: GaitParameters = AS_TUNED,
    ) -> None:
        """Begin with a robot on the ground.

        Args:
            backend: Where the robot is; for the way, it has to know its position.
            policy: What walks; None for the gait.
        """
        self._backend, self._robot, self._policy, self._gait = backend, robot, policy, gait
        self.restart(state)

    def restart(self, state: RobotState) -> None:
        """Begin anew, with a new controller."""
        self._state, self._dt = state, self._backend.period
        states = StateParameters(period=self._backend.period)
        self.controller = Controller(self._robot, self._gait, states, policy=self._policy)
        self.forget()

    def forget(self) -> None:
        """Count way, tilt and targets from now on."""
        self.tilt = 0.0
        self.travelled = REST
        self.observed: list[Floats] = []
        self._targets: list[np.ndarray] = []
        self._bends, self._bend_count = 0.0, 0

    @property
    def smoothness(self) -> float:
        """How much targets bend: root mean square of their second difference in [rad]."""
        return math.sqrt(self._bends / self._bend_count) if self._bend_count else 0.0

    @property
    def mode(self) -> State:
        """The state in which it walks."""
        return State.WALK if self._policy is None else State.POLICY

    @property
    def is_down(self) -> bool:
        """Whether it fell, or does not walk any more."""
        imu = self._state.imu
        fallen = imu is not None and imu.tilt > FALLEN
        return fallen or self.controller.status.state is not self.mode

    @property
    def trouble(self) -> str:
        """Why it does not walk; empty when it does."""
        status = self.controller.status
        if status.faults:
            return '; '.join(status.faults)
        if status.state is not self.mode:
            return f'{self.mode.value} was left for {status.title}'
        return ''

    def stand_up(self) -> None:
        """Stand, ready to walk.

        Raises:
            QuadControllerError: It does not come to that; the message has the reason.
        """
        self.step(REST)  # modes are refused before the robot is known
        answer = self.controller.set_mode(self.mode.value)
        self.run(STAND_TIME, REST)
        for _ in range(round((STAND_TIMEOUT - STAND_TIME) / self._backend.period)):
            if not self.trouble:
                return
            self.step(REST)
        if self.trouble:
            raise QuadControllerError(self.trouble if answer.accepted else answer.message)

    def run(self, duration: float, velocity: Velocity) -> None:
        """Pass some time [s] with a velocity that is commanded."""
        for _ in range(round(duration / self._backend.period)):
            self.step(velocity)

    def step(self, velocity: Velocity) -> None:
        """Pass one period with a velocity that is commanded."""
        self.controller.set_velocity(velocity)
        output = self.controller.step(self._state, self._dt)
        before, self._state = self._state, self._backend.step(output.targets)
        passed = self._state.time - before.time  # a report may have been lost
        self._dt = passed if passed > 0.0 else self._backend.period
        self._add_way(before, self._state)
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

    def _add_way(self, before: RobotState, after: RobotState) -> None:
        if before.imu is None or after.imu is None or not before.position or not after.position:
            return
        way, heading = self.travelled, before.imu.roll_pitch_yaw[2]
        dx, dy = (b - a for a, b in zip(before.position[:2], after.position[:2], strict=True))
        self.tilt = max(self.tilt, after.imu.tilt)
        self.travelled = Velocity(
            way.x + dx * math.cos(heading) + dy * math.sin(heading),
            way.y + dy * math.cos(heading) - dx * math.sin(heading),
            way.yaw + math.remainder(after.imu.roll_pitch_yaw[2] - heading, math.tau),
        )


def walk(
    backend: Backend, robot: Quadruped, policy: Policy, velocity: Velocity, duration: float
) -> Walked:
    """Let a policy walk.

    Args:
        backend: Where the robot is; it has to know its position.
        policy: What walks; it has been checked.
    """
    walker = WalkingRobot(backend, robot, policy, backend.reset())
    try:
        walker.stand_up()
    except QuadControllerError as error:
        return Walked(REST, walker.tilt, str(error), np.array(walker.observed))
    walker.run(SETTLE_TIME, velocity)
    walker.travelled = REST
    walker.observed.clear()
    walker.run(duration, velocity)
    went, observed = walker.travelled.scaled(1.0 / duration), np.array(walker.observed)
    return Walked(went, walker.tilt, walker.trouble, observed)

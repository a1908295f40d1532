# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Getting up from wherever a fall has left the robot: the environment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any

import gymnasium
from gymnasium import spaces
import numpy as np

from quad_description import RobotState
from quad_description.rotations import about, about_z, multiply, Quaternion

from ..exceptions import SetupError
from ..plant.servo import ServoModel, ServoParameters
from .episode import Episode
from .observation import Floats, GETTING_UP, row_of
from .randomization import check_range, NO_RANDOMIZATION, Randomization, Range
from .randomized_robot import PERIOD, RandomizedRobot
from .rewards import GetUpWeights


@dataclass(frozen=True, slots=True)
class Drop:
    """How the robot comes to lie where it lies: ranges from which each episode draws.

    Attributes:
        tilt: Of the robot's z axis from up in [rad], to any side; all directions of the range are
            alike likely, as points on a sphere are.
        joints: How far each joint may be from where it is when the robot stands: 0 for there, 1
            for anywhere in its range.
        height: Of the robot's lowest point above the ground in [m].
        limp: Share of the drops in which the servos have no torque until the robot lies.
        time: From the drop to the first step in [s].
    """

    tilt: Range = (0.0, math.pi)
    joints: float = 1.0
    height: Range = (0.0, 0.1)
    limp: float = 0.5
    time: float = 1.5

    def __post_init__(self) -> None:
        """Refuse what nothing can be drawn from."""
        for name, most in (('tilt', math.pi), ('height', 1.0)):
            span = getattr(self, name)
            check_range(name, span)
            if not 0.0 <= span[0] <= span[1] <= most:
                raise SetupError(f'{name} {span}: give two of 0 to {most:.3g}')
        for name in ('joints', 'limp'):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise SetupError(f'{name} {getattr(self, name)}: give a part of 0 to 1')
        if not 0.0 <= self.time < math.inf:
            raise SetupError(f'time {self.time} s: give 0 or a finite time')

    def orientation(self, random: np.random.Generator) -> Quaternion:
        """Draw an orientation of the robot (x, y, z, w)."""
        least, most = (math.cos(angle) for angle in self.tilt)
        tilt = math.acos(min(max(random.uniform(most, least), -1.0), 1.0))
        side, heading = random.uniform(-math.pi, math.pi, 2).tolist()
        leant = about((math.cos(side), math.sin(side), 0.0), tilt)
        return multiply(about_z(heading), leant)


class GetUpEnv(gymnasium.Env[Floats, Floats]):
    """A quadruped that was dropped, and is to come to its feet and stand still.

    An action is how far the targets of the joints are from a robot that stands in [rad]. Robot,
    servos and sensors are those of :class:`.WalkingEnv`. An episode is truncated after its time,
    and never terminated.

    Attributes:
        robot: The robot in physics.
        period: Time of a step in [s].
        stand: Joint positions of a robot that stands in [rad].
        nominal_height: Of base_link of a robot that stands in [m].
    """

    def __init__(
        self,
        *,
        preset: str = 'lite',
        servo: ServoModel | ServoParameters = ServoModel.FIRM,
        randomization: Randomization = NO_RANDOMIZATION,
        drop: Drop | None = None,
        weights: GetUpWeights | None = None,
        period: float = PERIOD,
        duration: float = 8.0,
        shortest: float | None = None,
    ) -> None:
        """Drop the robot.

        Args:
            preset: The robot.
            servo: How its servos follow.
            randomization: What differs in each episode.
            drop: How it comes to lie where it lies.
            weights: What standing is worth.
            period: Time of a step in [s].
            duration: Longest time of an episode in [s], from when it lies.
            shortest: Shortest time of one in [s], each draws its own; None for equal ones. Many
                environments whose episodes all end at once would show a trainer now only robots
                that lie, now only such that stand.

        Raises:
            SetupError: A time is not above 0, the shortest is not between a period and the
                longest, or a target may come later than its step ends.
            DescriptionError: There is no such preset.
        """
        self._weights = weights or GetUpWeights()
        self._episode = Episode(period, duration, self._weights.names)
        self._durations = (duration if shortest is None else shortest, duration)
        if not period <= self._durations[0] <= duration:
            raise SetupError(f'shortest {shortest} s: give {period:g} to {duration:g}')
        self._body = RandomizedRobot(preset, servo, randomization, period)
        self.robot, self.period, self.stand = self._body.robot, period, self._body.stand
        self.nominal_height = self.robot.base_pose.position[2]
        self._drop = drop or Drop()
        self.action_space = self._body.action_space
        width = sum(part.width(len(self.stand)) for part in GETTING_UP)
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)
        self._begin()

    @property
    def state(self) -> RobotState:
        """What its sensors measured last."""
        return self._body.state

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Lie somewhere else, as another robot of the ranges.

        Args:
            seed: Of all that is drawn from now on.
            options: There is none.

        Raises:
            SetupError: There is an option.
            SimulationError: The physics blew up.
        """
        if options:
            raise SetupError(f'option {", ".join(sorted(options))}: there is none')
        super().reset(seed=seed)
        self._begin()
        return self._observation(), {}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Send joint targets, and let a period pass.

        Args:
            action: From the joints of a robot that stands in [rad]; what leads beyond a limit is
                taken to the limit.

        Raises:
            TargetError: A number is not finite, or there are too many or few.
            SimulationError: The physics blew up.
        """
        motion = self._body.step(action, self.np_random)
        terms = self._weights.terms(motion, self.nominal_height, self.period)
        reward = self._episode.add(terms)
        is_over = self._episode.is_over
        info = self._episode.info if is_over else {}
        return self._observation(), reward, False, is_over, info

    def vary(self, randomization: Randomization) -> None:
        """Let other things differ from the next episode on; noise stays as it was made.

        Raises:
            SetupError: A target may come later than its step ends.
        """
        self._body.vary(randomization)

    def _begin(self) -> None:
        random, drop, robot = self.np_random, self._drop, self.robot
        parts = random.uniform(0.0, 1.0, len(self.stand))
        positions = self.stand + drop.joints * (
            self._body.lowest + parts * (self._body.highest - self._body.lowest)
        )
        self._body.begin(
            random,
            pose=dict(zip(robot.joint_names, positions.tolist(), strict=True)),
            orientation=drop.orientation(random),
            drop=float(random.uniform(*drop.height)),
        )
        self._body.settle(drop.time, limp=bool(random.random() < drop.limp))
        self._episode.begin(float(random.uniform(*self._durations)))

    def _observation(self) -> Floats:
        return row_of(self._body.seen, GETTING_UP)

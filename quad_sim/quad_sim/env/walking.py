# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Walking as commanded: the environment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any

import gymnasium
from gymnasium import spaces
import numpy as np

from quad_description import RobotState
from quad_description.rotations import Vector

from ..exceptions import SetupError
from ..plant.servo import ServoModel, ServoParameters
from .randomization import check_range, NO_RANDOMIZATION, Randomization, Range
from .randomized_robot import Floats, Observation, PERIOD, RandomizedRobot, row_of
from .rewards import RewardWeights

MAX_TILT = math.radians(70.0)  # as in the vendor's training (luwu_mjlab)


@dataclass(frozen=True, slots=True)
class CommandRanges:
    """Velocities that are commanded."""

    x: Range = (-0.35, 0.35)  # ahead in [m/s]
    y: Range = (-0.15, 0.15)  # to the left in [m/s]
    yaw: Range = (-1.5, 1.5)  # turning to the left in [rad/s]
    time: float = 2.0  # between two commands in [s]
    rest: float = 0.15  # share of the commands that are zero
    straight: float = 0.4  # share of the others along one axis only

    def __post_init__(self) -> None:
        """Refuse what nothing can be drawn from."""
        for name in ('x', 'y', 'yaw'):
            check_range(name, getattr(self, name))
        if not 0.0 < self.time < math.inf:
            raise SetupError(f'time {self.time} s: give a finite time above 0')
        if not (0.0 <= self.rest <= 1.0 and 0.0 <= self.straight <= 1.0):
            raise SetupError(f'rest {self.rest}, straight {self.straight}: give parts of 0 to 1')

    def draw(self, random: np.random.Generator) -> Vector:
        """Draw a command."""
        if random.random() < self.rest:
            return 0.0, 0.0, 0.0
        parts = np.array([random.uniform(*span) for span in (self.x, self.y, self.yaw)])
        if random.random() < self.straight:
            parts *= np.eye(3)[random.integers(3)]
        x, y, yaw = parts.tolist()
        return x, y, yaw


class WalkingEnv(gymnasium.Env[Floats, Floats]):
    """A quadruped that is to walk as commanded.

    An action is how far the targets of the joints are from a robot that stands in [rad]. Robot,
    servos and sensors are those of the simulation. An episode is terminated by a fall, and
    truncated after its time.

    Attributes:
        robot: The robot in physics.
        period: Time of a step in [s].
        command: Velocity that is commanded: ahead and to the left in [m/s], turning in [rad/s].
        stand: Joint positions of a robot that stands in [rad].
    """

    def __init__(
        self,
        *,
        preset: str = 'lite',
        servo: ServoModel | ServoParameters = ServoModel.FIRM,
        randomization: Randomization = NO_RANDOMIZATION,
        commands: CommandRanges | None = None,
        weights: RewardWeights | None = None,
        period: float = PERIOD,
        duration: float = 20.0,
    ) -> None:
        """Put the robot on the ground.

        Args:
            duration: Longest time of an episode in [s].

        Raises:
            SetupError: A time is not above 0, or a target may come later than its step ends.
            DescriptionError: There is no such preset.
        """
        if not (0.0 < period < math.inf and period <= duration < math.inf):
            raise SetupError(
                f'period {period} s, duration {duration} s: give 0 < period < duration'
            )
        self._weights, self._most = weights or RewardWeights(), round(duration / period)
        self._body = RandomizedRobot(preset, servo, randomization, period)
        self.robot, self.period, self.stand = self._body.robot, period, self._body.stand
        self._commands = commands or CommandRanges()
        self.action_space = self._body.action_space
        width = sum(part.width(len(self.stand)) for part in Observation)
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)
        self.command: Vector = (0.0, 0.0, 0.0)
        self._begin()

    @property
    def state(self) -> RobotState:
        """What its sensors measured last."""
        return self._body.state

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Stand on the ground again, as another robot of the ranges.

        Args:
            seed: Of all that is drawn from now on.
            options: ``command``: three numbers that are commanded in all of this episode.

        Raises:
            SetupError: The command is not three finite numbers, or there is another option.
        """
        super().reset(seed=seed)
        self._begin(_lasting_command(options or {}))
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
        fallen = motion.tilt > MAX_TILT
        terms = self._weights.terms(motion, self.command, self.period, fallen=fallen)
        self._steps += 1
        for name, value in terms.items():
            self._sums[name] += value
        is_over = self._steps >= self._most
        info = {'reward_terms': dict(self._sums)} if fallen or is_over else {}
        if not self._is_command_lasting and self._steps % self._command_steps == 0:
            # what is seen now is judged next
            self.command = self._commands.draw(self.np_random)
        return self._observation(), sum(terms.values()), fallen, is_over and not fallen, info

    def vary(self, randomization: Randomization) -> None:
        """Let other things differ from the next episode on; noise stays as it was made.

        Raises:
            SetupError: A target may come later than its step ends.
        """
        self._body.vary(randomization)

    def _begin(self, command: Vector | None = None) -> None:
        self._body.begin(self.np_random)
        self._is_command_lasting = command is not None
        self.command = command or self._commands.draw(self.np_random)
        self._command_steps = max(round(self._commands.time / self.period), 1)
        self._steps, self._sums = 0, dict.fromkeys(self._weights.names, 0.0)

    def _observation(self) -> Floats:
        return row_of({**self._body.seen, Observation.COMMAND: self.command})


def _lasting_command(options: Mapping[str, Any]) -> Vector | None:
    if others := options.keys() - {'command'}:
        raise SetupError(f'option {", ".join(sorted(others))}: there is only command')
    if 'command' not in options:
        return None
    numbers = [float(number) for number in options['command']]
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise SetupError(f'command {numbers}: give x and y in [m/s] and yaw in [rad/s]')
    return numbers[0], numbers[1], numbers[2]

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The walking environment: commanded velocities, randomized robots, reward.

The terms of the reward are as in legged_gym (Rudin et al., 2022).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from enum import Enum
import math
from typing import Any

import gymnasium
from gymnasium import spaces
import numpy as np
from numpy.typing import ArrayLike, NDArray

from quad_description import (
    ImuSample,
    JointSample,
    movable_joints,
    Pose,
    pose_positions,
    robot_urdf,
    RobotState,
)
from quad_description.rotations import down_in_body, Vector

from ..exceptions import SetupError, TargetError
from ..physics import ImuBias, Robot
from ..physics.model import Variation
from ..physics.robot import TIMESTEP
from ..plant import ServoModel, ServoParameters
from ..state import Array, BOARD, FLAT, Noise, NONE, Terrain


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the reward terms per second, scaled by the step duration; a fall counts once."""

    tracking: float = 2.0  # exp(-(error / tracking_width)^2) of the linear velocity
    turning: float = 1.0  # exp(-(error / turning_width)^2) of the turning
    astray: float = -6.0  # error of the linear velocity in [m/s]: a slope where tracking has none
    heading: float = -0.5  # error of the turning in [rad/s]
    vertical: float = -2.0  # square of the velocity up and down in [m2/s2]
    rolling: float = -0.05  # square of the turning about x and y in [rad2/s2]
    level: float = -2.0  # square of the sine of the tilt
    power: float = -0.02  # of the servos' torques, before the damping of their motors, in [W]
    action_rate: float = -0.002  # square of the speed of the targets in [rad2/s2]
    fall: float = -15.0  # of a fall
    tracking_width: float = 0.1  # [m/s]
    turning_width: float = 0.4  # [rad/s]

    def __post_init__(self) -> None:
        """Reject invalid numbers."""
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or (field.name.endswith('_width') and value <= 0.0):
                raise SetupError(f'{field.name} {value}: give a finite number, a width above 0')

    def terms(
        self, robot: Robot, target_speed: Array, error: Vector, period: float, *, fallen: bool
    ) -> dict[str, float]:
        """Return the value of each term for one step.

        Args:
            target_speed: Speed of the targets since the previous step in [rad/s].
            error: See :class:`WalkingEnv`.
        """
        velocity, down = robot.base_velocity, down_in_body(robot.base_pose.orientation)
        (_, _, up), (roll, pitch, _) = velocity.linear, velocity.angular
        off, turning = math.hypot(error[0], error[1]), abs(error[2])
        power = float(abs(robot.joint_torques * robot.joint_velocities).sum())
        rates = {
            'tracking': self.tracking * _nearness(off, self.tracking_width),
            'turning': self.turning * _nearness(turning, self.turning_width),
            'astray': self.astray * off,
            'heading': self.heading * turning,
            'vertical': self.vertical * up * up,
            'rolling': self.rolling * (roll * roll + pitch * pitch),
            'level': self.level * (down[0] ** 2 + down[1] ** 2),
            'power': self.power * power,
            'action_rate': self.action_rate * float((target_speed * target_speed).sum()),
        }
        worth = {name: period * rate for name, rate in rates.items()}
        return worth | {'fall': self.fall if fallen else 0.0}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the terms."""
        return tuple(field.name for field in fields(self) if not field.name.endswith('_width'))


def _nearness(error: float, width: float) -> float:
    return math.exp(-((error / width) ** 2))


Range = tuple[float, float]
# as in Variation
_VARIED = (
    *('friction', 'trunk_mass', 'stiffness', 'damping'),
    *('delay', 'backlash', 'refresh', 'bumps'),
)
_FIXED = {'kick_interval', 'noise'}  # no ranges


def check_range(name: str, span: Range) -> None:
    """Reject anything but two finite numbers, the lower one first.

    Raises:
        SetupError: The range is invalid; the message gives its name.
    """
    if len(span) != 2 or not -math.inf < span[0] <= span[1] < math.inf:
        raise SetupError(f'{name} {span}: give two finite numbers, the lower one first')


@dataclass(frozen=True, slots=True)
class Randomization:
    """Ranges from which each episode samples uniformly."""

    friction: Range = (0.4, 1.3)  # under the feet
    trunk_mass: Range = (0.9, 1.25)  # factor of the mass of the trunk
    stiffness: Range = (0.8, 1.2)  # factor of the servos' stiffness; alike likely in ratio
    damping: Range = (0.8, 1.2)  # factor of their damping
    delay: Range = (0.0, 0.04)  # of targets, beside that of the servos, in [s]
    backlash: Range = (0.0, 0.01)  # free play, beside that of the servos, in [rad]
    refresh: Range = (0.0, 0.04)  # time between two targets, beside that of the servos, in [s]
    bumps: Range = (0.0, 1.0)  # factor of the height of the terrain's
    gyro_bias: Range = (-0.05, 0.05)  # of each axis of the gyro in [rad/s]
    level_bias: Range = (-0.02, 0.02)  # of measured roll and pitch in [rad]
    kick: Range = (-0.4, 0.4)  # change of the velocity at once, ahead and to the side, in [m/s]
    kick_interval: float = 4.0  # mean time between two kicks in [s]; 0 for none
    noise: Noise = BOARD  # of the sensors

    def __post_init__(self) -> None:
        """Reject invalid ranges."""
        for field in fields(self):
            if field.name not in _FIXED:
                check_range(field.name, getattr(self, field.name))
        for end in (0, 1):  # refuses what no robot has
            Variation(*(getattr(self, name)[end] for name in _VARIED))
        if not 0.0 <= self.kick_interval < math.inf:
            raise SetupError(f'kick_interval {self.kick_interval} s: give 0 or a finite time')

    def variation(self, random: np.random.Generator) -> Variation:
        """Sample a variation of robot and ground."""
        drawn = {name: float(random.uniform(*getattr(self, name))) for name in _VARIED}
        softest, stiffest = map(math.log, self.stiffness)
        return Variation(**drawn | {'stiffness': math.exp(random.uniform(softest, stiffest))})

    def scaled(self, share: float) -> Randomization:
        """Shrink the ranges towards the nominal robot, and weaken kicks; noise is unchanged.

        Args:
            share: 0 for the nominal robot, 1 for these ranges.

        Raises:
            SetupError: The share is not from 0 to 1.
        """
        if not 0.0 <= share <= 1.0:
            raise SetupError(f'share {share}: give 0 to 1')
        spans: dict[str, Any] = {
            field.name: tuple(
                (1.0 - share) * none + share * end
                for none, end in zip(
                    getattr(NO_RANDOMIZATION, field.name), getattr(self, field.name), strict=True
                )
            )
            for field in fields(self)
            if field.name not in _FIXED
        }
        return replace(self, **spans)


NO_RANDOMIZATION = Randomization(
    friction=(0.8, 0.8),
    trunk_mass=(1.0, 1.0),
    stiffness=(1.0, 1.0),
    damping=(1.0, 1.0),
    delay=(0.0, 0.0),
    backlash=(0.0, 0.0),
    refresh=(0.0, 0.0),
    bumps=(1.0, 1.0),
    gyro_bias=(0.0, 0.0),
    level_bias=(0.0, 0.0),
    kick=(0.0, 0.0),
    kick_interval=0.0,
    noise=NONE,
)
"""The robot as it is, on level ground, with ideal sensors."""


PERIOD = 0.02  # [s]
ERROR_TIME = 0.4  # [s] over which the error of the velocity is smoothed: a step is 0.28 s
MAX_TILT = math.radians(70.0)  # as in the vendor's training (luwu_mjlab)
Floats = NDArray[np.float32]


class Observation(Enum):
    """Parts of an observation in order: content and number of values (0: one per joint)."""

    ANGULAR_VELOCITY = ('of base_link in its own frame in [rad/s]', 3)
    DOWN = ('direction of gravity in base_link', 3)
    COMMAND = ('velocity ahead and to the left in [m/s], turning in [rad/s]', 3)
    POSITIONS = ('of the joints, from those of a robot that stands, in [rad]', 0)
    VELOCITIES = ('of the joints in [rad/s]', 0)
    ACTION = ('of the step before in [rad]', 0)

    def width(self, joints: int) -> int:
        """Return the number of values."""
        return self.value[1] or joints


@dataclass(frozen=True, slots=True)
class CommandRanges:
    """Ranges of commanded velocities."""

    x: Range = (-0.35, 0.35)  # ahead in [m/s]
    y: Range = (-0.15, 0.15)  # to the left in [m/s]
    yaw: Range = (-1.5, 1.5)  # turning to the left in [rad/s]
    time: float = 2.0  # between two commands in [s]
    rest: float = 0.15  # share of the commands that are zero
    straight: float = 0.4  # share of the others along one axis only

    def __post_init__(self) -> None:
        """Reject invalid ranges."""
        for name in ('x', 'y', 'yaw'):
            check_range(name, getattr(self, name))
        if not 0.0 < self.time < math.inf:
            raise SetupError(f'time {self.time} s: give a finite time above 0')
        if not (0.0 <= self.rest <= 1.0 and 0.0 <= self.straight <= 1.0):
            raise SetupError(f'rest {self.rest}, straight {self.straight}: give parts of 0 to 1')

    def draw(self, random: np.random.Generator) -> Vector:
        """Sample a command."""
        if random.random() < self.rest:
            return 0.0, 0.0, 0.0
        parts = np.array([random.uniform(*span) for span in (self.x, self.y, self.yaw)])
        if random.random() < self.straight:
            parts *= np.eye(3)[random.integers(3)]
        x, y, yaw = parts.tolist()
        return x, y, yaw


class WalkingEnv(gymnasium.Env[Floats, Floats]):
    """A quadruped whose task is to walk as commanded.

    An action is the offset of the joint targets from the standing pose in [rad]. Robot, servos and
    sensors are randomized in each episode, within configurable ranges. A fall terminates an
    episode; its time limit truncates it.

    Attributes:
        robot: The robot in physics.
        period: Duration of a step in [s].
        command: Commanded velocity: forward and left in [m/s], turning in [rad/s].
        stand: Joint positions of the standing robot in [rad].
        state: Last sensor values.
        error: Velocity error, exponentially averaged over about 0.4 s: forward and left in [m/s],
            turning in [rad/s].
        variation: Variation of robot and ground in this episode.
    """

    def __init__(
        self,
        *,
        preset: str = 'lite',
        servo: ServoModel | ServoParameters = ServoModel.NOMINAL,
        randomization: Randomization = NO_RANDOMIZATION,
        commands: CommandRanges | None = None,
        weights: RewardWeights | None = None,
        period: float = PERIOD,
        duration: float = 20.0,
        terrain: Terrain = FLAT,
        timestep: float = TIMESTEP,
    ) -> None:
        """Put the robot on the ground.

        Args:
            terrain: The ground; the robot starts on a level part of it.
            duration: Time limit of an episode in [s].
            timestep: Integration time step in [s].

        Raises:
            SetupError: A time is not positive.
            DescriptionError: The preset is unknown.
        """
        if not (0.0 < period < math.inf and period <= duration < math.inf):
            raise SetupError(
                f'period {period} s, duration {duration} s: give 0 < period < duration'
            )
        urdf = robot_urdf(preset)
        self.robot = Robot(urdf, servo, terrain, timestep=timestep, noise=randomization.noise)
        self.period = period
        self.vary(randomization)
        limits = [joint.limits for joint in movable_joints(urdf)]
        stand = pose_positions(Pose.STAND)
        self.stand: Floats = np.array([stand[name] for name in self.robot.joint_names], np.float32)
        # actions that lead to the limits of the joints in [rad]
        self._lowest: Floats = np.array([each.lower for each in limits], np.float32) - self.stand
        self._highest: Floats = np.array([each.upper for each in limits], np.float32) - self.stand
        self.action_space = spaces.Box(self._lowest, self._highest)
        width = sum(part.width(len(self.stand)) for part in Observation)
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)
        self._weights, self._most = weights or RewardWeights(), round(duration / period)
        self._commands = commands or CommandRanges()
        self.command: Vector = (0.0, 0.0, 0.0)
        self.error: Vector = (0.0, 0.0, 0.0)
        self._steps = self._command_steps = 0
        self._sums: dict[str, float] = {}
        self._begin(None)

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Reset to standing, with a newly sampled robot.

        Args:
            seed: Seed of all following samples.
            options: ``command``: a constant command of three numbers for this episode.

        Raises:
            SetupError: The command is not three finite numbers, or an option is unknown.
        """
        super().reset(seed=seed)
        self._begin(_lasting_command(options or {}))
        return self._observation(), {}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Send joint targets and advance by one period.

        Args:
            action: Offsets from the standing pose in [rad]; targets are clamped to the limits.

        Raises:
            TargetError: A value is not finite, or the count is wrong.
            SimulationError: The simulation became unstable.
        """
        outcome = self.advance(action)
        return self._observation(), *outcome

    def advance(
        self, action: Floats, wanted: Vector | None = None
    ) -> tuple[float, bool, bool, dict[str, Any]]:
        """Do the work of :meth:`step` without an observation; callers read :attr:`state`.

        Args:
            wanted: Reference velocity of the reward, if it is not the command.
        """
        speed = self._move(np.asarray(action, np.float32))
        self._judge(wanted or self.command)
        fallen = self.robot.base_pose.tilt > MAX_TILT
        terms = self._weights.terms(self.robot, speed, self.error, self.period, fallen=fallen)
        self._steps += 1
        for name, value in terms.items():
            self._sums[name] += value
        is_over = self._steps >= self._most
        info = {'reward_terms': dict(self._sums)} if fallen or is_over else {}
        if not self._is_command_lasting and self._steps % self._command_steps == 0:
            # what is seen now is judged next
            self.command = self._commands.draw(self.np_random)
        return sum(terms.values()), fallen, is_over and not fallen, info

    def _judge(self, wanted: Vector) -> None:
        velocity, share = self.robot.base_velocity, min(self.period / ERROR_TIME, 1.0)
        went = *velocity.linear[:2], velocity.angular[2]
        x, y, yaw = (
            old + share * (now - asked - old)
            for old, now, asked in zip(self.error, went, wanted, strict=True)
        )
        self.error = x, y, yaw

    def vary(self, randomization: Randomization) -> None:
        """Use other ranges from the next episode on; noise stays as created."""
        self._randomization = randomization

    def _begin(self, command: Vector | None) -> None:
        ranges, random = self._randomization, self.np_random
        seed = int(random.integers(2**31))
        self.variation = ranges.variation(random)
        self.robot.reset(seed=seed, variation=self.variation)
        x, y, z = random.uniform(*ranges.gyro_bias, 3).tolist()
        self._bias = ImuBias((x, y, z), *random.uniform(*ranges.level_bias, 2).tolist())
        # of the step before; what the set-points are at the start of an episode
        self._action: Floats = self.robot.joint_targets.astype(np.float32) - self.stand
        self.state = self._sense()
        self.error = (0.0, 0.0, 0.0)
        self._is_command_lasting = command is not None
        self.command = command or self._commands.draw(random)
        self._command_steps = max(round(self._commands.time / self.period), 1)
        self._steps, self._sums = 0, dict.fromkeys(self._weights.names, 0.0)

    def _move(self, wanted: Floats) -> Array:
        """Send targets, advance by one period, and measure; return the targets' speed [rad/s]."""
        if wanted.shape != self.stand.shape or not np.isfinite(wanted).all():
            raise TargetError(
                f'action {wanted}: give a finite number for each of {len(self.stand)} joints'
            )
        wanted = np.minimum(np.maximum(wanted, self._lowest), self._highest)
        robot, ranges, random = self.robot, self._randomization, self.np_random
        if ranges.kick_interval and random.random() < self.period / ranges.kick_interval:
            robot.kick((*random.uniform(*ranges.kick, 2).tolist(), 0.0))
        robot.set_targets((self.stand + wanted).astype(np.float64))
        robot.step(self.period)
        speed: Array = (wanted.astype(np.float64) - self._action) / self.period
        self._action, self.state = wanted, self._sense()
        return speed

    def _sense(self) -> RobotState:
        measured, time = self.robot.measure(), self.robot.time
        positions, velocities = measured.positions.tolist(), measured.velocities.tolist()
        self._joints = JointSample(tuple(positions), tuple(velocities), time)
        self._imu = ImuSample(
            self._bias.orientation(*measured.imu.roll_pitch_yaw),
            self._bias.rates(measured.imu.angular_velocity),
            measured.imu.specific_force,
        )
        return RobotState(self._joints, self._imu, time=time)

    def _observation(self) -> Floats:
        seen: dict[Observation, ArrayLike] = {
            Observation.ANGULAR_VELOCITY: self._imu.angular_velocity or (),
            Observation.DOWN: self._imu.down,
            Observation.COMMAND: self.command,
            Observation.POSITIONS: np.asarray(self._joints.positions) - self.stand,
            Observation.VELOCITIES: self._joints.velocities or (),
            Observation.ACTION: self._action,
        }
        return np.concatenate([np.asarray(seen[part], np.float32) for part in Observation])


def _lasting_command(options: Mapping[str, Any]) -> Vector | None:
    if others := options.keys() - {'command'}:
        raise SetupError(f'option {", ".join(sorted(others))}: there is only command')
    if 'command' not in options:
        return None
    numbers = [float(number) for number in options['command']]
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise SetupError(f'command {numbers}: give x and y in [m/s] and yaw in [rad/s]')
    return numbers[0], numbers[1], numbers[2]

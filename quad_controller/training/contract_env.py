# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment as a policy with a contract sees it: what is trained is what runs later.

Observations and targets are made by the runner that the controller has, and the targets pass its
limiter of speeds.
"""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any

from gait_teacher import GaitTeacher
import gymnasium
from gymnasium import spaces
import numpy as np
from trained_contract import contract_of, contract_values, PERIOD, SCALE, Values

from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.gait.velocity import Velocity
from quad_controller.policy.contract.model import RecurrentState, Source
from quad_controller.policy.interface import PolicyInputs
from quad_controller.policy.network import Floats, Port
from quad_controller.policy.options import PolicyOptions
from quad_controller.policy.runner import PolicyRunner
from quad_controller.states.limiter import StepLimiter
from quad_description import Quadruped, quadruped, robot_urdf
from quad_sim.env import Randomization, WalkingEnv

IMITATED = 'imitation of the trot (DAgger in quad_sim/Walk-v0, firm servos)'
PRACTISED = 'imitation of the trot, then PPO (quad_sim/Walk-v0, firm servos)'


def teacher_of(robot: Quadruped) -> GaitTeacher:
    """Return the gait as the teacher of a robot."""
    return GaitTeacher(robot, LOW_AND_WIDE)


def values_for(robot: Quadruped, kind: str = '') -> Values:
    """Return the contract of a policy for a robot.

    Args:
        robot: The robot.
        kind: How the policy is made, for people.
    """
    teacher = teacher_of(robot)
    return contract_values(robot.names, teacher.stand, teacher.schedule.period, kind)


class NoNetwork:
    """Stands where the network will be: the trainer answers instead of it."""

    metadata: Mapping[str, str] = {}
    inputs: tuple[Port, ...] = ()
    outputs: tuple[Port, ...] = ()
    digest = ''

    def recur(self, states: tuple[RecurrentState, ...]) -> None:
        """Have none."""

    def reset(self) -> None:
        """Have no past."""

    def run(self, observation: Floats) -> Floats:
        """Refuse: nobody asks it.

        Raises:
            NotImplementedError: Always.
        """
        raise NotImplementedError('the trainer answers')


class ContractEnv(gymnasium.Wrapper[Floats, Floats, Floats, Floats]):
    """Walking, with the observations and actions of the contract.

    Attributes:
        contract: The contract.
        walking: The environment below.
    """

    def __init__(self, env: WalkingEnv) -> None:
        """Wrap an environment."""
        super().__init__(env)
        self.walking = env
        robot = quadruped(robot_urdf())
        self.contract = contract_of(values_for(robot))
        self._runner = PolicyRunner(
            'training', NoNetwork(), self.contract, robot, options=PolicyOptions(), period=PERIOD
        )
        self._limiter = StepLimiter(robot.limits, PERIOD)
        count = len(robot.names)
        self.action_space = spaces.Box(-np.inf, np.inf, (count,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (self.contract.width,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Stand on the ground again, somewhere in the cycle of the gait."""
        _, info = self.walking.reset(seed=seed, options=options)
        stand = tuple(self.walking.stand.tolist())
        self._runner.reset(stand)
        self._limiter.start(stand)
        self._runner.advance(float(self.walking.np_random.uniform()))
        return self._observe(), info

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Do what an answer of the network means, and let a period pass."""
        wanted = self._runner.act(np.asarray(action, np.float32), PERIOD)
        targets = np.array(self._limiter.step(wanted, PERIOD), np.float32)
        _, reward, fallen, over, info = self.walking.step(targets - self.walking.stand)
        self._runner.advance(PERIOD)
        return self._observe(), float(reward), fallen, over, info

    @property
    def inputs(self) -> PolicyInputs:
        """What is measured and commanded now.

        Raises:
            ValueError: The environment measures no joints or no attitude.
        """
        joints, imu = self.walking.state.joints, self.walking.state.imu
        if joints is None or imu is None:
            raise ValueError('a robot in physics measures joints and attitude')
        return PolicyInputs(joints, imu, Velocity(*self.walking.command))

    def _observe(self) -> Floats:
        seen: Floats = self._runner.observe(self.inputs)[0].copy()
        return seen


class TaughtEnv(gymnasium.ObservationWrapper[Floats, Floats, Floats]):
    """With what the teacher would do behind each observation."""

    def __init__(self, env: ContractEnv) -> None:
        """Wrap an environment."""
        super().__init__(env)
        self._env = env
        robot = quadruped(robot_urdf())
        self._teacher = teacher_of(robot)
        self._defaults = np.array(env.contract.default_positions)
        terms = env.contract.terms
        place = [term.source for term in terms].index(Source.PHASE)
        self._phase = sum(term.width for term in terms[:place])
        width = env.contract.width + len(robot.names)
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)

    def observation(self, observation: Floats) -> Floats:
        """Return an observation with the action of the teacher behind it."""
        inputs = self._env.inputs
        sine, cosine = observation[self._phase : self._phase + 2].tolist()
        moves = math.hypot(sine, cosine) > 0.0
        targets = self._teacher.targets(
            inputs.velocity if moves else Velocity(),
            math.atan2(sine, cosine) / math.tau % 1.0,
            inputs.imu.roll_pitch_yaw[:2],
        )
        wanted = (np.array(targets) - self._defaults) / SCALE
        return np.concatenate([observation, wanted.astype(np.float32)])


def practice_env(randomization: Randomization) -> ContractEnv:
    """Make an environment to practise in."""
    return ContractEnv(WalkingEnv(randomization=randomization, period=PERIOD))


def taught_env(randomization: Randomization) -> TaughtEnv:
    """Make an environment in which the teacher is beside the robot."""
    return TaughtEnv(practice_env(randomization))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment as a policy with a contract sees it: what is trained is what runs later.

Observations and targets are made by the runner that the controller has, and the targets pass its
limiter of speeds.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from gait_teacher import GaitTeacher
import gymnasium
from gymnasium import spaces
import numpy as np
from trained_contract import (
    contract_of,
    PERIOD,
    Values,
    walking_values,
)

from quad_controller import PolicyOptions, Velocity
from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.policy.contract.model import PolicyContract, Source
from quad_controller.policy.network import Floats, OnnxNetwork
from quad_controller.policy.observation import PolicyInputs
from quad_controller.policy.runner import PolicyRunner
from quad_controller.states.motion import StepLimiter
from quad_description import Quadruped, quadruped, robot_urdf, Targets
from quad_sim.env import Randomization, WalkingEnv


def teacher_of(robot: Quadruped) -> GaitTeacher:
    """Return the gait as the teacher of a robot."""
    return GaitTeacher(robot, LOW_AND_WIDE)


def walking_contract(robot: Quadruped, kind: str = '') -> Values:
    """Return the contract of a policy that walks; ``kind`` says how it is made, for people."""
    teacher = teacher_of(robot)
    return walking_values(robot.names, teacher.stand, teacher.schedule.period, kind)


class NoNetwork(OnnxNetwork):
    """Stands where the network will be: the trainer answers instead of it."""

    def __init__(self) -> None:
        self.name, self.digest = 'training', ''

    def reset(self) -> None:
        """Have no past."""


class ContractEnv(gymnasium.Wrapper[Floats, Floats, Floats, Floats]):
    """Walking with the observations and actions of a contract."""

    def __init__(self, env: WalkingEnv, values: Values) -> None:
        """Wrap an environment by the values of a contract."""
        super().__init__(env)
        self.simulation = env  # the environment below
        robot = quadruped(robot_urdf())
        self.contract = contract_of(values)
        self._runner = PolicyRunner(
            NoNetwork(), self.contract, robot, options=PolicyOptions(), period=PERIOD
        )
        self._limiter = StepLimiter(robot.limits, PERIOD)
        count = len(robot.names)
        self.action_space = spaces.Box(-np.inf, np.inf, (count,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (self.contract.width,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode where the set-points are, somewhere in the cycle of a gait."""
        _, info = self.simulation.reset(seed=seed, options=options)
        start = tuple(self.simulation.robot.joint_targets.tolist())
        self._runner.reset(start)
        self._limiter.start(start)
        self._runner.advance(float(self.simulation.np_random.uniform()))
        return self._observe(), info

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Do what an answer of the network means, and let a period pass."""
        wanted = self._runner.act(np.asarray(action, np.float32), PERIOD)
        targets = np.array(self._limiter.step(wanted, PERIOD), np.float32)
        _, reward, fallen, over, info = self.simulation.step(targets - self.simulation.stand)
        self._runner.advance(PERIOD)
        return self._observe(), float(reward), fallen, over, info

    @property
    def inputs(self) -> PolicyInputs:
        """What is measured and commanded now.

        Raises:
            ValueError: The environment measures no joints or no attitude.
        """
        joints, imu = self.simulation.state.joints, self.simulation.state.imu
        if joints is None or imu is None:
            raise ValueError('a robot in physics measures joints and attitude')
        return PolicyInputs(joints, imu, Velocity(*self.simulation.command))

    def _observe(self) -> Floats:
        seen: Floats = self._runner.observe(self.inputs)[0].copy()
        return seen


Teacher = Callable[[PolicyInputs, Floats], Targets]
"""Answers joint targets [rad] for what is measured, and the observation that is made of it."""


class TaughtEnv(gymnasium.ObservationWrapper[Floats, Floats, Floats]):
    """With what the teacher would do behind each observation."""

    def __init__(self, env: ContractEnv, teacher: Teacher) -> None:
        """Wrap an environment."""
        super().__init__(env)
        self._env, self._teacher = env, teacher
        action = env.contract.action
        self._offset, self._scale = np.array(action.offset), np.array(action.scale)
        width = env.contract.width + len(action.offset)
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)

    def observation(self, observation: Floats) -> Floats:
        """Return an observation with the action of the teacher behind it."""
        targets = self._teacher(self._env.inputs, observation)
        wanted = (np.array(targets) - self._offset) / self._scale
        return np.concatenate([observation, wanted.astype(np.float32)])


def walking_teacher(contract: PolicyContract) -> Teacher:
    """Return the gait, at the phase that is observed."""
    teacher = teacher_of(quadruped(robot_urdf()))
    place = [term.source for term in contract.terms].index(Source.PHASE)
    phase = sum(term.width for term in contract.terms[:place])

    def targets(inputs: PolicyInputs, observation: Floats) -> Targets:
        sine, cosine = observation[phase : phase + 2].tolist()
        moves = math.hypot(sine, cosine) > 0.0
        return teacher.targets(
            inputs.velocity if moves else Velocity(),
            math.atan2(sine, cosine) / math.tau % 1.0,
            inputs.imu.roll_pitch_yaw[:2],
        )

    return targets


def walking_env(randomization: Randomization) -> ContractEnv:
    """Make an environment to practise walking in."""
    env = WalkingEnv(randomization=randomization, period=PERIOD)
    return ContractEnv(env, walking_contract(quadruped(robot_urdf())))


def taught_walking_env(randomization: Randomization) -> TaughtEnv:
    """Make an environment in which the teacher of walking is beside the robot."""
    env = walking_env(randomization)
    return TaughtEnv(env, walking_teacher(env.contract))

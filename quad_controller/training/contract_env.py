# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Environment that applies a policy contract, so that training matches deployment.

The controller's runner builds observations and targets; its speed limiter limits the targets.
"""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path
from typing import Any

import gymnasium
from gymnasium import spaces
import numpy as np

from quad_controller import GaitParameters, PolicyOptions, Velocity
from quad_controller.gait.velocity import REST
from quad_controller.policy.contract.document import ContractDocument, document_of
from quad_controller.policy.contract.mjlab import read_metadata
from quad_controller.policy.contract.model import PolicyContract, Source
from quad_controller.policy.network import Floats, OnnxNetwork
from quad_controller.policy.observation import Situation
from quad_controller.policy.runner import PolicyRunner
from quad_controller.states.motion import StepLimiter
from quad_description import ImuSample, quadruped, robot_urdf
from quad_hardware.backend import JointBytes
from quad_hardware.estimation import EstimatorSettings
from quad_hardware.filters import AttitudeRate
from quad_sim import ServoModel, Terrain
from quad_sim.env import CommandRanges, Randomization, WalkingEnv

PERIOD = 0.02  # [s]
LIMITS = GaitParameters().velocity_limits  # that the controller keeps for every policy
COMMANDS = CommandRanges(x=(-LIMITS.x, LIMITS.x), time=3.0, straight=0.7)
UNSEEN = 6  # numbers at the end of an observation, which the judge sees and the policy does not
V1_SHARE = 0.5  # of the episodes that go through the bytes of protocol v1; the others are v2's
TIMESTEP = 0.004  # [s] of the physics
ROUGH = Terrain(roughness=0.02, seed=2)  # the highest bumps that are practised on
SERVO = replace(
    ServoModel.NOMINAL.parameters, stiffness=3.5, velocity_gain=0.06, delay=0.0, backlash=0.0
)
"""What stiffness, delay and backlash are varied from."""
PLANT = Randomization(
    friction=(0.35, 1.3),
    trunk_mass=(0.9, 1.3),
    stiffness=(1.0 / SERVO.stiffness, 12.0 / SERVO.stiffness),
    delay=(0.0, 0.06),
    backlash=(0.0, 0.026),
    refresh=(0.0, 0.04),
    kick=(-0.4, 0.4),
    kick_interval=2.0,
)
"""What differs in the end: servos of 1 to 12 N m/rad, with up to 1.5 degrees of play."""


def contract_of(path: Path, kind: str) -> ContractDocument:
    """Return the contract of an ONNX file, for training on the simulated plant.

    Raises:
        PolicyError: The file cannot be read.
    """
    start = read_metadata(OnnxNetwork(path).metadata)
    own = {
        'kind': kind,
        'gains': {'stiffness': SERVO.stiffness, 'damping': SERVO.velocity_gain},
        'observation': {
            'terms': {
                name: {'noise': v1_velocity_error()}
                for name, term in start.values['observation']['terms'].items()
                if term['source'] == Source.JOINT_VELOCITIES.value
            }
        },
    }
    return document_of(own, 'training').over(start)


def v1_velocity_error() -> float:
    """Return the rms error of joint velocities estimated from v1 positions [rad/s]."""
    rest = [0.0] * len(quadruped(robot_urdf()).names)
    return JointBytes(robot_urdf()).read(rest, 0.0).velocity_error


class NoNetwork(OnnxNetwork):
    """Placeholder for the network: the trainer supplies the actions."""

    def __init__(self) -> None:
        self.name, self.digest = 'training', ''

    def reset(self) -> None:
        """Do nothing: there is no recurrent state."""


class ContractEnv(gymnasium.Wrapper[Floats, Floats, Floats, Floats]):
    """Walking environment with the observations and actions of a contract."""

    def __init__(self, env: WalkingEnv, contract: PolicyContract) -> None:
        """Wrap an environment."""
        super().__init__(env)
        self.simulation = env  # the environment below
        robot = quadruped(robot_urdf())
        self.contract = contract
        self._runner = PolicyRunner(
            NoNetwork(), self.contract, robot, options=PolicyOptions(), period=PERIOD
        )
        self._limiter = StepLimiter(robot.limits, PERIOD)
        self._bytes = JointBytes(robot_urdf())
        count = len(robot.names)
        self.action_space = spaces.Box(-np.inf, np.inf, (count,), np.float32)
        width = self.contract.width + UNSEEN
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode at the set-points of the environment, at a random gait phase."""
        _, info = self.simulation.reset(seed=seed, options=options)
        start = tuple(self.simulation.robot.joint_targets.tolist())
        self._runner.reset(start)
        self._limiter.start(start)
        self._velocity = REST
        self._bytes.reset()
        self._attitude_rate = AttitudeRate(EstimatorSettings().rate_cutoff)
        self._by_v1 = self.simulation.np_random.random() < V1_SHARE
        self._sense()
        self._runner.advance(float(self.simulation.np_random.uniform()))
        return self._observe(), info

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Apply an action of the network and advance by one period."""
        wanted = self._runner.act(np.asarray(action, np.float32), PERIOD)
        sent = self._limiter.step(wanted, PERIOD)
        targets = np.array(self._bytes.rounded(sent) if self._by_v1 else sent, np.float32)
        reward, fallen, over, info = self.simulation.advance(
            targets - self.simulation.stand, self._velocity
        )
        self._runner.advance(PERIOD)
        self._sense()
        return self._observe(), float(reward), fallen, over, info

    def _sense(self) -> None:
        """Estimate the state from a report, as the bridge does from protocol bytes."""
        state = self.simulation.state
        joints, imu = state.joints, state.imu
        if joints is None or imu is None:
            raise ValueError('a robot in physics measures its joints and its attitude')
        if self._by_v1:
            joints = self._bytes.read(joints.positions, state.time)
        else:
            turning = self._attitude_rate.update(state.time, imu.orientation)
            imu = ImuSample(imu.orientation, turning, imu.acceleration)
        wanted = LIMITS.clamp(Velocity(*self.simulation.command))
        self._velocity = LIMITS.approach(self._velocity, wanted, PERIOD)
        self.inputs = Situation(joints, imu, velocity=self._velocity)

    def _observe(self) -> Floats:
        seen: Floats = self._runner.observe(self.inputs)[0]
        (x, y, yaw), robot = self.simulation.error, self.simulation.variation
        plant = math.log(robot.stiffness), robot.delay / 0.03 - 1.0, robot.friction
        return np.concatenate([seen, np.array([*plant, x / 0.1, y / 0.1, yaw / 0.4], np.float32)])


def walking_env(contract: PolicyContract, randomization: Randomization) -> ContractEnv:
    """Create the training environment: simulated plant, rough ground, state estimator."""
    env = WalkingEnv(
        servo=SERVO,
        randomization=randomization,
        commands=COMMANDS,
        period=PERIOD,
        terrain=ROUGH,
        timestep=TIMESTEP,
    )
    return ContractEnv(env, contract)

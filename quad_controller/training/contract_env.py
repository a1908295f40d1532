# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment as a policy with a contract sees it: what is trained is what runs later.

Observations and targets are made by the runner that the controller has, and the targets pass its
limiter of speeds.
"""

from __future__ import annotations

import math
from typing import Any

import gymnasium
from gymnasium import spaces
import numpy as np

from quad_controller import BodyPose, Gait, GaitParameters, PolicyOptions, Velocity
from quad_controller.gait.body import feet_in_body
from quad_controller.gait.parameters import LOW_AND_WIDE
from quad_controller.gait.stepping import arc, swing_way, SwingLift
from quad_controller.policy.contract.document import document_of
from quad_controller.policy.contract.mjlab import CONTRACT_KEY
from quad_controller.policy.contract.model import build_contract, PolicyContract, Source
from quad_controller.policy.network import Floats, OnnxNetwork
from quad_controller.policy.observation import Situation
from quad_controller.policy.runner import PolicyRunner
from quad_controller.states.motion import StepLimiter
from quad_description import Quadruped, quadruped, robot_urdf, Targets
from quad_description.rotations import Vector
from quad_sim import ServoModel
from quad_sim.env import CommandRanges, Randomization, WalkingEnv

PERIOD = 0.02  # [s]
SCALE = 0.25  # [rad] for an action of one
PHASE_THRESHOLD = 0.02  # slower commands have no phase

Values = dict[str, Any]


def contract_of(values: Values) -> PolicyContract:
    """Return the contract that values say."""
    return build_contract(document_of(values, 'training'))


def metadata_of(values: Values) -> dict[str, str]:
    """Return the metadata of a file that has its contract."""
    return {CONTRACT_KEY: document_of(values, '').to_yaml()}


class GaitTeacher:
    """Answers the joint targets of a trot that has been going on at a velocity for long."""

    def __init__(self, robot: Quadruped, parameters: GaitParameters) -> None:
        """Use the trot of some parameters."""
        self._robot, self._parameters = robot, parameters
        self.schedule = parameters.schedule(Gait.TROT, robot.leg_length)
        self._neutral = parameters.stance(robot, [0.0] * len(robot.names))
        self._lift = SwingLift(robot, self._neutral, self.schedule, parameters.swing_height)

    @property
    def stand(self) -> Targets:
        """Joint targets of a robot that stands [rad]."""
        return self.targets(Velocity(), 0.0, (0.0, 0.0))

    def targets(self, velocity: Velocity, phase: float, tilt: tuple[float, float]) -> Targets:
        """Return the joint targets in [rad].

        Args:
            phase: Share of the period that has passed.
            tilt: Measured roll and pitch in [rad].
        """
        feet = [
            self._foot(place, offset, velocity, phase)
            for place, offset in zip(self._neutral, self.schedule.offsets, strict=True)
        ]
        gain = self._parameters.level_gain
        pose = BodyPose(roll=_bounded(-gain * tilt[0]), pitch=_bounded(-gain * tilt[1]))
        moved = feet_in_body(feet, pose, self._robot.hip_centre)
        return self._robot.place(self._robot.solve(moved), [0.0] * len(self._robot.names))

    def _foot(self, place: Vector, offset: float, velocity: Velocity, phase: float) -> Vector:
        schedule = self.schedule
        over_x = velocity.x - velocity.yaw * place[1]
        over_y = velocity.y + velocity.yaw * place[0]
        part = math.fmod(phase + offset, 1.0)
        if part < schedule.duty:
            time = schedule.stance_duration * (0.5 - part / schedule.duty)
            return place[0] + over_x * time, place[1] + over_y * time, place[2]
        part = (part - schedule.duty) / (1.0 - schedule.duty)
        x, y = (swing_way(over, part, schedule) for over in (over_x, over_y))
        scale = min(1.0, math.hypot(over_x, over_y) / 0.03)
        lift = self._lift.height(over_x, over_y) * scale * arc(part)
        return place[0] + x, place[1] + y, place[2] + lift


def _bounded(angle: float) -> float:
    return min(max(angle, -0.2), 0.2)


def walking_contract(robot: Quadruped, kind: str = '') -> Values:
    """Return the contract of a policy that walks, as it is written into its file.

    Args:
        kind: How the policy is made, for people.
    """
    teacher = GaitTeacher(robot, LOW_AND_WIDE)
    ranges, servo = CommandRanges(), ServoModel.FIRM.parameters
    terms = {
        'angular_velocity': {'source': 'angular_velocity', 'frame': 'base'},
        'gravity': {'source': 'gravity'},
        'command': {'source': 'command'},
        'phase': {
            'source': 'phase',
            'phase_period': round(teacher.schedule.period, 3),
            'phase_threshold': PHASE_THRESHOLD,
        },
        'positions': {'source': 'joint_positions', 'relative': True},
        'velocities': {'source': 'joint_velocities'},
        'last_action': {'source': 'last_action'},
    }
    return {
        'kind': kind,
        'joints': list(robot.names),
        'default_positions': [round(position, 3) + 0.0 for position in teacher.stand],
        'period': PERIOD,
        'observation': {'terms': terms},
        'action': {'scale': SCALE},
        'gains': {'stiffness': servo.stiffness, 'damping': servo.velocity_gain},
        'commands': {'x': list(ranges.x), 'y': list(ranges.y), 'yaw': list(ranges.yaw)},
    }


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
    def inputs(self) -> Situation:
        """What is measured and commanded now."""
        state = self.simulation.state
        return Situation(state.joints, state.imu, Velocity(*self.simulation.command))

    def _observe(self) -> Floats:
        seen: Floats = self._runner.observe(self.inputs)[0].copy()
        return seen


class TaughtEnv(gymnasium.ObservationWrapper[Floats, Floats, Floats]):
    """With what the teacher would do behind each observation, at the phase that is observed."""

    def __init__(self, env: ContractEnv) -> None:
        """Wrap an environment."""
        super().__init__(env)
        self._env = env
        self._teacher = GaitTeacher(quadruped(robot_urdf()), LOW_AND_WIDE)
        terms = env.contract.terms
        place = [term.source for term in terms].index(Source.PHASE)
        self._phase = sum(term.width for term in terms[:place])
        action = env.contract.action
        self._offset, self._scale = np.array(action.offset), np.array(action.scale)
        width = env.contract.width + len(action.offset)
        self.observation_space = spaces.Box(-np.inf, np.inf, (width,), np.float32)

    def observation(self, observation: Floats) -> Floats:
        """Return an observation with the action of the teacher behind it."""
        inputs = self._env.inputs
        if inputs.imu is None:
            raise ValueError('a robot in physics measures its attitude')
        sine, cosine = observation[self._phase : self._phase + 2].tolist()
        targets = self._teacher.targets(
            inputs.velocity if math.hypot(sine, cosine) > 0.0 else Velocity(),
            math.atan2(sine, cosine) / math.tau % 1.0,
            inputs.imu.roll_pitch_yaw[:2],
        )
        wanted = (np.array(targets) - self._offset) / self._scale
        return np.concatenate([observation, wanted.astype(np.float32)])


def walking_env(randomization: Randomization) -> ContractEnv:
    """Make an environment to practise walking in."""
    env = WalkingEnv(servo=ServoModel.FIRM, randomization=randomization, period=PERIOD)
    return ContractEnv(env, walking_contract(quadruped(robot_urdf())))


def taught_walking_env(randomization: Randomization) -> TaughtEnv:
    """Make an environment in which the teacher of walking is beside the robot."""
    return TaughtEnv(walking_env(randomization))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A controller with a robot that follows at once, in time that the test makes pass."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from policy_export import export, Layers

from quad_builds import Build, urdf
from quad_controller import (
    Controller,
    GaitGenerator,
    GaitParameters,
    ServoModel,
    State,
    StateParameters,
    Velocity,
)
from quad_controller.gait.velocity import REST
from quad_controller.policy.contract.model import RecurrentState
from quad_controller.policy.network import FLOAT, Floats, OnnxNetwork, Port
from quad_controller.policy.observation import Situation
from quad_controller.policy.runner import PolicyRunner, PolicyStep
from quad_description import ImuSample, JointSample, quadruped, robot_urdf, RobotState, Targets
from quad_sim import ServoModel as Servos
from quad_sim import Terrain
from quad_sim.physics import Meter, PhysicsBackend, Robot
from quad_sim.state import FLAT

URDF = robot_urdf()
MODEL = quadruped(URDF)
ROBOT = quadruped(urdf())
STAND = GaitGenerator(ROBOT, GaitParameters()).stand_targets
PERIOD = 0.02  # [s]
FIRM = GaitParameters(servo=ServoModel(kp=Servos.FIRM.parameters.stiffness))
"""A gait for servos that hardly give way."""


def firm(terrain: Terrain = FLAT) -> Robot:
    """Return a robot with such servos."""
    return Robot(URDF, Servos.FIRM, terrain)


class Travel(NamedTuple):
    """How the robot went: mean velocities in its own frame [m/s], [rad/s], largest tilt [rad]."""

    x: float
    y: float
    yaw: float
    tilt: float


class PhysicsRig:
    """Lets a controller walk a robot."""

    def __init__(
        self,
        robot: Robot | None = None,
        gait: GaitParameters | None = None,
        policy: PolicyRunner | None = None,
        urdf: str = URDF,
        sense: Callable[[RobotState], RobotState] = lambda state: state,
        *,
        states: StateParameters | None = None,
    ) -> None:
        """Stand up, by what the robot's sensors say."""
        states = states or StateParameters()
        self._sense, self._period = sense, states.period
        self.robot, self.model, self._urdf = robot or Robot(urdf), quadruped(urdf), urdf
        self._backend = PhysicsBackend(self.robot, self._period)
        self.controller = Controller(self.model, gait or GaitParameters(), states, policy=policy)
        self.tilt = 0.0
        self.step(REST)
        self.mode('stand')
        self.run(2.0)

    def mode(self, mode: str) -> None:
        """Ask for a mode that has to be accepted."""
        answer = self.controller.set_mode(mode)
        assert answer.accepted, answer.message

    def step(self, velocity: Velocity) -> Targets:
        """Pass one period; return the targets that were sent."""
        self.controller.set_velocity(velocity)
        state = self._sense(self._backend.observe())
        targets = self.controller.step(state, self._period).targets
        self.hold(self._period, targets)
        return targets or ()

    def hold(self, duration: float, targets: Targets | None) -> None:
        """Pass some seconds with targets, without the controller."""
        for _ in range(round(duration / self._period)):
            self._backend.step(targets)
            self.tilt = max(self.tilt, self.robot.base_pose.tilt)

    def run(self, duration: float, velocity: Velocity = REST) -> None:
        """Pass some seconds with a velocity."""
        for _ in range(round(duration / self._period)):
            self.step(velocity)

    def travel(self, duration: float, velocity: Velocity) -> Travel:
        """Walk with a velocity and return how the robot went."""
        self.tilt = 0.0
        meter = Meter(self.robot, self._urdf)
        for _ in range(round(duration / self._period)):
            self.step(velocity)
            meter.sample()
        way = meter.read()
        return Travel(way.x / duration, way.y / duration, way.yaw / duration, way.tilt)

    @property
    def state(self) -> str:
        """The controller's state."""
        return self.controller.status.title

    @property
    def faulted(self) -> bool:
        """Whether the controller has given up."""
        return self.controller.status.state is State.FAULT


TERMS = 'ang_vel,gravity,cmd,phase,joint_pos,joint_vel,prev_action'


def metadata(**changes: str | None) -> dict[str, str]:
    """Return what a fitting file says; a change to None leaves a key out."""
    fitting: dict[str, str | None] = {
        'joint_names': joined(ROBOT.names),
        'default_joint_pos': joined([round(angle, 3) for angle in STAND]),
        'action_scale': '0.25',
        'observation_names': TERMS,
        'command_names': 'twist',
        'phase_period': '0.28',
        'imu_frame': 'base',
    }
    return {key: value for key, value in (fitting | changes).items() if value is not None}


class FakeNetwork(OnnxNetwork):
    """Answers as it is set up to, and keeps the requests."""

    def __init__(self, values: Mapping[str, str], joints: int = 12) -> None:
        """Have some metadata."""
        self.metadata = values
        self.inputs: tuple[Port, ...] = (('obs', FLOAT, (1, 11 + 3 * joints)),)
        self.outputs: tuple[Port, ...] = (('actions', FLOAT, (1, joints)),)
        self.name, self.digest = 'test', 'abc'
        self.warnings: tuple[str, ...] = ()
        self.sides: tuple[str, ...] = ()
        self.action: Floats = np.zeros((1, joints), np.float32)
        self.blind = False
        self.asked: list[Floats] = []

    def recur(self, states: tuple[RecurrentState, ...], actions: str = '') -> None:
        """Have no states."""

    def reset(self) -> None:
        """Have nothing to forget."""

    def run(self, observation: Floats) -> Floats:
        """Answer, with a trace of the observation."""
        self.asked.append(observation.copy())
        trace = 0.0 if self.blind else 1e-12 * float(observation.sum())
        return np.add(self.action, trace, dtype=np.float32)


def write_policy(path: Path, values: Mapping[str, str], width: int = 47) -> Path:
    """Write an ONNX file whose network answers nearly nothing."""
    network = random_layers((width, 8, 12), np.random.default_rng(0))
    network.weights[-1] *= np.float32(1e-3)
    export(network, path, values)
    return path


def random_layers(sizes: Sequence[int], random: np.random.Generator) -> Layers:
    """Return layers with random weights, which take observations as they are."""
    return Layers(
        np.zeros(sizes[0], np.float32),
        np.ones(sizes[0], np.float32),
        [random.standard_normal(shape).astype(np.float32) for shape in pairwise(sizes)],
        [np.zeros(size, np.float32) for size in sizes[1:]],
    )


def joined(values: object) -> str:
    """Return a list as exporters write it: by commas, numbers with three decimals."""
    if isinstance(values, str):
        return values
    if isinstance(values, (int, float)):
        return f'{values:.3f}'
    return ','.join(joined(value) for value in values)  # type: ignore[attr-defined]


UPRIGHT = ImuSample((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
ARM_ROBOT = quadruped(urdf(Build(arm=True)))
FOLDED = tuple([0.1, 1.3, -0.9] * 4)
LYING = tuple([0.0, 1.48, -1.1] * 4)
STANDING = tuple([0.0, 1.0, -0.3] * 4)


def tilted(angle: float) -> ImuSample:
    """Return the attitude of a body that is rolled by an angle [rad]."""
    return replace(UPRIGHT, orientation=(math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2)))


class StillPolicy(PolicyRunner):
    """A policy that stands, and answers wrongly on request."""

    def __init__(self, targets: Targets) -> None:
        """Answer always the same targets."""
        self.name, self.digest = 'still', ''
        self.targets: Targets | None = targets
        self.resets = 0
        self.velocities: list[Velocity] = []

    def missing(self, inputs: Situation) -> str:
        """Return what it has to see: what every policy sees."""
        if inputs.joints is None or inputs.joints.velocities is None:
            return 'a policy needs the velocities of the joints'
        turning = inputs.imu and inputs.imu.angular_velocity
        return '' if turning else 'a policy needs what /imu does not have'

    def inexact(self, joints: JointSample | None, *, stated: bool = False) -> str:
        """Take all velocities."""
        return ''

    def reset(self, others: Targets) -> None:
        """Count."""
        self.resets += 1

    def step(self, inputs: Situation, dt: float) -> PolicyStep:
        """Answer."""
        self.velocities.append(inputs.velocity)
        return PolicyStep(self.targets, '' if self.targets is not None else 'broken on purpose')


def standing(rig: Rig | None = None, mode: str = 'stand') -> Rig:
    """Return a rig that has stood up, and has been in a mode for a while."""
    rig = rig or Rig()
    rig.step()
    rig.ask('stand')
    rig.run(3.0)
    assert rig.is_in(State.STAND)
    if mode != 'stand':
        rig.ask(mode)
        rig.run(1.0)
    rig.log.clear()
    return rig


def policy_rig(policy: StillPolicy | None = None, **parameters: bool) -> tuple[Rig, StillPolicy]:
    """Return a rig with a policy, one that stands by default."""
    policy = policy or StillPolicy(STAND)
    controller = Controller(ROBOT, GaitParameters(), StateParameters(**parameters), policy=policy)
    return Rig(controller), policy


class Rig:
    """Makes time pass for a controller."""

    def __init__(self, controller: Controller | None = None, positions: Targets = FOLDED) -> None:
        self.controller = controller or Controller(ROBOT, GaitParameters(), StateParameters())
        self.positions = positions
        self.imu: ImuSample | None = UPRIGHT
        self.joints = True
        self.battery: float | None = None
        self.servo_problem: str | None = None
        self.largest_step = 0.0
        self.log: list[str] = []

    def is_in(self, state: State) -> bool:
        """Return whether the controller is in a state."""
        return self.controller.status.state is state

    def step(self, velocity: Velocity | None = None) -> Targets | None:
        """Pass one period."""
        if velocity is not None:
            self.controller.set_velocity(velocity)
        still = (0.0,) * len(self.positions)
        measured = RobotState(
            joints=JointSample(self.positions, still) if self.joints else None,
            imu=self.imu,
            battery=self.battery,
            servo_problem=self.servo_problem,
        )
        output = self.controller.step(measured, PERIOD)
        self.log += [event.text for event in output.events]
        if output.targets is not None:
            pairs = zip(output.targets, self.positions, strict=True)
            self.largest_step = max(self.largest_step, *(abs(a - b) for a, b in pairs))
            self.positions = output.targets
        return output.targets

    def run(self, duration: float, velocity: Velocity | None = None) -> None:
        """Pass some seconds, commanding a velocity all along."""
        for _ in range(round(duration / PERIOD)):
            self.step(velocity)

    def ask(self, mode: str) -> str:
        """Ask for a mode that has to be accepted."""
        answer = self.controller.set_mode(mode)
        assert answer.accepted, answer.message
        return answer.message

    def until(self, state: State, velocity: Velocity | None = None) -> None:
        """Pass time until a state is reached, ten seconds at most."""
        for _ in range(round(10 / PERIOD)):
            if self.is_in(state):
                return
            self.step(velocity)
        raise AssertionError(f'not in {state}; {self.log}')

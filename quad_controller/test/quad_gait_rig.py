# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A controller with a robot that follows at once, in time that the test makes pass."""

from __future__ import annotations

from dataclasses import replace
import math

from quad_builds import Build, urdf
from quad_controller import (
    Controller,
    GaitGenerator,
    GaitParameters,
    State,
    StateParameters,
    Velocity,
)
from quad_controller.policy.observation import Situation
from quad_controller.policy.runner import PolicyRunner, PolicyStep
from quad_description import ImuSample, JointSample, quadruped, RobotState, Targets

PERIOD = 0.02  # [s]
UPRIGHT = ImuSample((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 9.81))
ROBOT = quadruped(urdf())
ARM_ROBOT = quadruped(urdf(Build(arm=True)))
FOLDED = tuple([0.1, 1.3, -0.9] * 4)
LYING = tuple([0.0, 1.48, -1.1] * 4)
STANDING = tuple([0.0, 1.0, -0.3] * 4)


def tilted(angle: float) -> ImuSample:
    """Return the attitude of a body that is rolled by an angle [rad]."""
    return replace(UPRIGHT, orientation=(math.sin(angle / 2), 0.0, 0.0, math.cos(angle / 2)))


class StillPolicy(PolicyRunner):
    """A policy that stands, and answers wrongly on request."""

    def missing(self, inputs: Situation) -> str:
        """Return what it has to see: what every policy sees."""
        if inputs.joints is None or inputs.joints.velocities is None:
            return 'a policy needs the velocities of the joints'
        return (
            ''
            if inputs.imu and inputs.imu.angular_velocity
            else 'a policy needs what /imu does not have'
        )

    def inexact(self, joints: JointSample | None, *, stated: bool = False) -> str:
        """Take all velocities."""
        return ''

    def __init__(self, targets: Targets) -> None:
        """Answer always the same targets."""
        self.name, self.digest = 'still', ''
        self.targets: Targets | None = targets
        self.resets = 0
        self.velocities: list[Velocity] = []

    def reset(self, others: Targets) -> None:
        """Count."""
        self.resets += 1

    def step(self, inputs: Situation, dt: float) -> PolicyStep:
        """Answer."""
        self.velocities.append(inputs.velocity)
        return PolicyStep(self.targets, '' if self.targets is not None else 'broken on purpose')


STAND = GaitGenerator(ROBOT, GaitParameters()).stand_targets


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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Policies and the gait on the same ways in physics, with figures that can be compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
import math
import multiprocessing
import os
from pathlib import Path

import numpy as np

from quad_controller.gait.generator import GaitGenerator
from quad_controller.gait.parameters import GaitParameters
from quad_controller.gait.velocity import REST, Velocity
from quad_controller.policy.interface import Policy
from quad_controller.policy.load import load_policy
from quad_controller.policy.options import PolicyOptions
from quad_controller.states.controller import Controller
from quad_controller.states.modes import State
from quad_controller.states.parameters import StateParameters
from quad_description import quadruped, robot_urdf, RobotState
from quad_sim.physics import PhysicsBackend, Robot, Variation

STAND_TIME = 2.5  # [s] to stand up, and for a policy to take over
SETTLE_TIME = 1.0  # [s] to take up speed
PUSH_INTERVAL = 2.0  # [s]
FALLEN = math.radians(60.0)
CHANCE = 0.25  # share of the falls that may be chance

COMMANDS = (
    Velocity(0.1),
    Velocity(0.2),
    Velocity(0.3),
    Velocity(-0.2),
    Velocity(0.0, 0.1),
    Velocity(yaw=1.0),
    Velocity(0.2, 0.0, 0.5),
)


@dataclass(frozen=True, slots=True)
class Ground:
    """Under what conditions is walked.

    Attributes:
        title: What a person reads.
        push: Change of the velocity at once, to any side, every two seconds, in [m/s].
        variation: How robot and ground differ.
    """

    title: str
    push: float = 0.0
    variation: Variation = field(default_factory=Variation)


GROUNDS = (
    Ground('level'),
    Ground('pushed', push=1.2),
    Ground('20 % heavier, smooth ground', variation=Variation(0.4, 1.2, 0.9)),
)


@dataclass(frozen=True, slots=True)
class Figures:
    """How a walker did.

    Attributes:
        off: Mean distance of the velocity from what was commanded in [m/s].
        turning_off: The same of the turning in [rad/s].
        falls: In a minute.
    """

    off: float
    turning_off: float
    falls: float


class Walker:
    """The gait or a policy on one way after the other."""

    def __init__(self, policy: Policy | None, ground: Ground, seed: int) -> None:
        """Make robot and ground.

        Args:
            policy: What walks; None for the gait.
            ground: Where.
            seed: Of the pushes.
        """
        urdf = robot_urdf()
        self._policy, self._ground = policy, ground
        self._model = quadruped(urdf)
        self._backend = PhysicsBackend(Robot(urdf))
        self._random = np.random.default_rng(seed)
        self._stand()

    def figures(self, commands: Sequence[Velocity], duration: float) -> Figures:
        """Walk for some time [s] as commanded, each from standing; after a fall, stand again."""
        off, turning_off, falls = [], [], 0
        for command in commands:
            self._stand()
            self._pass(SETTLE_TIME, command, pushed=False)
            left = duration
            while left > 0.0:
                walked, way = self._pass(left, command, pushed=True)
                left -= walked
                if left > 0.0:
                    falls += 1
                    self._stand()
                    self._pass(SETTLE_TIME, command, pushed=False)
                if walked >= PUSH_INTERVAL:
                    mean = way.scaled(1.0 / walked)
                    off.append(math.hypot(mean.x - command.x, mean.y - command.y))
                    turning_off.append(abs(mean.yaw - command.yaw))
        return Figures(
            float(np.mean(off)) if off else math.nan,
            float(np.mean(turning_off)) if off else math.nan,
            60.0 * falls / (duration * len(commands)),
        )

    def _stand(self) -> None:
        self._backend.robot.reset(variation=self._ground.variation)
        self._state = self._backend.observe()
        states = StateParameters(period=self._backend.period)
        self._controller = Controller(self._model, GaitParameters(), states, policy=self._policy)
        self._step(REST)  # modes are refused before the robot is known
        mode = State.WALK if self._policy is None else State.POLICY
        self._controller.set_mode(mode.value)
        self._pass(STAND_TIME, REST, pushed=False)

    def _pass(self, duration: float, command: Velocity, *, pushed: bool) -> tuple[float, Velocity]:
        """Pass some time [s], less when the robot falls; return how long, and the way."""
        period = self._backend.period
        steps, between = round(duration / period), round(PUSH_INTERVAL / period)
        way = REST
        for step in range(1, steps + 1):
            before = self._state
            self._step(command)
            way = _added(way, before, self._state)
            if self._state.imu is None or self._state.imu.tilt > FALLEN:
                return step * period, way
            if pushed and self._ground.push and step % between == 0:
                angle = self._random.uniform(0.0, math.tau)
                push = self._ground.push
                self._backend.robot.kick((push * math.cos(angle), push * math.sin(angle), 0.0))
                self._state = self._backend.observe()
        return duration, way

    def _step(self, command: Velocity) -> None:
        self._controller.set_velocity(command)
        output = self._controller.step(self._state, self._backend.period)
        self._state = self._backend.step(output.targets)


def compare(
    walkers: Mapping[str, Path | None], duration: float, seed: int = 1
) -> dict[str, dict[str, Figures]]:
    """Let walkers walk, on all cores.

    Args:
        walkers: Files of policies by their names; None is the gait.
        duration: Of each way in [s].
        seed: Of the pushes; the same for all.

    Returns:
        Figures by the name of the walker and the title of the ground.

    Raises:
        PolicyError: A policy does not fit the robot.
    """
    jobs = [(name, path, ground) for name, path in walkers.items() for ground in GROUNDS]
    compared: dict[str, dict[str, Figures]] = {name: {} for name in walkers}
    # a process that is forked would have locks of threads that it does not have
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), mp_context=context) as pool:
        found = pool.map(partial(_figures, duration, seed), jobs)
        for (name, _, ground), figures in zip(jobs, found, strict=True):
            compared[name][ground.title] = figures
    return compared


def best(compared: Mapping[str, Mapping[str, Figures]]) -> str:
    """Return the name of the one that falls least often; of equals the one that is least off.

    Falls of two walkers that differ by less than a quarter are equal: that is chance.
    """
    falls = {name: sum(each.falls for each in found.values()) for name, found in compared.items()}
    most = min(falls.values()) / (1.0 - CHANCE) + 1.0
    equals = [name for name in compared if falls[name] <= most]
    return min(equals, key=lambda name: sum(each.off for each in compared[name].values()))


def _figures(duration: float, seed: int, job: tuple[str, Path | None, Ground]) -> Figures:
    _, path, ground = job
    policy = None if path is None else load(path)
    return Walker(policy, ground, seed).figures(COMMANDS, duration)


def load(path: Path) -> Policy:
    """Load a policy for the robot.

    Raises:
        PolicyError: It does not fit the robot.
    """
    robot = quadruped(robot_urdf())
    stand = GaitGenerator(robot, GaitParameters()).stand_targets
    return load_policy(path, robot, stand, PolicyOptions(), StateParameters().period).runner


def table(compared: Mapping[str, Mapping[str, Figures]]) -> str:
    """Return the figures as a table for people."""
    width = max(map(len, compared))
    lines = [f'{"":{width}}  {"ground":28} off [m/s]  turning off [rad/s]  falls in a minute']
    for name, grounds in compared.items():
        lines += [
            f'{name:{width}}  {title:28} {each.off:9.3f}  {each.turning_off:19.3f}  '
            f'{each.falls:17.1f}'
            for title, each in grounds.items()
        ]
    return '\n'.join(lines)


def _added(way: Velocity, before: RobotState, after: RobotState) -> Velocity:
    if before.imu is None or after.imu is None or not before.position or not after.position:
        return way
    heading = before.imu.roll_pitch_yaw[2]
    dx, dy = (b - a for a, b in zip(before.position[:2], after.position[:2], strict=True))
    return Velocity(
        way.x + dx * math.cos(heading) + dy * math.sin(heading),
        way.y + dy * math.cos(heading) - dx * math.sin(heading),
        way.yaw + math.remainder(after.imu.roll_pitch_yaw[2] - heading, math.tau),
    )

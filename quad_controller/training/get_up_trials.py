# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robots that were dropped and are to get up: how many stand, by how they lay."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
import math
import multiprocessing
import os
from pathlib import Path

import numpy as np
from trained_contract import PERIOD

from quad_controller.exceptions import CheckError
from quad_controller.gait.velocity import REST
from quad_controller.policy.interface import PolicyInputs
from quad_controller.policy.runner import PolicyRunner
from quad_controller.policy_check.trial import Candidate
from quad_controller.states.get_up import LEVEL
from quad_controller.states.limiter import StepLimiter
from quad_controller.states.lying import Lying, lying_on
from quad_description import quadruped, robot_urdf, Targets
from quad_description.rotations import down_in_body
from quad_sim import SimulationError
from quad_sim.env import GetUpEnv, Randomization
from quad_sim.physics import Meter

DURATION = 8.0  # [s] in which it has to get up
STILL_TIME = 1.0  # [s] at the end of it, in which it has to stand
MAX_HEIGHT_ERROR = 0.02  # [m]
MAX_SPEED, MAX_TURN_RATE = 0.1, 1.0  # [m/s], [rad/s]
MAX_SATURATION = 0.1  # share of the time at the limits of torque or speed, mean of all servos
CHANCE = 2.0  # standard deviations by which what is better may be so by chance
FIRST_SEED = 1_000_000  # of the drops: no training has seen them

RANDOMIZATION = Randomization(kick=(0.0, 0.0), kick_interval=0.0)
"""What differs from drop to drop; nobody kicks a robot that gets up."""

TITLE = 'stands after lying'
STRAIGHT = 'to the stand pose straight'
"""Who goes from wherever the joints are to those of a robot that stands, as fast as they can."""


CLASSES = {
    'upright': (Lying.BELLY,),
    'side': (Lying.LEFT, Lying.RIGHT),
    'nose': (Lying.NOSE,),
    'tail': (Lying.TAIL,),
    'back': (Lying.BACK,),
}
"""How a robot may lie when it begins to get up, by titles for people."""


@dataclass(frozen=True, slots=True)
class Dropped:
    """What came of a drop.

    Attributes:
        lying: How it lay.
        stands: It stands, and still, in the end.
        torque_saturation: Share of the time at the largest torque, mean of all servos.
        speed_saturation: Share of the time at the largest speed, mean of all servos.
    """

    lying: Lying
    stands: bool
    torque_saturation: float
    speed_saturation: float


@dataclass(frozen=True, slots=True)
class DropTrial:
    """Drops that somebody gets up from.

    Attributes:
        path: An ONNX file; None for who goes to the stand pose straight.
        seeds: Of the drops.
    """

    path: Path | None
    seeds: tuple[int, ...]

    def run(self) -> list[Dropped]:
        """Drop, and let time pass.

        Raises:
            CheckError: The physics failed.
            PolicyError: The policy does not fit the robot.
        """
        loaded = None if self.path is None else Candidate(self.path).load()
        policy = None if loaded is None else loaded.runner
        env = GetUpEnv(randomization=RANDOMIZATION, period=PERIOD, duration=DURATION)
        limiter = StepLimiter(quadruped(robot_urdf()).limits, PERIOD)
        try:
            return [_drop(env, policy, limiter, seed) for seed in self.seeds]
        except SimulationError as error:
            raise CheckError(f'the physics failed: {error}') from error


def try_drops(who: Mapping[str, Path | None], count: int) -> dict[str, list[Dropped]]:
    """Let several get up from the same drops, on all cores.

    Args:
        who: Who gets up, by their names; see :class:`DropTrial`.
        count: Of the drops of each.

    Raises:
        CheckError: The physics failed.
        PolicyError: A policy does not fit the robot.
    """
    workers = len(os.sched_getaffinity(0))
    parts = [
        tuple(seeds.tolist())
        for seeds in np.array_split(np.arange(FIRST_SEED, FIRST_SEED + count), 2 * workers)
    ]
    trials = [DropTrial(path, seeds) for path in who.values() for seeds in parts]
    # a process that is forked would have locks of threads that it does not have
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(min(workers, len(trials)), mp_context=context) as pool:
        found = list(pool.map(DropTrial.run, trials))
    return {
        name: [each for part in found[place : place + len(parts)] for each in part]
        for name, place in zip(who, range(0, len(found), len(parts)), strict=True)
    }


def is_better(tried: Sequence[Dropped], baseline: Sequence[Dropped]) -> bool:
    """Return whether somebody stands after more of the same drops, by more than chance.

    Drops after which both stand, or none, say nothing (McNemar, 1947).

    Args:
        tried: What came of somebody's drops.
        baseline: What came of the same drops of another one.
    """
    pairs = [(one.stands, other.stands) for one, other in zip(tried, baseline, strict=True)]
    won, lost = pairs.count((True, False)), pairs.count((False, True))
    return won - lost > CHANCE * math.sqrt(won + lost)


def is_gentle(tried: Sequence[Dropped]) -> bool:
    """Return whether servos are hardly ever at their limits."""
    return max(saturation(tried)) <= MAX_SATURATION


def saturation(tried: Sequence[Dropped]) -> tuple[float, float]:
    """Return the shares of the time at the largest torque, and at the largest speed."""
    return (
        float(np.mean([each.torque_saturation for each in tried])),
        float(np.mean([each.speed_saturation for each in tried])),
    )


def stand_share(tried: Sequence[Dropped]) -> float:
    """Return the share of the drops after which a robot stands."""
    return float(np.mean([each.stands for each in tried]))


def drop_table(tried: Mapping[str, Sequence[Dropped]]) -> str:
    """Return who stands after how many drops, by how the robot lay, as a table for people."""
    first = next(iter(tried.values()))
    width = max(map(len, (TITLE, *tried)))
    counts = [len(group) for group in (*_groups(first), first)]
    lines = [
        f'{TITLE:{width}}  {_cells([*CLASSES, "all"])}  full torque  full speed',
        f'{"drops":{width}}  {_cells(map(str, counts))}',
    ]
    for name, drops in tried.items():
        shares = _cells(
            f'{stand_share(group):.0%}' if group else '-' for group in (*_groups(drops), drops)
        )
        torque, speed = saturation(drops)
        lines.append(f'{name:{width}}  {shares}  {torque:11.1%}  {speed:10.1%}')
    return '\n'.join(lines)


def _groups(drops: Sequence[Dropped]) -> list[list[Dropped]]:
    """Return the drops of each class."""
    return [[each for each in drops if each.lying in sides] for sides in CLASSES.values()]


def _cells(texts: Iterable[str]) -> str:
    return ' '.join(f'{text:>8}' for text in texts)


def _drop(env: GetUpEnv, policy: PolicyRunner | None, limiter: StepLimiter, seed: int) -> Dropped:
    env.reset(seed=seed)
    robot = env.robot
    lying = lying_on(down_in_body(robot.base_pose.orientation))
    start = tuple(robot.joint_targets.tolist())
    stand: Targets = tuple(env.stand.tolist())
    limiter.start(start)
    if policy is not None:
        policy.reset(start)
    meter, still, over = Meter(robot, robot_urdf()), 0.0, False
    while not over:
        wanted = stand if policy is None else _answer(env, policy) or limiter.last or start
        targets = np.array(limiter.step(wanted, PERIOD), np.float32)
        *_, over, _ = env.step(targets - env.stand)
        meter.sample()
        still = still + PERIOD if _stands(env) else 0.0
    metered = meter.read()
    return Dropped(
        lying,
        still >= STILL_TIME,
        metered.torque_saturation,
        metered.speed_saturation,
    )


def _answer(env: GetUpEnv, policy: PolicyRunner) -> Targets | None:
    joints, imu = env.state.joints, env.state.imu
    if joints is None or imu is None:
        raise CheckError('a robot in physics measures joints and attitude')
    return policy.step(PolicyInputs(joints, imu, REST), PERIOD).targets


def _stands(env: GetUpEnv) -> bool:
    pose, velocity = env.robot.base_pose, env.robot.base_velocity
    return (
        pose.tilt < LEVEL
        and abs(pose.position[2] - env.nominal_height) <= MAX_HEIGHT_ERROR
        and math.hypot(*velocity.linear) <= MAX_SPEED
        and math.hypot(*velocity.angular) <= MAX_TURN_RATE
    )

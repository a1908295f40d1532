#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Success rate of the mode `get_up`, by the side on which the robot lies.

The robot is dropped with random attitude, joints and friction; its legs are held until it rests.
Few come to rest on a side, so more are dropped with each side down.

    python bench_get_up.py --drops 1000 --each 1000     # for figures that are steadier
"""

from __future__ import annotations

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
import multiprocessing
import os

import numpy as np

from quad_controller import Controller, GaitParameters, ServoModel, State, StateParameters
from quad_controller.states.get_up import Lying, lying_on
from quad_description import quadruped, robot_urdf
from quad_description.rotations import down_in_body, normalized, Quaternion
from quad_sim import parse_servo
from quad_sim.physics import PhysicsBackend, Robot, Variation

FRICTION = (0.4, 1.3)  # of the ground
DROP = (0.0, 0.15)  # [m] of the lowest point above the ground
SETTLE_TIME = 2.0  # [s]
LONGEST = 90.0  # [s] until it stands, or has given up
STAND_TIME = 1.0  # [s] for which it has to stand
MAX_TILT = 0.2  # [rad] of a robot that stands
URDF = robot_urdf()
MODEL = quadruped(URDF)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Result of one drop."""

    lay: Lying  # where it came to rest
    stood: bool  # whether it stood in the end
    time: float  # how long it took in [s]
    words: str  # what the controller answered or latched where it did not


def attitude(random: np.random.Generator, side: Lying | None) -> Quaternion:
    """Return a random attitude, or a random one with a given side down."""
    while True:
        x, y, z, w = random.standard_normal(4).tolist()
        rotation = normalized((x, y, z, w))
        if side is None or lying_on(down_in_body(rotation)) is side:
            return rotation


def fallen(seed: int, side: Lying | None, servo: str) -> PhysicsBackend:
    """Drop a robot with a random or given side down; return it at rest."""
    random = np.random.default_rng(seed)
    robot = Robot(URDF, parse_servo(servo))
    pose = tuple(random.uniform(limits.lower, limits.upper) for limits in MODEL.limits)
    robot.reset(
        pose=dict(zip(MODEL.names, pose, strict=True)),
        orientation=attitude(random, side),
        drop=random.uniform(*DROP),
        variation=Variation(friction=random.uniform(*FRICTION)),
    )
    backend = PhysicsBackend(robot)
    for _ in range(round(SETTLE_TIME / backend.period)):
        backend.step(pose)
    return backend


def get_up(
    seed: int, side: Lying | None = None, only: bool = False, servo: str = 'nominal'
) -> Outcome:
    """Drop a robot and let it get up; `only`: skip it unless it rests on that side."""
    backend = fallen(seed, side, servo)
    state = backend.observe()
    if state.imu is None:
        raise ValueError('a robot in physics measures its attitude')
    lay = lying_on(state.imu.down)
    if only and lay is not side:
        return Outcome(lay, False, 0.0, '')
    gait = GaitParameters(servo=ServoModel(kp=parse_servo(servo).stiffness))
    controller = Controller(MODEL, gait, StateParameters(get_up_swings=True))
    state = backend.step(controller.step(state, backend.period).targets)
    answer = controller.set_mode('get_up')
    begun = state.time
    while answer.accepted and state.time - begun < LONGEST:
        state = backend.step(controller.step(state, backend.period).targets)
        status = controller.status
        if status.title in {State.STAND.value, State.FAULT.value}:
            break
    time = state.time - begun
    for _ in range(round(STAND_TIME / backend.period)):
        state = backend.step(controller.step(state, backend.period).targets)
    stood = (
        controller.status.title == State.STAND.value
        and state.imu is not None
        and state.imu.tilt < MAX_TILT
    )
    return Outcome(lay, stood, time, '; '.join(controller.status.faults) or answer.message)


def report(title: str, outcomes: list[Outcome]) -> None:
    """Print success rate, duration, and the outcome of the failures."""
    stood = sorted(outcome.time for outcome in outcomes if outcome.stood)
    times = f'{stood[len(stood) // 2]:.1f} s, at most {stood[-1]:.1f} s' if stood else ''
    share = len(stood) / max(len(outcomes), 1)
    print(f'{title:28} {len(stood):4} of {len(outcomes):4}  {share:5.1%}  {times}', flush=True)
    for words, times_said in Counter(
        outcome.words for outcome in outcomes if not outcome.stood
    ).most_common(3):
        print(f'    {times_said:4} x {words}')


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--drops', type=int, default=60, help='with any attitude')
    parser.add_argument('--each', type=int, default=50, help='with each side below')
    parser.add_argument('--servo', default='nominal', help='as of fake_xgo')
    options = parser.parse_args()
    dropped_robot = partial(get_up, servo=options.servo)
    context = multiprocessing.get_context('spawn')
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), mp_context=context) as pool:
        outcomes = list(pool.map(dropped_robot, range(options.drops)))
        print(f'servos {options.servo}; dropped with any attitude, by where they came to rest')
        for side in Lying:
            report(side.value, [outcome for outcome in outcomes if outcome.lay is side])
        print('dropped with that side below, those that stayed on it')
        for side in Lying:
            lying = partial(dropped_robot, side=side, only=True)
            dropped = pool.map(lying, range(options.each))
            report(side.value, [outcome for outcome in dropped if outcome.lay is side])


if __name__ == '__main__':
    main()

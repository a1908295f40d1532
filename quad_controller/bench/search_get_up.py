#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Searches poses that turn a fallen robot onto its belly, by random search in physics.

A way is some poses in a row. On a side, legs of one side do the same; on nose and tail, legs of
one end: a pose has six numbers. Robots that were dropped and came to rest there go through it and
fold their legs; a way is as good as they are upright then, on average. Poses in which legs touch
each other or the trunk, which physics lets pass, are left out. What is found is printed as Python,
for `quad_controller/states/get_up_poses.py`.

    python search_get_up.py left --speeds 3 6 --seed 1
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from itertools import combinations
import math
import os
import time

from bench_get_up import fallen, MODEL
import mujoco
from mujoco import rollout
import numpy as np
import numpy.typing as npt

from quad_controller.states.get_up import FOLD_SPEED
from quad_controller.states.lying import Lying, lying_on
from quad_controller.states.machine import Poses
from quad_controller.states.parameters import StateParameters
from quad_description import LEGS

Array = npt.NDArray[np.float64]

POPULATION = 16  # near the best one, and as many anywhere
MANY = 200  # of which those are left that touch nothing
ROBOTS, FEW, ELITE = 10, 2, 4  # a few robots choose those that are tried on all
SPREAD = 0.12  # of the range of a joint, near the best one
HOLD_TIME = 0.6  # [s] after each pose, in which the body comes to rest
SIDES = {'left': Lying.LEFT, 'nose': Lying.NOSE, 'tail': Lying.TAIL, 'back': Lying.BACK}
LEG = MODEL.leg_indices[0]
LOWER = np.array([MODEL.limits[index].lower for index in LEG] * 2)
UPPER = np.array([MODEL.limits[index].upper for index in LEG] * 2)
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS
FAR = 0.05  # [m] a greater distance is of no interest
MAX_WAY = float(np.max(UPPER - LOWER))  # [rad]


def clearance(model: mujoco.MjModel, pose: Array) -> float:
    """Return the least distance of links of different legs, and of shanks from the trunk [m]."""
    data, points = mujoco.MjData(model), np.empty(6)
    for name, position in zip(MODEL.names, pose, strict=True):
        data.joint(name).qpos = position
    mujoco.mj_kinematics(model, data)
    links = {
        f'{leg}_{part}': int(model.body(f'{leg}_{part}').geomadr[0])
        for leg in LEGS
        for part in ('thigh', 'calf', 'foot')
    }
    trunk = int(model.body('base_link').geomadr[0])
    pairs = [
        (links[one], links[other]) for one, other in combinations(links, 2) if one[:2] != other[:2]
    ] + [(geom, trunk) for link, geom in links.items() if not link.endswith('thigh')]
    return min(float(mujoco.mj_geomDistance(model, data, *pair, FAR, points)) for pair in pairs)


class Fallen:
    """Robots that lie on a side, each with its ground, to go on from again and again."""

    def __init__(self, side: Lying, count: int) -> None:
        """Drop robots until enough of them came to rest there."""
        self.models: list[mujoco.MjModel] = []
        self.states: list[Array] = []
        self.targets: list[Array] = []
        seed = 10_000
        while len(self.models) < count:
            backend = fallen(seed, side)
            imu, robot = backend.observe().imu, backend.robot
            seed += 1
            if imu is None or lying_on(imu.down) is not side:
                continue
            model, data = robot._model, robot._data  # noqa: SLF001  # to go back to it, quickly
            state = np.zeros(mujoco.mj_stateSize(model, STATE))
            mujoco.mj_getState(model, data, state, STATE)
            self.models.append(model)
            self.states.append(state)
            self.targets.append(robot.joint_targets)
        self._workers = [
            mujoco.MjData(self.models[0]) for _ in range(len(os.sched_getaffinity(0)))
        ]
        folded = Poses(MODEL, StateParameters().lie_height, ()).lying((0.0,) * len(MODEL.names))
        self._folded = np.array(folded)

    def are_clear(self, poses: Array) -> bool:
        """Return whether legs touch neither each other nor the trunk in some poses."""
        return all(clearance(self.models[0], pose) > 0.0 for pose in poses)

    def upright(self, ways: Array, speeds: Sequence[float], robots: Sequence[int]) -> Array:
        """Return how upright each robot is after each way and folding, -1 to 1.

        Args:
            ways: Targets of all joints for each stage of each way.
            speeds: Of the stages [rad/s].
            robots: Which ones.
        """
        pairs = [(way, robot) for way in ways for robot in robots]
        ends = [[*way, self._folded] for way, _ in pairs]
        starts = np.array([self.targets[robot] for _, robot in pairs])
        timestep = float(self.models[0].opt.timestep)
        control = _controls(starts, np.array(ends), [*speeds, FOLD_SPEED], timestep)
        states, _ = rollout.rollout(
            [self.models[robot] for _, robot in pairs],
            self._workers,
            initial_state=np.array([self.states[robot] for _, robot in pairs]),
            control=control,
        )
        x, y = states[:, -100:, 5], states[:, -100:, 6]  # behind time, position and w
        up: Array = (1.0 - 2.0 * (x * x + y * y)).mean(axis=1)
        return up.reshape(len(ways), len(robots))


def _controls(starts: Array, ends: Array, speeds: Sequence[float], timestep: float) -> Array:
    """Return the targets of each time step: cosines as those of a Blend, and rests."""
    parts, before = [], starts
    for stage, speed in enumerate(speeds):
        after = ends[:, stage]
        ways = np.abs(after - before).max(axis=1)
        count = round((MAX_WAY * math.pi / 2 / speed + HOLD_TIME) / timestep)
        times = timestep * np.arange(1, count + 1)
        lasts = np.maximum(ways * math.pi / 2 / speed, timestep)
        share = np.minimum(times[None, :] / lasts[:, None], 1.0)
        share = 0.5 * (1.0 - np.cos(math.pi * share))[:, :, None]
        parts.append(before[:, None] + share * (after - before)[:, None])
        before = after
    return np.concatenate(parts, axis=1)


def poses_of(numbers: Array, side: Lying) -> Array:
    """Return targets of all joints for the stages of a way; the numbers are 0 to 1 of ranges."""
    poses = np.round(LOWER + numbers.reshape(-1, 6) * (UPPER - LOWER), 2)
    one, other = poses[:, :3], poses[:, 3:]
    legs = (one, one, other, other) if side in {Lying.NOSE, Lying.TAIL} else (one, other) * 2
    return np.concatenate(legs, axis=1)


def search(side: Lying, speeds: Sequence[float], rounds: int, seed: int) -> Array:
    """Return the best way that was found."""
    random, robots = np.random.default_rng(seed), Fallen(side, ROBOTS)
    best, best_score, begun = np.full(6 * len(speeds), 0.5), -math.inf, time.monotonic()
    for _ in range(rounds):
        near = random.normal(best, SPREAD, (MANY, best.size)).clip(0.0, 1.0)
        clear = [each for each in near if robots.are_clear(poses_of(each, side))][:POPULATION]
        far = random.random((MANY, best.size))
        clear += [each for each in far if robots.are_clear(poses_of(each, side))][:POPULATION]
        drawn = np.array(clear)
        ways = np.array([poses_of(each, side) for each in drawn])
        few = random.choice(ROBOTS, FEW, replace=False).tolist()
        elite = np.argsort(robots.upright(ways, speeds, few).mean(axis=1))[-ELITE:]
        scores = robots.upright(ways[elite], speeds, range(ROBOTS))
        first = int(np.argmax(scores.mean(axis=1)))
        if scores[first].mean() > best_score:
            best, best_score = drawn[elite[first]], float(scores[first].mean())
            print(f'{time.monotonic() - begun:4.0f} s: {np.round(scores[first], 2).tolist()}')
            print(python_of(poses_of(best, side), speeds), flush=True)
    return poses_of(best, side)


def python_of(way: Array, speeds: Sequence[float]) -> str:
    """Return a way as it stands in the module of the poses."""
    lines = []
    for pose, speed in zip(way, speeds, strict=True):
        legs = ', '.join(str(tuple(leg)) for leg in pose.reshape(-1, 3).tolist())
        lines.append(f'    Stage(({legs}), {speed}),')
    return '\n'.join(lines)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('side', choices=SIDES)
    parser.add_argument('--speeds', type=float, nargs='+', default=[3.0, 6.0], help='[rad/s]')
    parser.add_argument('--rounds', type=int, default=12)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    way = search(SIDES[options.side], options.speeds, options.rounds, options.seed)
    print(f'the best one:\n{python_of(way, options.speeds)}')


if __name__ == '__main__':
    main()

#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Searches poses that turn a fallen robot onto its belly, by the cross-entropy method in physics.

A way is some poses in a row, and swings behind the first ones: poses that joints go to as fast as
they can, each for a time, without rest between. On a side, legs of one side do the same; else,
legs of one end: a pose has six numbers, a swing seven. Robots that were dropped and came to rest
there go through it; a way is as good as they are upright in the end and were at best, on average,
less what links come too near to each other, which physics lets pass. What is found is printed as
Python, for `quad_controller/states/get_up_poses.py`.

    python search_get_up.py left --speeds 3 3 --rounds 20
    python search_get_up.py back --speeds 3 --swings 4 --rounds 60 --cost 0  # touching legs first
    python search_get_up.py back --speeds 3 --swings 4 --refine  # what the module has
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
import math
import os
import time

from bench_get_up import fallen, MODEL
import mujoco
from mujoco import rollout
import numpy as np
import numpy.typing as npt

from quad_controller.states.get_up_poses import RECOVERIES, Recovery
from quad_controller.states.lying import Lying, lying_on
from quad_description import LEGS

Array = npt.NDArray[np.float64]

POPULATION, ELITE = 250, 24  # ways in a round, and those that the next one is drawn around
ROBOTS, FEW = 10, 3  # one robot chooses, a few where a way is refined; all judge
KEEP = 0.3  # share of mean and spread that stays in a round
SPREAD, NEAR_SPREAD, LEAST_SPREAD = 0.4, 0.06, 0.015  # of the range of a joint
HOLD_TIME = 0.6  # [s] after each pose, in which the body comes to rest
SWING_SPEED = 10.0  # [rad/s]
SWING_TIMES = (0.02, 0.42)  # [s]
PERIOD = 0.02  # [s] between two targets
CLEARANCE = 0.004  # [m]
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


@dataclass(frozen=True, slots=True)
class Form:
    """What ways are searched.

    Attributes:
        side: On which side the robot lies.
        speeds: Of the poses at the beginning [rad/s]; the body comes to rest after each.
        swings: How many swings follow.
    """

    side: Lying
    speeds: Sequence[float]
    swings: int

    @property
    def size(self) -> int:
        """How many numbers a way has."""
        return 6 * (len(self.speeds) + self.swings) + self.swings

    def numbers(self, recovery: Recovery) -> Array:
        """Return the numbers of a way that is known."""
        least, most = SWING_TIMES
        swings = recovery[len(self.speeds) :]
        times = [stage.duration or most for stage in swings]
        one, other = (0, 1) if self.is_on_side else (0, 2)
        legs = np.array([[*stage.legs[one], *stage.legs[other]] for stage in recovery])
        return np.concatenate(
            [
                (np.array(times) - least) / (most - least),
                ((legs - LOWER) / (UPPER - LOWER)).ravel(),
            ]
        ).clip(0.0, 1.0)

    @property
    def is_on_side(self) -> bool:
        """Whether legs of one side do the same, and not those of one end."""
        return self.side in {Lying.LEFT, Lying.RIGHT}

    def poses(self, numbers: Array) -> Array:
        """Return targets of all joints for each pose; the numbers are 0 to 1 of ranges."""
        parts = numbers[self.swings :].reshape(-1, 6)
        poses = np.round(LOWER + parts * (UPPER - LOWER), 2)
        one, other = poses[:, :3], poses[:, 3:]
        legs = (one, other) * 2 if self.is_on_side else (one, one, other, other)
        return np.concatenate(legs, axis=1)

    def durations(self, numbers: Array) -> Array:
        """Return how long each swing takes [s], in whole periods."""
        least, most = SWING_TIMES
        times: Array = least + numbers[: self.swings] * (most - least)
        return np.round(times / PERIOD) * PERIOD

    def targets(self, start: Array, numbers: Array) -> Array:
        """Return what a robot is sent, period after period, from its targets at the start."""
        rows, poses = [start], self.poses(numbers)
        for pose, speed in zip(poses, self.speeds, strict=False):  # as a Blend
            begin = rows[-1]
            duration = max(float(np.abs(pose - begin).max()) * math.pi / 2 / speed, PERIOD)
            for step in range(1, round((MAX_WAY * math.pi / 2 / speed + HOLD_TIME) / PERIOD)):
                share = 0.5 * (1.0 - math.cos(math.pi * min(step * PERIOD / duration, 1.0)))
                rows.append(begin + share * (pose - begin))
        most = SWING_SPEED * PERIOD
        swings = poses[len(self.speeds) :]
        for pose, duration in zip(swings, self.durations(numbers), strict=True):  # as a Swing
            for _ in range(round(duration / PERIOD)):
                rows.append(rows[-1] + np.clip(pose - rows[-1], -most, most))
        for _ in range(round((self.swings * SWING_TIMES[1] + 2 * HOLD_TIME) / PERIOD)):
            rows.append(rows[-1] + np.clip(poses[-1] - rows[-1], -most, most))
        return np.array(rows)

    def python_of(self, numbers: Array) -> str:
        """Return a way as it stands in the module of the poses."""
        swing = f'{SWING_SPEED}, '
        ends = [
            *map(str, self.speeds),
            *(f'{swing}{duration:.2f}' for duration in self.durations(numbers)[:-1]),
            *([f'{SWING_SPEED}'] if self.swings else []),  # comes to rest
        ]
        return '\n'.join(
            f'    Stage(({", ".join(str(tuple(leg)) for leg in legs)}), {end}),'
            for legs, end in zip(self.poses(numbers).reshape(-1, 4, 3).tolist(), ends, strict=True)
        )


class Fallen:
    """Robots that lie on a side, each with its ground, to go on from again and again."""

    def __init__(self, form: Form, count: int) -> None:
        """Drop robots until enough of them came to rest there."""
        self._form = form
        self.models: list[mujoco.MjModel] = []
        self.states: list[Array] = []
        self.targets: list[Array] = []
        seed = 10_000
        while len(self.models) < count:
            backend = fallen(seed, form.side)
            imu, robot = backend.observe().imu, backend.robot
            seed += 1
            if imu is None or lying_on(imu.down) is not form.side:
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

    def trajectories(self, ways: Array, robots: Sequence[int]) -> Array:
        """Return the state of each robot on each way, time step after time step."""
        pairs = [(way, robot) for way in ways for robot in robots]
        rows = [self._form.targets(self.targets[robot], way) for way, robot in pairs]
        longest = max(map(len, rows))
        sent = np.array([np.pad(row, ((0, longest - len(row)), (0, 0)), 'edge') for row in rows])
        steps = round(PERIOD / float(self.models[0].opt.timestep))
        share = (np.arange(1, steps + 1) / steps)[:, None]
        control = sent[:, :-1, None] + share * np.diff(sent, axis=1)[:, :, None]
        states, _ = rollout.rollout(
            [self.models[robot] for _, robot in pairs],
            self._workers,
            initial_state=np.array([self.states[robot] for _, robot in pairs]),
            control=control.reshape(len(pairs), -1, sent.shape[2]),
        )
        return np.asarray(states).reshape(len(ways), len(robots), *states.shape[1:])

    def nearest(self, states: Array) -> float:
        """Return the least clearance on a trajectory [m], behind the way to the first pose."""
        first = round(MAX_WAY * math.pi / 2 / self._form.speeds[0] / PERIOD)
        joints = slice(8, 8 + len(MODEL.names))  # behind time, position and orientation
        return min(clearance(self.models[0], state[joints]) for state in states[10 * first :: 20])


def upright(states: Array) -> Array:
    """Return how upright a robot is, from -1 on its back to 1, in each state."""
    x, y = states[..., 5], states[..., 6]  # behind time, position and w
    return np.asarray(1.0 - 2.0 * (x * x + y * y))


def search(form: Form, rounds: int, seed: int, cost: float, near: Recovery | None = None) -> None:
    """Print the mean of the ways that were drawn last, again and again.

    Args:
        form: Of the ways.
        rounds: How many.
        seed: Of everything random.
        cost: Of links that come nearer to each other than they may, per [m].
        near: A way to begin at; None for anywhere.
    """
    random, robots = np.random.default_rng(seed), Fallen(form, ROBOTS)
    mean = np.full(form.size, 0.5) if near is None else form.numbers(near)
    spread = np.full(form.size, SPREAD if near is None else NEAR_SPREAD)
    begun = time.monotonic()
    for number in range(rounds):
        ways = random.normal(mean, spread, (POPULATION, form.size)).clip(0.0, 1.0)
        few = random.choice(ROBOTS, FEW if near else 1, replace=False).tolist()
        trajectories = robots.trajectories(ways, few)
        up = upright(trajectories)
        scores = up[..., -100:].mean(axis=(1, 2)) + 1.5 * up[..., 300:].max(axis=2).mean(axis=1)
        best = np.argsort(scores)[: -3 * ELITE - 1 : -1]
        for way in best:
            least = robots.nearest(trajectories[way, 0]) if cost else CLEARANCE
            scores[way] -= cost * max(CLEARANCE - least, 0.0)
        elite = ways[best[np.argsort(scores[best])[: -ELITE - 1 : -1]]]
        mean = KEEP * mean + (1.0 - KEEP) * elite.mean(axis=0)
        spread = KEEP * spread + (1.0 - KEEP) * elite.std(axis=0)
        spread = np.maximum(spread, LEAST_SPREAD)
        if number % 5 == 4 or number == rounds - 1:
            ends = upright(robots.trajectories(mean[None], range(ROBOTS)))[0]
            print(
                f'{time.monotonic() - begun:4.0f} s, {(number + 1) * POPULATION * len(few)} tries:'
            )
            print(f'  at the end {np.round(ends[:, -100:].mean(axis=1), 2).tolist()}')
            print(f'  at best    {np.round(ends[:, 300:].max(axis=1), 2).tolist()}')
            print(form.python_of(mean), flush=True)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('side', choices=SIDES)
    parser.add_argument('--speeds', type=float, nargs='+', default=[3.0, 6.0], help='[rad/s]')
    parser.add_argument('--swings', type=int, default=0, help='that follow')
    parser.add_argument('--refine', action='store_true', help='begin at what is known')
    parser.add_argument('--cost', type=float, default=100.0, help='of links too near, per [m]')
    parser.add_argument('--rounds', type=int, default=30)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    form = Form(SIDES[options.side], options.speeds, options.swings)
    near = RECOVERIES[form.side][0] if options.refine else None
    search(form, options.rounds, options.seed, options.cost, near)


if __name__ == '__main__':
    main()

#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Steps per second of the Gymnasium environment, single and spread over the cores.

The physics alone, measured in the same run, is the upper bound.
"""

from __future__ import annotations

import os
from time import perf_counter

import gymnasium
import mujoco
import numpy as np

from quad_sim.env import ID, Randomization, WalkingEnv
from quad_sim.physics.robot import TIMESTEP

STEPS = 2000
PER_CORE = 8
"""Environments at once for each core."""
MODES = {'async': 'a process each', 'vector_entry_point': 'a process a core'}


def actions(env: WalkingEnv) -> list[np.ndarray]:
    """Return actions that move all joints."""
    phase = np.arange(len(env.stand))
    return [(0.1 * np.sin(0.4 * n + phase)).astype(np.float32) for n in range(100)]


def report(title: str, steps: int, seconds: float) -> None:
    """Print a figure."""
    print(f'{title:44} {steps / seconds:8.0f} steps/s')


def main() -> None:
    """Entry point."""
    env = WalkingEnv(randomization=Randomization())
    targets = actions(env)
    model = mujoco.MjModel.from_xml_string(env.robot.mjcf(floor=True))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    substeps = round(env.period / TIMESTEP)
    begin = perf_counter()
    for step in range(STEPS):
        data.ctrl[:] = env.stand + targets[step % 100]
        mujoco.mj_step(model, data, substeps)
    report('physics alone, one core', STEPS, perf_counter() - begin)

    env.reset(seed=1)
    begin = perf_counter()
    for step in range(STEPS):
        _, _, fallen, over, _ = env.step(targets[step % 100])
        if fallen or over:
            env.reset()
    report('environment, one core', STEPS, perf_counter() - begin)

    cores = len(os.sched_getaffinity(0))
    count = PER_CORE * cores
    rounds = STEPS // PER_CORE
    batches = [np.tile(each, (count, 1)) for each in targets]
    for mode, title in MODES.items():
        envs = gymnasium.make_vec(
            ID, num_envs=count, vectorization_mode=mode, randomization=Randomization()
        )
        envs.reset(seed=1)
        begin = perf_counter()
        for step in range(rounds):
            envs.step(batches[step % 100])
        seconds = perf_counter() - begin
        report(f'{count} of them over {cores} cores, {title}', rounds * count, seconds)
        envs.close()


if __name__ == '__main__':
    main()

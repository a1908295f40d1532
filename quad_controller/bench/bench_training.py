#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CPU time of a training step: plant, servos, protocol bytes, estimator, rough ground.

Learning is not included; `make train` prints the steps per second with it.
"""

from __future__ import annotations

import os
from pathlib import Path
import sys
from time import process_time

import numpy as np

from quad_controller import find_policy
from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.network import OnnxNetwork

sys.path.append(str(Path(__file__).parents[1] / 'training'))
from contract_env import contract_of, PLANT, walking_env

STEPS, ROUNDS = 1000, 5
DEVIATION = 0.18  # of the actions that a training tries


def main() -> None:
    """Entry point."""
    path = find_policy('trot_ppo')
    network = OnnxNetwork(path)
    env = walking_env(build_contract(contract_of(path, 'bench')), PLANT)
    random = np.random.default_rng(1)
    seen, _ = env.reset(seed=1)
    times = []
    for _ in range(STEPS * ROUNDS):
        action = network.run(seen[np.newaxis])[0] + DEVIATION * random.standard_normal(12)
        begin = process_time()
        seen, _, fallen, over, _ = env.step(action)
        if fallen or over:
            seen, _ = env.reset()
        times.append(process_time() - begin)
    rounds = np.reshape(times, (ROUNDS, STEPS)).mean(axis=1)
    least, most, cores = rounds.min(), rounds.max(), len(os.sched_getaffinity(0))
    print(f'{1e6 * least:.0f} to {1e6 * most:.0f} us of a core for a step, without the learning:')
    print(f'{cores / most:.0f} to {cores / least:.0f} steps/s of {cores} cores')


if __name__ == '__main__':
    main()

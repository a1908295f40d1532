# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A whole training: a policy that walks already is practised on the plant by PPO."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from pathlib import Path

from contract_env import contract_of, PERIOD, PLANT, walking_env
from networks import Actor, explore, layers_of, learned_in
from policy_export import export
from practice import Practice
from progress import Progress
import skrl

from quad_controller.policy.contract.mjlab import CONTRACT_KEY
from quad_controller.policy.contract.model import build_contract
from quad_sim.env import ProcessVectorEnv

DEVIATION = 0.18  # of the actions that are tried when practice begins: 0.05 rad


def train(start: Path, target: Path, progress: Progress, *, seed: int, environments: int) -> None:
    """Train until the time is over.

    Args:
        start: ONNX file of the policy that practice begins with.
        target: ONNX file to write.
        progress: Has the time, and shows how it goes.

    Raises:
        PolicyError: The layers of the start cannot be trained.
    """
    skrl.config.jax.device = 'cpu'
    skrl.config.jax.key = seed
    skrl.logger.setLevel('WARNING')
    document = contract_of(start, f'PPO from {start.stem} (quad_sim/Walk-v0, 1 to 12 N m/rad)')
    make = partial(walking_env, build_contract(document), PLANT)
    with closing(ProcessVectorEnv(make, environments)) as envs:
        actor = Actor(envs.single_observation_space, envs.single_action_space)
        actor.init_state_dict(role='policy')
        normaliser = learned_in(start, actor)
        explore(actor, DEVIATION)
        practice = Practice(
            actor,
            normaliser,
            envs,
            PLANT,
            period=PERIOD,
            curves=target.parent / 'curves',
            seed=seed,
        )
        for practised in practice.until(lambda: progress.share):
            progress.figures(practised)
        practice.close()
    export(layers_of(actor, normaliser), target, {CONTRACT_KEY: document.to_yaml()})

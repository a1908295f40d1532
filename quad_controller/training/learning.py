# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A whole training: imitation of a teacher, then practice; writes both policies."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from pathlib import Path

from contract_env import (
    metadata_of,
    PERIOD,
    taught_walking_env,
    Values,
    walking_contract,
    walking_env,
)
from imitation import Imitation
import jax
from networks import Actor, answer, explore, layers_of, Normaliser
import numpy as np
from policy_export import export
from practice import Practice
from progress import Progress
import skrl

from quad_controller.policy.observation import ObservationStatistics, STATISTICS_KEY
from quad_description import quadruped, robot_urdf
from quad_sim.env import ProcessVectorEnv, Randomization

OBSERVED_STEPS = 500  # of each environment, for the ranges that replay_policy compares with
IMITATION, PRACTICE = 'imitation', 'practice'


RANDOMIZATION = Randomization(
    friction=(0.35, 1.3), trunk_mass=(0.9, 1.3), kick=(-1.6, 1.6), kick_interval=2.0
)
"""What differs in the end; half of it while the teacher is imitated."""
DEVIATION = 0.18  # of the actions that are tried when practice begins: 0.05 rad
IMITATED = 'imitation of the trot (DAgger in quad_sim/Walk-v0, firm servos)'
PRACTISED = 'imitation of the trot, then PPO (quad_sim/Walk-v0, firm servos)'


def train(
    folder: Path, progress: Progress, *, seed: int, environments: int, rounds: int
) -> dict[str, Path]:
    """Train until the time is over.

    Args:
        progress: Has the time, and shows how it goes.

    Returns:
        The policies: what was imitated, and what practice made of it.
    """
    skrl.config.jax.device = 'cpu'
    skrl.config.jax.key = seed
    skrl.logger.setLevel('WARNING')
    robot = quadruped(robot_urdf())
    example = walking_env(RANDOMIZATION)
    actor = Actor(example.observation_space, example.action_space)
    actor.init_state_dict(role='policy')
    policies = {name: folder / f'{name}.onnx' for name in (IMITATION, PRACTICE)}
    with closing(
        ProcessVectorEnv(partial(taught_walking_env, RANDOMIZATION.scaled(0.5)), environments)
    ) as envs:
        scale = example.contract.action.scale[0]
        imitation = Imitation(actor, envs, rounds, scale=scale, seed=seed)
        for each in imitation.rounds():
            progress.say(f'imitation, {each}, {progress.minutes:.1f} min')
    normaliser = imitation.normaliser
    if normaliser is None:
        raise ValueError('an imitation has one round at least')
    imitated = walking_contract(robot, IMITATED)
    _write(policies[IMITATION], actor, normaliser, imitation.observed, imitated)
    with closing(ProcessVectorEnv(partial(walking_env, RANDOMIZATION), environments)) as envs:
        explore(actor, DEVIATION)
        practice = Practice(
            actor,
            normaliser,
            envs,
            RANDOMIZATION,
            period=PERIOD,
            curves=folder / 'curves',
            seed=seed,
        )
        before = progress.share
        for practised in practice.until(
            lambda: (progress.share - before) / max(1.0 - before, 1e-6)
        ):
            progress.figures(practised)
        practice.close()
        observed = _observe(actor, normaliser, envs, seed)
    _write(policies[PRACTICE], actor, normaliser, observed, walking_contract(robot, PRACTISED))
    return policies


def _observe(
    actor: Actor, normaliser: Normaliser, envs: ProcessVectorEnv, seed: int
) -> ObservationStatistics:
    """Return what a policy observes where it has practised, with all that differs there."""
    act = jax.jit(partial(answer, actor))
    seen, _ = envs.reset(seed=seed)
    rows = []
    for _ in range(OBSERVED_STEPS):
        rows.append(seen)
        seen = envs.step(np.asarray(act(actor.state_dict.params, normaliser(seen))))[0]
    return ObservationStatistics.of(np.concatenate(rows))


def _write(
    path: Path,
    actor: Actor,
    normaliser: Normaliser,
    observed: ObservationStatistics,
    contract: Values,
) -> None:
    statistics = {STATISTICS_KEY: observed.to_json()}
    export(layers_of(actor, normaliser), path, metadata_of(contract) | statistics)

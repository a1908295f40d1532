# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A whole training: imitation of the gait, then practice; writes both policies."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from contract_env import IMITATED, practice_env, PRACTISED, taught_env, values_for
from imitation import Imitation, Lessons
import jax
from networks import Actor, answer, layers_of, Normaliser
import numpy as np
from policy_export import export
from practice import Practice
from progress import Progress
import skrl
from trained_contract import metadata_of, PERIOD

from quad_controller.policy.statistics import ObservationStatistics, STATISTICS_KEY
from quad_description import quadruped, robot_urdf
from quad_sim.env import ProcessVectorEnv, Randomization

RANDOMIZATION = Randomization(
    friction=(0.35, 1.3), trunk_mass=(0.9, 1.3), kick=(-1.6, 1.6), kick_interval=2.0
)
"""What differs in the end."""
OBSERVED_STEPS = 500  # of each environment, for the ranges that replay_policy compares with


@dataclass(frozen=True, slots=True)
class Plan:
    """How a training is done.

    Attributes:
        seed: Of everything that is drawn.
        environments: How many at once.
        lessons: Of the imitation.
    """

    seed: int = 1
    environments: int = 64
    lessons: Lessons = field(default_factory=Lessons)


def train(folder: Path, plan: Plan, progress: Progress) -> dict[str, Path]:
    """Train until the time is over.

    Args:
        folder: For policies and curves.
        plan: How.
        progress: Has the time, and shows how it goes.

    Returns:
        The policies: what was imitated, and what practice made of it.
    """
    skrl.config.jax.device = 'cpu'
    skrl.config.jax.key = plan.seed
    skrl.logger.setLevel('WARNING')
    actor, normaliser, observed = _imitate(plan, progress)
    imitated = _write(actor, normaliser, observed, folder / 'imitation.onnx', IMITATED)
    envs = ProcessVectorEnv(partial(practice_env, RANDOMIZATION), plan.environments)
    try:
        practice = Practice(
            actor,
            normaliser,
            envs,
            RANDOMIZATION,
            period=PERIOD,
            curves=folder / 'curves',
            seed=plan.seed,
        )
        before = progress.share
        for each in practice.until(lambda: (progress.share - before) / max(1.0 - before, 1e-6)):
            progress.figures(
                f'reward {each.reward:5.2f}/s  falls {each.falls:5.2f}/min  '
                f'{each.steps / 1e6:.2f} M steps  randomized {each.share:.0%}'
            )
        practice.close()
        observed = _observe(actor, normaliser, envs, plan.seed)
    finally:
        envs.close()
    practised = _write(actor, normaliser, observed, folder / 'practice.onnx', PRACTISED)
    return {'imitation': imitated, 'practice': practised}


def _imitate(plan: Plan, progress: Progress) -> tuple[Actor, Normaliser, ObservationStatistics]:
    ranges = RANDOMIZATION.scaled(0.5)
    envs = ProcessVectorEnv(partial(taught_env, ranges), plan.environments)
    try:
        example = practice_env(ranges)
        actor = Actor(example.observation_space, example.action_space)
        actor.init_state_dict(role='policy')
        imitation = Imitation(actor, envs, plan.lessons, plan.seed)
        for each in imitation.rounds():
            progress.say(
                f'imitation, round {each.number}: {each.examples} examples, '
                f'error {each.error:.4f} rad, {each.falls} falls, {progress.minutes:.1f} min'
            )
        if imitation.normaliser is None:
            raise ValueError('an imitation has one round at least')
        return actor, imitation.normaliser, imitation.observed
    finally:
        envs.close()


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
    actor: Actor,
    normaliser: Normaliser,
    observed: ObservationStatistics,
    path: Path,
    kind: str,
) -> Path:
    metadata = metadata_of(values_for(quadruped(robot_urdf()), kind))
    export(layers_of(actor, normaliser), path, {**metadata, STATISTICS_KEY: observed.to_json()})
    return path

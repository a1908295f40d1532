# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A whole training: imitation of a teacher, then practice; writes both policies."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from imitation import Imitation, Lessons
import jax
from networks import Actor, answer, explore, layers_of, Normaliser
import numpy as np
from policy_export import export
from practice import Practice, Practised
from progress import Progress
import skrl
from tasks import Task
from trained_contract import metadata_of, PERIOD, Values

from quad_controller.policy.statistics import ObservationStatistics, STATISTICS_KEY
from quad_description import quadruped, robot_urdf
from quad_sim.env import ProcessVectorEnv

OBSERVED_STEPS = 500  # of each environment, for the ranges that replay_policy compares with
IMITATION, PRACTICE = 'imitation', 'practice'


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


def train(folder: Path, task: Task, plan: Plan, progress: Progress) -> dict[str, Path]:
    """Train until the time is over.

    Args:
        folder: For policies and curves.
        task: What is learned.
        plan: How.
        progress: Has the time, and shows how it goes.

    Returns:
        The policies: what was imitated, and what practice made of it.
    """
    skrl.config.jax.device = 'cpu'
    skrl.config.jax.key = plan.seed
    skrl.logger.setLevel('WARNING')
    robot = quadruped(robot_urdf())
    example = task.make(task.randomization)
    actor = Actor(example.observation_space, example.action_space)
    actor.init_state_dict(role='policy')
    scale = example.contract.action.scale[0]
    policies = {name: folder / f'{name}.onnx' for name in (IMITATION, PRACTICE)}
    normaliser, observed = _imitate(actor, task, plan, progress, scale)
    imitated = task.contract(robot, task.teaching.kind)
    _write(policies[IMITATION], actor, normaliser, observed, imitated)
    envs = ProcessVectorEnv(partial(task.make, task.randomization), plan.environments)
    try:
        explore(actor, task.deviation)
        practice = Practice(
            actor,
            normaliser,
            envs,
            task.randomization,
            period=PERIOD,
            curves=folder / 'curves',
            seed=plan.seed,
        )
        before = progress.share
        for each in practice.until(lambda: (progress.share - before) / max(1.0 - before, 1e-6)):
            progress.figures(_text_of(each, task))
        practice.close()
        observed = _observe(actor, normaliser, envs, plan.seed)
    finally:
        envs.close()
    practised = task.contract(robot, task.kind)
    _write(policies[PRACTICE], actor, normaliser, observed, practised)
    return policies


def _imitate(
    actor: Actor, task: Task, plan: Plan, progress: Progress, scale: float
) -> tuple[Normaliser, ObservationStatistics]:
    ranges = task.randomization.scaled(0.5)
    envs = ProcessVectorEnv(partial(task.teaching.make, ranges), plan.environments)
    try:
        imitation = Imitation(actor, envs, plan.lessons, scale=scale, seed=plan.seed)
        for each in imitation.rounds():
            progress.say(
                f'imitation, round {each.number}: {each.examples} examples, '
                f'error {each.error:.4f} rad, {each.falls} falls, {progress.minutes:.1f} min'
            )
        if imitation.normaliser is None:
            raise ValueError('an imitation has one round at least')
        return imitation.normaliser, imitation.observed
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


def _text_of(practised: Practised, task: Task) -> str:
    """Return what came of an update, for people."""
    falls = f'falls {practised.falls:5.2f}/min  ' if task.ends_with_a_fall else ''
    return (
        f'reward {practised.reward:5.2f}/s  {falls}'
        f'{practised.steps / 1e6:.2f} M steps  randomized {practised.share:.0%}'
    )


def _write(
    path: Path,
    actor: Actor,
    normaliser: Normaliser,
    observed: ObservationStatistics,
    contract: Values,
) -> None:
    statistics = {STATISTICS_KEY: observed.to_json()}
    export(layers_of(actor, normaliser), path, metadata_of(contract) | statistics)

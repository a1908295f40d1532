# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PPO training with increasing randomization of robot and ground."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

from contract_env import contract_of, PERIOD, PLANT, walking_env
from networks import Actor, check_terms, explore, Judge, layers_of, learned_in, Normaliser
import numpy as np
import numpy.typing as npt
from policy_export import export
from progress import Progress
import skrl
from skrl.agents.jax.ppo import PPO, PPO_CFG
from skrl.envs.wrappers.jax import wrap_env
from skrl.memories.jax import RandomMemory
from skrl.resources.preprocessors.jax import RunningStandardScaler
from skrl.resources.schedulers.jax import KLAdaptiveLR

from quad_controller.policy.contract.build import build_contract
from quad_controller.policy.contract.mjlab import CONTRACT_KEY
from quad_sim.env import ProcessVectorEnv, Randomization

ROLLOUT = 128  # steps of each environment between two updates
JUDGE_ALONE = 8  # updates at the beginning that change the judge only
FULL_AT = 0.5  # of the time: then the randomization is whole
SHARE_STEP = 0.1  # the randomization grows by
RATE = 3e-4
STEPS_UNKNOWN = 1_000_000_000  # skrl wants to know how many; here the clock ends it


class Rollouts(RandomMemory):  # type: ignore[misc]
    """Samples mini-batches with NumPy: indexing in JAX costs as much as the learning."""

    def sample_by_index(
        self, names: list[str], *, indexes: npt.NDArray[np.intp], mini_batches: int = 1
    ) -> list[list[Any]]:
        """Return the named tensors at these rows, split into mini-batches."""
        there = self.get_tensor_names()
        whole = [np.asarray(self.get_tensor_by_name(n)) if n in there else None for n in names]
        rows = [None if each is None else each.reshape(-1, each.shape[-1]) for each in whole]
        parts = np.array_split(indexes, mini_batches)
        return [[None if each is None else each[part] for each in rows] for part in parts]


class Practice:
    """Continues to train a policy that already walks."""

    def __init__(
        self,
        actor: Actor,
        normaliser: Normaliser,
        envs: ProcessVectorEnv,
        randomization: Randomization,
        *,
        period: float,
        curves: Path,
        seed: int,
        share: float,
    ) -> None:
        """Set up the trainer.

        Args:
            curves: Folder for the files that TensorBoard reads.
            share: Initial share of the randomization.
        """
        self._first = share
        self._envs, self._wrapped = envs, wrap_env(envs, wrapper='gymnasium', verbose=False)
        self._randomization, self._period, self._actor = randomization, period, actor
        observations, actions = envs.single_observation_space, envs.single_action_space
        judge = Judge(observations, actions)
        judge.init_state_dict(role='value')
        self._agent = PPO(
            models={'policy': actor, 'value': judge},
            memory=Rollouts(memory_size=ROLLOUT, num_envs=envs.num_envs),
            observation_space=observations,
            action_space=actions,
            cfg=_settings(normaliser, curves),
        )
        self._agent.init()
        self._agent.enable_training_mode(True)
        self._updates, self._step, self._share, self._begun = 0, 0, -1.0, monotonic()
        self._envs.reset(seed=seed)
        self._observed, _ = self._wrapped.reset()

    def until(self, progress: Callable[[], float]) -> Iterator[str]:
        """Train until progress is 1 (at least one update); yield the figures of each update."""
        passed = 0.0
        while passed < 1.0:
            self._vary(passed)
            before = self._actor.state_dict
            came = self._rollout()
            self._updates += 1
            if self._updates <= JUDGE_ALONE:
                # a judge that knows nothing yet would spoil what has been learned
                self._actor.state_dict = before
            yield came
            passed = progress()

    def close(self) -> None:
        """Flush and close the TensorBoard files."""
        self._agent.writer.close()

    def _vary(self, passed: float) -> None:
        share = min(self._first + (1.0 - self._first) * passed / FULL_AT, 1.0)
        share = min(round(share / SHARE_STEP) * SHARE_STEP, 1.0)
        if share != self._share:
            self._share = share
            self._envs.call('vary', self._randomization.scaled(share))

    def _rollout(self) -> str:
        agent, envs = self._agent, self._wrapped
        rewards, falls = 0.0, 0
        ended: list[Mapping[str, float]] = []
        for _ in range(ROLLOUT):
            step = {'timestep': self._step, 'timesteps': STEPS_UNKNOWN}
            agent.pre_interaction(**step)
            actions, _ = agent.act(self._observed, None, **step)
            seen, reward, fallen, over, infos = envs.step(actions)
            agent.record_transition(
                observations=self._observed,
                states=None,
                actions=actions,
                rewards=reward,
                next_observations=seen,
                next_states=None,
                terminated=fallen,
                truncated=over,
                infos=infos,
                **step,
            )
            self._observed = seen
            rewards += float(reward.mean())
            falls += int(fallen.sum())
            ended += _terms(infos)
            self._step += 1
            agent.post_interaction(**step)
        time = ROLLOUT * self._period
        per_second, per_minute = rewards / time, 60.0 * falls / (time * self._envs.num_envs)
        track = self._agent.track_data
        track('Practice / Reward of a second', per_second)
        track('Practice / Falls in a minute', per_minute)
        track('Practice / Share of the randomization', self._share)
        for name in ended[0] if ended else ():
            worth = float(np.mean([terms[name] for terms in ended]))
            track(f'Reward of an episode / {name}', worth)
        steps = self._step * self._envs.num_envs
        rate = steps / (monotonic() - self._begun)
        return (
            f'reward {per_second:5.2f}/s  falls {per_minute:5.2f}/min  '
            f'{steps / 1e6:.2f} M steps, {rate:.0f}/s  randomized {self._share:.0%}'
        )


def _terms(infos: Mapping[str, Any]) -> list[Mapping[str, float]]:
    """Return the summed reward terms of the episodes that ended."""
    terms, there = infos.get('final_info', {}).get('reward_terms', {}), '_reward_terms'
    if not terms:
        return []
    ended = np.flatnonzero(infos['final_info'][there])
    names = [name for name in terms if not name.startswith('_')]
    return [{name: float(terms[name][index]) for name in names} for index in ended]


def _settings(normaliser: Normaliser, curves: Path) -> PPO_CFG:
    return PPO_CFG(
        rollouts=ROLLOUT,
        learning_epochs=4,
        mini_batches=8,
        discount_factor=0.99,
        gae_lambda=0.95,
        learning_rate=(RATE, 1e-3),
        learning_rate_scheduler=(KLAdaptiveLR, None),
        learning_rate_scheduler_kwargs=({'kl_threshold': 0.012, 'max_lr': 1e-3}, {}),
        grad_norm_clip=1.0,
        value_loss_scale=1.0,
        observation_preprocessor=Normaliser,
        observation_preprocessor_kwargs={
            'mean': normaliser.mean,
            'deviation': normaliser.deviation,
        },
        value_preprocessor=RunningStandardScaler,
        value_preprocessor_kwargs={'size': 1},
        time_limit_bootstrap=True,
        experiment={
            'directory': str(curves.parent),
            'experiment_name': curves.name,
            'write_interval': ROLLOUT,
            'checkpoint_interval': 0,
        },
    )


DEVIATION = 0.12  # of the actions that are tried when practice begins: 0.03 rad


def train(
    start: Path, target: Path, progress: Progress, *, seed: int, environments: int, share: float
) -> None:
    """Train the policy of an ONNX file until `progress` is over; write the result as ONNX.

    Raises:
        PolicyError: The layers of the start cannot be trained.
    """
    skrl.config.jax.device = 'cpu'
    skrl.config.jax.key = seed
    skrl.logger.setLevel('WARNING')
    document = contract_of(start, f'PPO from {start.stem} (quad_sim/Walk-v0, 1 to 12 N m/rad)')
    contract = build_contract(document)
    check_terms(contract)
    make = partial(walking_env, contract, PLANT)
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
            share=share,
        )
        for practised in practice.until(lambda: progress.share):
            progress.figures(practised)
        practice.close()
    export(layers_of(actor, normaliser), target, {CONTRACT_KEY: document.to_yaml()})

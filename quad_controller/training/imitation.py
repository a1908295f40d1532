# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first minutes: an imitation of a teacher, which practice begins with (DAgger).

The network acts, the teacher says at every step what it would have done, and the network learns
from all of that (Ross, Gordon and Bagnell, 2011).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from networks import Actor, answer, Normaliser
import numpy as np
import optax
from policy_export import Floats

from quad_controller.policy.observation import ObservationStatistics
from quad_sim.env import ProcessVectorEnv

BATCH = 1024
RATE = 2e-3
STEPS = 250  # of each environment in each round
EPOCHS = 15  # how often all examples are seen in each round; the last has 3 times as many
TRIED = 0.2  # deviation of what the walker tries beside its answer, so that it errs


class Imitation:
    """Learns from the teacher."""

    def __init__(
        self, actor: Actor, envs: ProcessVectorEnv, rounds: int, *, scale: float, seed: int
    ) -> None:
        """Prepare it.

        Args:
            envs: Their observations end with the actions of the teacher.
            scale: What an action of one moves a joint by in [rad].
        """
        # of the observations; there is none before the first round
        self.normaliser: Normaliser | None = None
        self._actor, self._envs, self._rounds, self._scale = actor, envs, rounds, scale
        self._random = np.random.default_rng(seed)
        self._count = actor.num_actions
        self._rows: list[Floats] = []
        self._seen, _ = envs.reset(seed=seed)
        self._answer = jax.jit(partial(answer, actor))

    def rounds(self) -> Iterator[str]:
        """Walk and learn; yield what came of each round, for people."""
        for number in range(1, self._rounds + 1):
            falls = self._walk(taught=number == 1)
            error = self._learn(EPOCHS * (3 if number == self._rounds else 1))
            examples = len(self._rows) * self._envs.num_envs
            yield f'round {number}: {examples} examples, error {error:.4f} rad, {falls} falls'

    @property
    def observed(self) -> ObservationStatistics:
        """What was observed in all rounds."""
        return ObservationStatistics.of(np.concatenate(self._rows)[:, : -self._count])

    def _walk(self, *, taught: bool) -> int:
        falls = 0
        for _ in range(STEPS):
            self._rows.append(self._seen)
            observed, wanted = self._seen[:, : -self._count], self._seen[:, -self._count :]
            action = wanted
            if self.normaliser is not None and not taught:
                params = self._actor.state_dict.params
                action = np.asarray(self._answer(params, self.normaliser(observed)))
            action = action + self._random.normal(0.0, TRIED, action.shape).astype(np.float32)
            self._seen, _, fallen, _, _ = self._envs.step(action)
            falls += int(fallen.sum())
        return falls

    def _learn(self, epochs: int) -> float:
        rows = np.concatenate(self._rows)
        if self.normaliser is None:
            self.normaliser = Normaliser.of(rows[:, : -self._count])
        inputs: Floats = self.normaliser(rows[:, : -self._count])
        wanted = rows[:, -self._count :]
        batches = max(len(rows) // BATCH, 1)
        optimiser = optax.adam(optax.cosine_decay_schedule(RATE, epochs * batches, alpha=0.02))
        step = _learning_step(self._actor, optimiser)
        params = self._actor.state_dict.params
        state, error = optimiser.init(params), 0.0
        for _ in range(epochs):
            order = self._random.permutation(len(rows))
            losses = []
            for chosen in np.array_split(order[: batches * BATCH], batches):
                params, state, loss = step(params, state, inputs[chosen], wanted[chosen])
                losses.append(loss)
            error = float(np.mean(jax.device_get(losses)))
        self._actor.state_dict = self._actor.state_dict.replace(params=params)
        return float(np.sqrt(error)) * self._scale


def _learning_step(actor: Actor, optimiser: optax.GradientTransformation) -> Any:  # noqa: ANN401
    def loss_of(params: Any, inputs: jax.Array, wanted: jax.Array) -> jax.Array:  # noqa: ANN401
        return jnp.mean((answer(actor, params, inputs) - wanted) ** 2)

    @jax.jit  # type: ignore[untyped-decorator]
    def step(
        params: Any,  # noqa: ANN401
        state: optax.OptState,
        inputs: jax.Array,
        wanted: jax.Array,
    ) -> tuple[Any, optax.OptState, jax.Array]:
        loss, gradient = jax.value_and_grad(loss_of)(params, inputs, wanted)
        updates, state = optimiser.update(gradient, state, params)
        return optax.apply_updates(params, updates), state, loss

    return step

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The networks that learn: what acts, and what judges; models of skrl on JAX."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from contract_env import UNSEEN
from flax import linen
import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import onnx
from onnx import numpy_helper
from policy_export import Floats, Layers
from skrl.models.jax import DeterministicMixin, GaussianMixin, Model

from quad_controller.exceptions import PolicyError

HIDDEN = (128, 128)


class Actor(GaussianMixin, Model):  # type: ignore[misc]
    """Answers observations with the mean of the actions to try."""

    def __init__(
        self,
        observation_space: gymnasium.Space[Any],
        action_space: gymnasium.Space[Any],
        **keywords: Any,  # noqa: ANN401
    ) -> None:
        """Make it for some spaces; the keywords are Flax's, which copies it."""
        Model.__init__(
            self, observation_space=observation_space, action_space=action_space, **keywords
        )
        GaussianMixin.__init__(self, min_log_std=-4.0, max_log_std=0.0, role='policy')

    @linen.compact  # type: ignore[untyped-decorator]
    def __call__(self, inputs: dict[str, Any], role: str) -> tuple[jax.Array, dict[str, Any]]:
        """Return the mean actions, and the logarithm of the deviation."""
        seen = inputs['observations'][:, :-UNSEEN]
        mean = _layers(seen, self.num_actions, last=0.1)
        deviation = self.param('log_std', linen.initializers.zeros, (self.num_actions,))
        return mean, {'log_std': deviation}


class Judge(DeterministicMixin, Model):  # type: ignore[misc]
    """Says what is still to be got from a state on."""

    def __init__(
        self,
        observation_space: gymnasium.Space[Any],
        action_space: gymnasium.Space[Any],
        **keywords: Any,  # noqa: ANN401
    ) -> None:
        """Make it for some spaces; the keywords are Flax's, which copies it."""
        Model.__init__(
            self, observation_space=observation_space, action_space=action_space, **keywords
        )
        DeterministicMixin.__init__(self, role='value')

    @linen.compact  # type: ignore[untyped-decorator]
    def __call__(self, inputs: dict[str, Any], role: str) -> tuple[jax.Array, dict[str, Any]]:
        """Return one number for each state."""
        return _layers(inputs['observations'], 1, last=1.0), {}


def _layers(values: jax.Array, outputs: int, last: float) -> jax.Array:
    for size in HIDDEN:
        values = linen.elu(linen.Dense(size)(values))
    scale = linen.initializers.variance_scaling(last, 'fan_in', 'truncated_normal')
    return linen.Dense(outputs, kernel_init=scale)(values)


class Normaliser:
    """Subtracts a mean and divides by a deviation that stay as they are: skrl's preprocessor."""

    def __init__(self, mean: Floats, deviation: Floats) -> None:
        """Take both."""
        self.mean, self.deviation = mean, deviation

    def __call__(self, values: Any, *, train: bool = False, inverse: bool = False) -> Any:  # noqa: ANN401
        """Return normalised observations."""
        return None if values is None else (values - self.mean) / self.deviation


def explore(actor: Actor, deviation: float) -> None:
    """Sample actions of an actor with this deviation from its mean."""
    params = actor.state_dict.params
    tried = jnp.full((actor.num_actions,), math.log(deviation))
    actor.state_dict = actor.state_dict.replace(
        params={**params, 'params': {**params['params'], 'log_std': tried}}
    )


def learned_in(path: Path, actor: Actor) -> Normaliser:
    """Give an actor the layers that an export wrote; return the normalisation of observations.

    Raises:
        PolicyError: It has other layers.
    """
    found = {each.name: numpy_helper.to_array(each) for each in onnx.load(path).graph.initializer}
    params = actor.state_dict.params
    layers: dict[str, Any] = dict(params['params'])
    for place in range(len(HIDDEN) + 1):
        own, kernel, bias = (
            layers[f'Dense_{place}'],
            *(found.get(f'{kind}{place}', np.zeros(0)) for kind in ('weight', 'bias')),
        )
        if (kernel.shape, bias.shape) != (own['kernel'].shape, own['bias'].shape):
            raise PolicyError(
                f'policy {path} does not have the layers of this training '
                f'({" and ".join(map(str, HIDDEN))} units): begin with trot_ppo, or with a policy '
                'that this training wrote'
            )
        layers[f'Dense_{place}'] = {'kernel': jnp.array(kernel), 'bias': jnp.array(bias)}
    actor.state_dict = actor.state_dict.replace(params={**params, 'params': layers})
    return Normaliser(
        np.append(found['mean'], np.zeros(UNSEEN, np.float32)),
        np.append(found['deviation'], np.ones(UNSEEN, np.float32)),
    )


def layers_of(actor: Actor, normaliser: Normaliser) -> Layers:
    """Return what an actor has learned, without the trainer."""
    params = jax.device_get(actor.state_dict.params)['params']
    dense = [params[f'Dense_{place}'] for place in range(len(HIDDEN) + 1)]
    return Layers(
        normaliser.mean[:-UNSEEN],
        normaliser.deviation[:-UNSEEN],
        [np.asarray(each['kernel'], np.float32) for each in dense],
        [np.asarray(each['bias'], np.float32) for each in dense],
    )

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Actor and critic networks: skrl models on JAX."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from contract_env import UNSEEN
from flax import linen
import gymnasium
import jax
import jax.numpy as jnp
from jax.scipy.linalg import block_diag
import numpy as np
import onnx
from onnx import numpy_helper
from policy_export import Floats, Layers
from skrl.models.jax import DeterministicMixin, GaussianMixin, Model

from quad_controller.exceptions import PolicyError
from quad_controller.policy.contract.model import PolicyContract, Source

HIDDEN = (128, 128)
JOINTS = np.kron(np.kron(np.eye(2), np.eye(2)[::-1]), np.eye(3)).astype(np.float32)
"""Joints of the left legs for those of the right; their axes are each other's mirror images."""
MIRROR = {
    Source.ANGULAR_VELOCITY: np.diag([-1, 1, -1]),
    Source.GRAVITY: np.diag([1, -1, 1]),
    Source.COMMAND: np.diag([1, -1, -1]),
    Source.PHASE: -np.eye(2),  # a trot's other pair of legs steps half a cycle later
    Source.JOINT_POSITIONS: JOINTS,
    Source.JOINT_VELOCITIES: JOINTS,
    Source.LAST_ACTION: JOINTS,
}
"""What each term of an observation is for a robot that is this one's mirror image."""
SEEN_MIRROR = np.asarray(block_diag(*MIRROR.values()), np.float32)


def check_terms(contract: PolicyContract) -> None:
    """Check that the observation has the terms of :data:`MIRROR`, in that order.

    Raises:
        PolicyError: The terms differ.
    """
    if [term.source for term in contract.terms] != list(MIRROR):
        raise PolicyError(f'this training needs the terms {[each.value for each in MIRROR]}')


class Actor(GaussianMixin, Model):  # type: ignore[misc]
    """Maps observations to the mean of the action distribution.

    It is mirror-symmetric, so it does not drift to one side.
    """

    def __init__(
        self,
        observation_space: gymnasium.Space[Any],
        action_space: gymnasium.Space[Any],
        **keywords: Any,  # noqa: ANN401
    ) -> None:
        """Create the actor for some spaces; Flax copies it, hence the extra keywords."""
        Model.__init__(
            self, observation_space=observation_space, action_space=action_space, **keywords
        )
        GaussianMixin.__init__(self, min_log_std=-4.0, max_log_std=0.0, role='policy')

    @linen.compact  # type: ignore[untyped-decorator]
    def __call__(self, inputs: dict[str, Any], role: str) -> tuple[jax.Array, dict[str, Any]]:
        """Return the mean actions and the logarithm of their standard deviation."""
        seen = inputs['observations'][:, :-UNSEEN]
        layers = _layers(self.num_actions, last=0.1)
        mean = 0.5 * (_through(layers, seen) + _through(layers, seen @ SEEN_MIRROR) @ JOINTS)
        deviation = self.param('log_std', linen.initializers.zeros, (self.num_actions,))
        return mean, {'log_std': deviation}


class Judge(DeterministicMixin, Model):  # type: ignore[misc]
    """Critic: estimates the value of a state."""

    def __init__(
        self,
        observation_space: gymnasium.Space[Any],
        action_space: gymnasium.Space[Any],
        **keywords: Any,  # noqa: ANN401
    ) -> None:
        """Create the critic for some spaces; Flax copies it, hence the extra keywords."""
        Model.__init__(
            self, observation_space=observation_space, action_space=action_space, **keywords
        )
        DeterministicMixin.__init__(self, role='value')

    @linen.compact  # type: ignore[untyped-decorator]
    def __call__(self, inputs: dict[str, Any], role: str) -> tuple[jax.Array, dict[str, Any]]:
        """Return the value of each state."""
        return _through(_layers(1, last=1.0), inputs['observations']), {}


def _layers(outputs: int, last: float) -> list[linen.Dense]:
    scale = linen.initializers.variance_scaling(last, 'fan_in', 'truncated_normal')
    return [*(linen.Dense(size) for size in HIDDEN), linen.Dense(outputs, kernel_init=scale)]


def _through(layers: list[linen.Dense], values: jax.Array) -> jax.Array:
    for layer in layers[:-1]:
        values = linen.elu(layer(values))
    return layers[-1](values)


class Normaliser:
    """skrl preprocessor: normalises with a fixed mean and standard deviation."""

    def __init__(self, mean: Floats, deviation: Floats) -> None:
        """Store mean and standard deviation."""
        self.mean, self.deviation = mean, deviation

    def __call__(self, values: Any, *, train: bool = False, inverse: bool = False) -> Any:  # noqa: ANN401
        """Return normalised observations."""
        return None if values is None else (values - self.mean) / self.deviation


def explore(actor: Actor, deviation: float) -> None:
    """Sample actions around the actor's mean with this standard deviation."""
    params = actor.state_dict.params
    tried = jnp.full((actor.num_actions,), math.log(deviation))
    actor.state_dict = actor.state_dict.replace(
        params={**params, 'params': {**params['params'], 'log_std': tried}}
    )


def learned_in(path: Path, actor: Actor) -> Normaliser:
    """Load exported layers into an actor; return the normalisation of observations.

    Raises:
        PolicyError: The layers do not match.
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
        if not place:  # normalised so that both images are, and answered as before
            mean, deviation = found['mean'], found['deviation']
            even = 0.5 * (mean + mean @ SEEN_MIRROR)
            broad = 0.5 * (deviation + deviation @ np.abs(SEEN_MIRROR))
            bias = bias + ((even - mean) / deviation) @ kernel
            kernel = kernel * (broad / deviation)[:, None]
        layers[f'Dense_{place}'] = {'kernel': jnp.array(kernel), 'bias': jnp.array(bias)}
    actor.state_dict = actor.state_dict.replace(params={**params, 'params': layers})
    return Normaliser(
        np.append(even, np.zeros(UNSEEN, np.float32)),
        np.append(broad, np.ones(UNSEEN, np.float32)),
    )


def layers_of(actor: Actor, normaliser: Normaliser) -> Layers:
    """Return the trained layers of an actor, without the trainer."""
    params = jax.device_get(actor.state_dict.params)['params']
    dense = [params[f'Dense_{place}'] for place in range(len(HIDDEN) + 1)]
    return Layers(
        normaliser.mean[:-UNSEEN],
        normaliser.deviation[:-UNSEEN],
        [np.asarray(each['kernel'], np.float32) for each in dense],
        [np.asarray(each['bias'], np.float32) for each in dense],
        (SEEN_MIRROR, JOINTS),
    )

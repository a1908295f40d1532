# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics as a Gymnasium environment, registered on import.

The task of ``quad_sim/Walk-v0`` is to walk as commanded.

Vectorized over the cores::

    import gymnasium
    import quad_sim.env

    envs = gymnasium.make_vec(
        'quad_sim/Walk-v0', num_envs=16, vectorization_mode='vector_entry_point'
    )
"""

from gymnasium.envs.registration import register

from .processes import ProcessVectorEnv
from .walking import (
    CommandRanges,
    NO_RANDOMIZATION,
    Observation,
    Randomization,
    RewardWeights,
    WalkingEnv,
)

ID = 'quad_sim/Walk-v0'

register(
    id=ID,
    entry_point='quad_sim.env:WalkingEnv',
    vector_entry_point='quad_sim.env.processes:walking_processes',
)
__all__ = [
    'ID',
    'NO_RANDOMIZATION',
    'CommandRanges',
    'Observation',
    'ProcessVectorEnv',
    'Randomization',
    'RewardWeights',
    'WalkingEnv',
]

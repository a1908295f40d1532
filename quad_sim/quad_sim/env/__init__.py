# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics as Gymnasium environments; importing it registers them.

``quad_sim/Walk-v0`` is to walk as commanded, ``quad_sim/GetUp-v0`` is to get up from a fall.

Many at once, spread over the cores::

    import gymnasium
    import quad_sim.env

    envs = gymnasium.make_vec(
        'quad_sim/Walk-v0', num_envs=16, vectorization_mode='vector_entry_point'
    )
"""

from gymnasium.envs.registration import register

from .get_up import Drop, GetUpEnv
from .observation import Observation
from .processes import ProcessVectorEnv
from .randomization import NO_RANDOMIZATION, Randomization
from .rewards import GetUpWeights, RewardWeights
from .walking import CommandRanges, WalkingEnv

ID, GET_UP_ID = 'quad_sim/Walk-v0', 'quad_sim/GetUp-v0'

register(
    id=ID,
    entry_point='quad_sim.env:WalkingEnv',
    vector_entry_point='quad_sim.env.processes:walking_processes',
)
register(
    id=GET_UP_ID,
    entry_point='quad_sim.env:GetUpEnv',
    vector_entry_point='quad_sim.env.processes:get_up_processes',
)

__all__ = [
    'GET_UP_ID',
    'ID',
    'NO_RANDOMIZATION',
    'CommandRanges',
    'Drop',
    'GetUpEnv',
    'GetUpWeights',
    'Observation',
    'ProcessVectorEnv',
    'Randomization',
    'RewardWeights',
    'WalkingEnv',
]

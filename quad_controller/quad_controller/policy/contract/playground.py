# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contracts from MuJoCo Playground: ``config.json`` of a training (the Go1 joystick).

The order of the observation is that of the Go1 joystick's ``state``: it stands in their code, not
in the file. So do the names of the joints and the default pose (keyframe ``home``), and the frame
of the IMU's site: those are asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any

from .document import ContractDocument, document_of, known, Values
from .model import Source

TERMS: dict[str, Values] = {
    'linvel': {'source': Source.LINEAR_VELOCITY.value},
    'gyro': {'source': Source.ANGULAR_VELOCITY.value},
    'gravity': {'source': Source.GRAVITY.value},
    'joint_angles': {'source': Source.JOINT_POSITIONS.value, 'relative': True},
    'joint_vel': {'source': Source.JOINT_VELOCITIES.value},
    'last_act': {'source': Source.LAST_ACTION.value},
    'command': {'source': Source.COMMAND.value},
}
JOYSTICK = 'Go1 joystick of MuJoCo Playground'
GO1_KEYS = {'command_config', 'history_len', 'noise_config', 'pert_config'}
"""No other task of Playground 0.2.0 has all of these."""
HINTS = {
    'joints': 'order of the actuators in the MJCF file of the training',
    'default_positions': 'keyframe "home" of the MJCF file of the training',
    **{
        f'observation.terms.{name}.frame': 'frame of the site "imu" in the MJCF file'
        for name in ('linvel', 'gyro')
    },
}


def read_config(values: Mapping[str, Any], origin: str) -> ContractDocument:
    """Read ``config.json`` of a training."""
    stiffness, damping = (
        value if isinstance(value, (int, float)) else None
        for value in (values.get('Kp'), values.get('Kd'))
    )
    contract = known(
        period=values.get('ctrl_dt'),
        action=known(scale=values.get('action_scale')),
        gains=known(stiffness=stiffness, damping=damping),
    )
    refusals: tuple[str, ...] = ()
    if not values.keys() >= GO1_KEYS or values['history_len'] != 1:
        refusals = (f'{origin} is of another task than the Go1 joystick; write its contract',)
    terms = document_of(
        {'observation': {'terms': {k: dict(v) for k, v in TERMS.items()}}}, JOYSTICK
    )
    document = terms.over(document_of(contract, origin))
    noise = values.get('noise_config') or {}
    level, each = noise.get('level', 1.0), (noise.get('scales') or {}).get('joint_vel')
    if isinstance(level, (int, float)) and isinstance(each, (int, float)):
        deviation = level * each / math.sqrt(3.0)  # uniform, to either side
        known_noise = {'observation': {'terms': {'joint_vel': {'noise': deviation}}}}
        document = document_of(known_noise, origin).over(document)
    return ContractDocument(document.values, document.origins, HINTS, refusals)

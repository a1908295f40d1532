# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contracts from MuJoCo Playground: ``config.json`` of a training (its joystick tasks).

The order of the observation is that of the joystick tasks' ``state``: it stands in their code, not
in the file. So do the names of the joints and the default pose (keyframe ``home``), and the frame
of the IMU's site: those are asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .document import ContractDocument, document_of, Values
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
JOYSTICK = 'joystick task of MuJoCo Playground'
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
    contract: Values = {'period': values.get('ctrl_dt')}
    if 'action_scale' in values:
        contract['action'] = {'scale': values['action_scale']}
    gains = {
        name: values[key]
        for name, key in (('stiffness', 'Kp'), ('damping', 'Kd'))
        if isinstance(values.get(key), (int, float))
    }
    if gains:
        contract['gains'] = gains
    refusals: tuple[str, ...] = ()
    if values.get('history_len', 1) != 1:
        length = values['history_len']
        refusals = (f'{origin}: history_len {length} is of another task; write its contract',)
    terms = document_of(
        {'observation': {'terms': {k: dict(v) for k, v in TERMS.items()}}}, JOYSTICK
    )
    document = terms.over(document_of(contract, origin))
    return ContractDocument(document.values, document.origins, HINTS, refusals)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The contract of the policies that are trained here, as data."""

from __future__ import annotations

from typing import Any

from quad_controller.policy.contract.document import document_of
from quad_controller.policy.contract.mjlab import CONTRACT_KEY
from quad_controller.policy.contract.model import build_contract, PolicyContract
from quad_description import Targets
from quad_sim import ServoModel
from quad_sim.env import CommandRanges

PERIOD = 0.02  # [s]
SCALE = 0.25  # [rad] for an action of one
PHASE_THRESHOLD = 0.02  # slower commands have no phase

Values = dict[str, Any]


def walking_values(
    names: tuple[str, ...], stand: Targets, phase_period: float, kind: str
) -> Values:
    """Return the contract of a policy that walks, as it is written into the file.

    Args:
        stand: Their positions when the robot stands [rad].
        phase_period: Of the gait [s].
        kind: How the policy is made, for people.
    """
    ranges, servo = CommandRanges(), ServoModel.FIRM.parameters
    terms = {
        'angular_velocity': {'source': 'angular_velocity', 'frame': 'base'},
        'gravity': {'source': 'gravity'},
        'command': {'source': 'command'},
        'phase': {
            'source': 'phase',
            'phase_period': round(phase_period, 3),
            'phase_threshold': PHASE_THRESHOLD,
        },
        'positions': {'source': 'joint_positions', 'relative': True},
        'velocities': {'source': 'joint_velocities'},
        'last_action': {'source': 'last_action'},
    }
    return {
        'kind': kind,
        'joints': list(names),
        'default_positions': [round(position, 3) + 0.0 for position in stand],
        'period': PERIOD,
        'observation': {'terms': terms},
        'action': {'scale': SCALE},
        'gains': {'stiffness': servo.stiffness, 'damping': servo.velocity_gain},
        'commands': {'x': list(ranges.x), 'y': list(ranges.y), 'yaw': list(ranges.yaw)},
    }


def contract_of(values: Values) -> PolicyContract:
    """Return the contract that values say."""
    return build_contract(document_of(values, 'training'))


def metadata_of(values: Values) -> dict[str, str]:
    """Return the metadata of a file that has its contract."""
    return {CONTRACT_KEY: document_of(values, '').to_yaml()}

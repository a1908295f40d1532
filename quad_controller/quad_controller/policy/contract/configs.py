# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contracts from rl_sar (``config.yaml``, ``base.yaml``) and MuJoCo Playground (``config.json``).

In rl_sar a policy has a ``config.yaml``, its robot a ``base.yaml``. Each file has one top-level
key (``go2``, ``go2/himloco``). Observations are scaled, then clipped as a whole; actions are
clipped before they are scaled, and the clipped ones are fed back. In ``observations_history`` 0 is
the newest step. The policy's ``joint_mapping`` overrides that of its robot. rl_sar's code, not its
files, defines the frame of the angular velocity: on a robot, the body frame.

In Playground the observation has the order of the Go1 joystick's ``state``, which is defined in
their code, not in the file. The file also lacks the joint names, the default pose (keyframe
``home``) and the frame of the IMU site: the user has to supply those.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
import math
from typing import Any

from .document import ContractDocument, document_of, known, permuted, Values
from .model import RL_SAR, Source

SCALES = {
    'lin_vel': 'lin_vel_scale',
    'ang_vel': 'ang_vel_scale',
    'gravity_vec': 'gravity_vec_scale',
    'commands': 'commands_scale',
    'dof_pos': 'dof_pos_scale',
    'dof_vel': 'dof_vel_scale',
}
LAYOUTS = {'time': 'frames', 'term': 'per_term'}


def read_rl_sar(values: Mapping[str, Any], origin: str) -> ContractDocument:
    """Read a ``config.yaml`` or ``base.yaml``."""
    config: Mapping[str, Any] = values
    robot = ''
    if len(values) == 1:
        robot, inner = next(iter(values.items()))
        config = inner if isinstance(inner, Mapping) else {}
    refusals: list[str] = []
    step, decimation, period = config.get('dt'), config.get('decimation'), None
    if isinstance(step, (int, float)) and isinstance(decimation, int):
        period = step * decimation
    joints, mapping = config.get('joint_names'), config.get('joint_mapping')
    if isinstance(joints, list) and mapping is not None:
        joints = permuted(joints, mapping)
    low, high = config.get('clip_actions_lower'), config.get('clip_actions_upper')
    order = known(
        names=config.get('joint_names'),
        **{'policy_mapping' if 'observations' in config else 'mapping': mapping},
    )
    contract = known(
        robot=str(robot) or None,
        period=period,
        joints=joints if isinstance(joints, list) else None,
        default_positions=config.get('default_dof_pos'),
        action=known(
            scale=config.get('action_scale'),
            clip=[list(pair) for pair in zip(low, high, strict=True)] if low and high else None,
        ),
        gains=known(stiffness=config.get('rl_kp'), damping=config.get('rl_kd')),
    )
    if 'observations' in config:
        contract['observation'] = _observation(config, origin, refusals)
    return replace(document_of(contract, origin, RL_SAR_HINTS, refusals), joint_order=order)


RL_SAR_HINTS = {
    'joints': 'base.yaml of the robot has joint_names and joint_mapping',
    'period': 'base.yaml of the robot has dt and decimation',
}


def _observation(config: Mapping[str, Any], origin: str, refusals: list[str]) -> Values:
    history = config.get('observations_history') or [0]
    terms = {name: _term(name, config, origin, refusals) for name in config['observations']}
    observation: Values = {'terms': terms}
    if 'clip_obs' in config:
        observation['clip'] = config['clip_obs']
    if history != [0]:
        for term in terms.values():
            term['history'] = len(history)
        observation['history'] = _history(config, list(history), origin, refusals)
    return observation


def _term(name: str, config: Mapping[str, Any], origin: str, refusals: list[str]) -> Values:
    term: Values = dict(RL_SAR.get(name, {}))
    if SCALES.get(name) in config:
        term['scale'] = config[SCALES[name]]
    if term.get('source') == Source.ANGULAR_VELOCITY.value:
        axis = config.get('ang_vel_axis', config.get('ang_vel_type'))
        if axis is None or str(axis).endswith('body'):
            term['frame'] = 'base'
        else:
            refusals.append(f'{origin}: an angular velocity of {axis!r} cannot be run here')
    return term


def _history(
    config: Mapping[str, Any], history: list[int], origin: str, refusals: list[str]
) -> Values:
    steps = list(range(len(history)))
    contract: Values = {'start': 'zero'}
    layout = LAYOUTS.get(config.get('observations_history_priority', ''))
    if layout is not None:
        contract['layout'] = layout
    if history == steps:
        contract['newest'] = 'first'
    elif history == steps[::-1]:
        contract['newest'] = 'last'
    else:
        refusals.append(
            f'{origin}: observations_history {history} has gaps; all of {steps} are needed'
        )
    return contract


PLAYGROUND_TERMS: dict[str, Values] = {
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
PLAYGROUND_HINTS = {
    'joints': 'order of the actuators in the MJCF file of the training',
    'default_positions': 'keyframe "home" of the MJCF file of the training',
    **{
        f'observation.terms.{name}.frame': 'frame of the site "imu" in the MJCF file'
        for name in ('linvel', 'gyro')
    },
}


def read_playground(values: Mapping[str, Any], origin: str) -> ContractDocument:
    """Read the ``config.json`` of a training."""
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
        {'observation': {'terms': {k: dict(v) for k, v in PLAYGROUND_TERMS.items()}}}, JOYSTICK
    )
    document = terms.over(document_of(contract, origin))
    noise = values.get('noise_config') or {}
    level, each = noise.get('level', 1.0), (noise.get('scales') or {}).get('joint_vel')
    if isinstance(level, (int, float)) and isinstance(each, (int, float)):
        deviation = level * each / math.sqrt(3.0)  # uniform, to either side
        known_noise = {'observation': {'terms': {'joint_vel': {'noise': deviation}}}}
        document = document_of(known_noise, origin).over(document)
    return ContractDocument(document.values, document.origins, PLAYGROUND_HINTS, refusals)

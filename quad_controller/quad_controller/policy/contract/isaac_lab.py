# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Contracts from Isaac Lab: ``params/env.yaml`` of a training, ``deploy.yaml`` of unitree_rl_lab.

Velocities are those of the root in its own frame (``isaaclab.envs.mdp``). Each term has its own
history, oldest first, filled with the first step at the start (``CircularBuffer``). Neither file
has the joint order: it is the simulator's, and the user has to supply it as names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
import re
from typing import Any

from ...exceptions import PolicyError
from .document import ContractDocument, document_of, known, Values
from .model import ISAAC_LAB, Source

JOINTS_HINT = 'the file does not have the order of the joints; Isaac Lab prints robot.joint_names'
PER_TERM = {'layout': 'per_term', 'newest': 'last', 'start': 'repeat'}
FRAMES = {'layout': 'frames', 'newest': 'last', 'start': 'repeat'}
POSITION_ACTION = 'JointPositionAction'
RANGES = {'lin_vel_x': 'x', 'lin_vel_y': 'y', 'ang_vel_z': 'yaw'}


def read_deploy(values: Mapping[str, Any], origin: str) -> ContractDocument:
    """Read ``deploy.yaml`` of unitree_rl_lab."""
    observations = _mapping(values, 'observations')
    frames = bool(observations.get('use_gym_history'))
    terms = {
        name: _term(name, term) for name, term in observations.items() if isinstance(term, Mapping)
    }
    contract: Values = {
        'period': values.get('step_dt'),
        'default_positions': values.get('default_joint_pos'),
        'observation': {'terms': terms},
        'commands': _ranges(values),
    }
    if _has_history(terms):
        contract['observation']['history'] = dict(FRAMES if frames else PER_TERM)
    contract['action'], refusals = _action(values, (), origin)
    contract['gains'] = known(
        **{name: _uniform(values.get(name)) for name in ('stiffness', 'damping')}
    )
    hints = {'joints': JOINTS_HINT}
    if 'stiffness' in values and not contract['gains']:
        hints['gains.stiffness'] = 'in the order of the motors in the file'
    return document_of(known(**contract), origin, hints, refusals)


def read_env(values: Mapping[str, Any], origin: str, joints: Sequence[str]) -> ContractDocument:
    """Read the ``params/env.yaml`` of an Isaac Lab training.

    Args:
        joints: Joint names in the policy's order, matched with the patterns of the file; empty if
            unknown.
    """
    group = _mapping(_mapping(values, 'observations'), 'policy')
    length = group.get('history_length')
    terms: dict[str, Values] = {}
    refusals: list[str] = []
    for name, term in group.items():
        if not isinstance(term, Mapping) or 'func' not in term:
            continue
        kind = str(term['func']).rpartition(':')[2]
        terms[name] = _term(kind, {**term, **({'history_length': length} if length else {})})
        if terms[name].get('source') == Source.JOINT_VELOCITIES.value:
            terms[name] |= known(noise=_noise(group, term))
        if term.get('modifiers'):
            refusals.append(f'{origin}: observations.policy.{name}.modifiers cannot be run here')
    sim = _mapping(values, 'sim')
    period = None
    if isinstance(sim.get('dt'), (int, float)) and isinstance(values.get('decimation'), int):
        period = sim['dt'] * values['decimation']
    robot = _mapping(_mapping(values, 'scene'), 'robot')
    state = _mapping(robot, 'init_state')
    defaults = _matched(state.get('joint_pos'), joints, 0.0)
    contract: Values = {
        'joints': list(joints) or None,
        'default_positions': defaults,
        'period': period,
        'observation': {'terms': terms},
        'commands': _ranges(values),
    }
    if _has_history(terms):
        contract['observation']['history'] = dict(PER_TERM)
        if group.get('flatten_history_dim') is False:
            refusals.append(f'{origin}: observations.policy.flatten_history_dim must be true')
    contract['action'], refused = _action(values, joints, origin)
    refusals += refused
    hints = {'joints': JOINTS_HINT}
    if not joints:
        hints['default_positions'] = 'found by the names of the joints'
        hints['action.scale'] = 'found by the names of the joints'
    return document_of(known(**contract), origin, hints, refusals)


def _term(kind: str, term: Mapping[str, Any]) -> Values:
    usual = dict(ISAAC_LAB.get(kind, {}))
    if kind == 'gait_phase':
        usual['phase_period'] = _mapping(term, 'params').get('period')
    scale, clip = term.get('scale'), term.get('clip')
    if term.get('scale_first') and clip and scale:  # unitree_rl_lab: the clip is of scaled values
        factors = set(scale) if isinstance(scale, (list, tuple)) else {scale}
        if len(factors) > 1 or min(factors) <= 0.0:
            raise PolicyError(
                f'scale_first with clip {clip} and scale {scale} cannot be run here: one scale '
                'above 0 is needed for all numbers of a term'
            )
        clip = [end / min(factors) for end in clip]
    return known(
        **usual,
        scale=scale,
        clip=clip,
        history=max(int(term.get('history_length') or 1), 1),
    )


def _noise(group: Mapping[str, Any], term: Mapping[str, Any]) -> float | None:
    """Return the standard deviation of a term's noise; None if the file omits it."""
    noise = term.get('noise')
    if group.get('enable_corruption') is False or ('noise' in term and noise is None):
        return 0.0
    if not isinstance(noise, Mapping) or noise.get('operation') != 'add':
        return None
    lower, upper, deviation = (noise.get(name) for name in ('n_min', 'n_max', 'std'))
    if isinstance(lower, (int, float)) and isinstance(upper, (int, float)):
        return abs(upper - lower) / math.sqrt(12.0)
    return deviation if isinstance(deviation, (int, float)) else None


def _action(
    values: Mapping[str, Any], joints: Sequence[str], origin: str
) -> tuple[Values, list[str]]:
    """Return the action, and why it is unsupported: only absolute positions of all joints are."""
    actions = {
        name: each for name, each in _mapping(values, 'actions').items()
        if isinstance(each, Mapping)
    }  # fmt: skip
    if len(actions) != 1:
        names = ', '.join(actions) or 'none'
        return {}, [f'{origin}: one action of joint positions can be run here, not {names}']
    (name, action), *_ = actions.items()
    kind = re.split(r'[.:]', str(action.get('class_type', name)))[-1]
    refusals = []
    if kind != POSITION_ACTION:
        refusals.append(f'{origin}: actions.{name} is a {kind}; {POSITION_ACTION} can be run here')
    if action.get('joint_ids') is not None or action.get('preserve_order'):
        refusals.append(f'{origin}: actions.{name} has an order of joints of its own')
    offset = _matched(action.get('offset'), joints, 0.0)
    return known(
        scale=_matched(action.get('scale'), joints, 1.0),
        offset=None if action.get('use_default_offset') else offset,
        target_clip=_matched(action.get('clip'), joints, [-math.inf, math.inf]),
    ), refusals


def _matched(value: object, joints: Sequence[str], default: object) -> object:
    """Resolve patterns to one value per joint; return other values unchanged."""
    if not isinstance(value, Mapping):
        return value
    if not joints:
        return None
    return [
        next((number for pattern, number in value.items() if re.fullmatch(pattern, name)), default)
        for name in joints
    ]


def _has_history(terms: Mapping[str, Values]) -> bool:
    return any(term.get('history', 1) > 1 for term in terms.values())


def _uniform(value: object) -> object:
    """Return the common value of all list entries; None if they differ."""
    if not isinstance(value, (list, tuple)):
        return value
    return value[0] if value and all(each == value[0] for each in value) else None


def _ranges(values: Mapping[str, Any]) -> Values:
    ranges = _mapping(_mapping(_mapping(values, 'commands'), 'base_velocity'), 'ranges')
    found = {axis: ranges.get(key) for key, axis in RANGES.items()}
    return {axis: list(span) for axis, span in found.items() if isinstance(span, (list, tuple))}


def _mapping(values: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = values.get(key)
    return found if isinstance(found, Mapping) else {}

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads ONNX metadata as written by mjlab's exporter and the vendor's training.

All values are strings; commas separate list items, numbers and flags have three decimals (mjlab,
rl/exporter_utils.py). Since 1.5.1 it also writes scales, clips and histories of the terms;
semicolons separate the numbers of one term, and ``-inf;inf`` means no clipping. A joint may have a
prefix like ``robot/``. No exporter writes the frame of the IMU, the period of the phase, or the
rate; ``phase_period``, ``phase_command_threshold``, ``imu_frame`` and ``kind`` are ours.

Sizes and rate have keys of several tools (unitree_rl_lab's deploy.yaml, rl_sar, IsaacLab); they
are compared with the contract. Unknown keys that look similar are reported; keys that
would change observations or actions are rejected.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
import math
import re
from typing import Any

from ...exceptions import PolicyError
from .document import ContractDocument, document_of, known, read_yaml, Values
from .model import MJLAB, Source

CONTRACT_KEY = 'policy_contract'
"""Key of a whole contract in YAML; its values count before all others of the file."""

VENDOR_TERMS = ('ang_vel', 'gravity', 'cmd', 'phase', 'joint_pos', 'joint_vel', 'prev_action')
VENDOR_PHASE_PERIOD = 0.4  # [s] luwu_mjlab, XGOMini velocity task; no exporter writes it
VENDOR_STEP_PERIOD = 0.02  # [s] luwu_mjlab: 500 Hz physics, decimation 10
VENDOR_PHASE_THRESHOLD = 0.1  # luwu_mjlab, norm of (vx, vy, yaw rate)
VENDOR = "the vendor's training (luwu_mjlab)"
FILE = 'metadata'

STEP_KEYS = ('step_dt', 'control_dt', 'policy_dt')
"""Time between two steps in [s]."""

OBSERVATION_SIZE_KEYS = (
    *('obs_dim', 'observation_dim', 'input_dim', 'num_obs', 'num_observations'),
    'dims',  # of both: the first number is the observation's, the last one the action's
)
ACTION_SIZE_KEYS = (
    *('action_dim', 'act_dim', 'output_dim', 'num_actions', 'num_joints', 'num_dofs', 'dims'),
)

KNOWN_KEYS = frozenset(
    {
        'action_scale',
        'observation_terms_scale',
        'observation_terms_clip',
        'observation_terms_history_length',
        'observation_terms_flatten_history_dim',
        *STEP_KEYS,
        *OBSERVATION_SIZE_KEYS,
        *ACTION_SIZE_KEYS,
    }
)
"""Keys that are read."""
CHANGING = re.compile(r'scale|clip|history')  # keys of what changes observations or actions
SUSPICIOUS = re.compile(r'dim|(^|_)dt($|_)|decimation|rate$|frequency|(^|_)hz($|_)')
NUMBER = re.compile(r'[-+]?(?:\d+\.?\d*(?:e[-+]?\d+)?|\.\d+|inf)', re.IGNORECASE)
NO_CLIP = 100.0  # where observations are clipped anyway, and no action is ever


def read_metadata(values: Mapping[str, str]) -> ContractDocument:
    """Read the metadata of an ONNX file.

    Raises:
        PolicyError: A value is not a valid number, list, or YAML.
    """
    document = document_of(_mjlab(values), FILE)
    document = document_of(_assumed(document.values), VENDOR).over(document)
    refusals = [
        f'metadata {key} = {text} is not understood, and would change observations or actions'
        for key, text in changing(values).items()
    ]
    document = replace(document, hints=HINTS, refusals=(*refusals, *_layouts(values)))
    if CONTRACT_KEY in values:
        attached = read_yaml(values[CONTRACT_KEY], f'metadata {CONTRACT_KEY}')
        # what came from the exporter still has its three decimals
        lines = values[CONTRACT_KEY].splitlines()
        rounded = {path: FILE for path in attached.origins if f'# {path}: {FILE}' in lines}
        document = replace(attached, origins={**attached.origins, **rounded}).over(document)
    return document


HINTS = {
    'joints': 'the file has no metadata joint_names',
    'default_positions': 'the file has no metadata default_joint_pos',
    'action.scale': 'the file has no metadata action_scale',
    'observation.terms': 'the file has no metadata observation_names',
    'period': 'the file has no metadata step_dt',
}


def _mjlab(values: Mapping[str, str]) -> Values:
    def numbers(key: str) -> list[float] | None:
        return _numbers(values, key) if key in values else None

    joints, scale, steps = (
        values.get('joint_names'),
        numbers('action_scale'),
        numbers_of(values, STEP_KEYS),
    )
    contract = known(
        default_positions=numbers('default_joint_pos'),
        joints=None if joints is None else [_base_name(word) for word in _words(joints)],
        action=known(scale=scale[0] if scale and len(scale) == 1 else scale),
        gains=known(stiffness=numbers('joint_stiffness'), damping=numbers('joint_damping')),
        period=next(iter(steps.values()), None),
        kind=values.get('kind'),
    )
    if 'observation_names' in values:
        contract['observation'] = {'terms': _terms(values)}
        if any(term.get('history', 1) > 1 for term in contract['observation']['terms'].values()):
            contract['observation']['history'] = {
                'layout': 'per_term', 'newest': 'last', 'start': 'repeat',
            }  # fmt: skip
    return contract


def _terms(values: Mapping[str, str]) -> dict[str, Values]:
    names = [_base_name(word) for word in _words(values['observation_names'])]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise PolicyError(f'metadata observation_names has {", ".join(repeated)} twice')
    scales, clips, histories = (
        _entries(values, f'observation_terms_{key}', len(names))
        for key in ('scale', 'clip', 'history_length')
    )
    columns: dict[str, list[Any]] = {
        'scale': [entry[0] if entry and len(entry) == 1 else entry for entry in scales],
        'clip': [None if entry == [-math.inf, math.inf] else entry for entry in clips],
        # 0 is how the exporter writes that there is none
        'history': [(entry[0] if entry else 0) or None for entry in histories],
    }
    terms: dict[str, Values] = {}
    for place, name in enumerate(names):
        term = dict(MJLAB.get(name, {}))
        for key, column in columns.items():
            if column[place] is not None:
                term[key] = column[place]
        terms[name] = term | _own_keys(values, term.get('source'))
    return terms


def _own_keys(values: Mapping[str, str], source: object) -> Values:
    if source == Source.ANGULAR_VELOCITY.value and 'imu_frame' in values:
        return {'frame': values['imu_frame']}
    if source == Source.PHASE.value:
        return {
            name: _numbers(values, key)[0]
            for key, name in (
                ('phase_period', 'phase_period'),
                ('phase_command_threshold', 'phase_threshold'),
            )
            if key in values
        }
    return {}


def _assumed(known: Values) -> Values:
    """Return known facts of the vendor's task that the metadata omit, if the terms match."""
    terms = known.get('observation', {}).get('terms', {})
    sources = [term.get('source') for term in terms.values()]
    if sources != [MJLAB[name]['source'] for name in VENDOR_TERMS]:
        return {}
    phase = next(name for name, term in terms.items() if term['source'] == Source.PHASE.value)
    of_phase = {'phase_period': VENDOR_PHASE_PERIOD, 'phase_threshold': VENDOR_PHASE_THRESHOLD}
    unsaid = {key: value for key, value in of_phase.items() if key not in terms[phase]}
    assumed: Values = {} if 'period' in known else {'period': VENDOR_STEP_PERIOD}
    return assumed | ({'observation': {'terms': {phase: unsaid}}} if unsaid else {})


def _layouts(values: Mapping[str, str]) -> list[str]:
    """Return descriptions of histories that are not flattened."""
    key = 'observation_terms_flatten_history_dim'
    text = values.get(key, '')
    flags = [word.strip().lower() in {'false', '0', '0.000'} for word in text.split(',')]
    histories = _words(values.get('observation_terms_history_length', ''))
    stacked = [word.replace('.', '', 1).isdigit() and float(word) > 1 for word in histories]
    if len(flags) != len(stacked):
        flags = [any(flags)] * len(stacked)
    if not any(left and right for left, right in zip(flags, stacked, strict=True)):
        return []
    return [f'metadata {key} = {text}: a history must be flat']


def _entries(values: Mapping[str, str], key: str, count: int) -> list[list[float] | None]:
    """Return the numbers of each term; None if the key is missing."""
    if key not in values:
        return [None] * count
    try:
        entries = [[float(word) for word in entry.split(';')] for entry in _words(values[key])]
    except ValueError:
        raise PolicyError(
            f'metadata {key} {values[key]!r} is not a list of numbers (commas between terms, '
            f'semicolons between the numbers of one term)'
        ) from None
    if len(entries) != count:
        raise PolicyError(
            f'metadata {key} {values[key]!r} has {len(entries)} entries for {count} terms'
        )
    return list(entries)


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(',')]


def _numbers(values: Mapping[str, str], key: str) -> list[float]:
    try:
        numbers = [float(word) for word in _words(values[key])]
    except ValueError:
        raise PolicyError(f'metadata {key} {values[key]!r} is not a list of numbers') from None
    if not all(map(math.isfinite, numbers)):
        raise PolicyError(f'metadata {key} {values[key]!r} has a number that is not finite')
    return numbers


def _base_name(name: str) -> str:
    return name.rpartition('/')[2]


def changing(values: Mapping[str, str]) -> dict[str, str]:
    """Return keys, with values, that would change observations or actions."""
    return {
        key: text
        for key, text in values.items()
        if key not in KNOWN_KEYS and CHANGING.search(key) and not _neutral(key, text)
    }


def not_understood(values: Mapping[str, str]) -> dict[str, str]:
    """Return unknown keys, with values, that look relevant."""
    return {
        key: text
        for key, text in values.items()
        if key not in KNOWN_KEYS and SUSPICIOUS.search(key) and not CHANGING.search(key)
    }


def numbers_of(values: Mapping[str, str], keys: Iterable[str], place: int = 0) -> dict[str, float]:
    """Return one number from the value of each key; NaN if the value has none."""
    return {key: (_numbers_in(values[key]) or [math.nan])[place] for key in keys if key in values}


def _numbers_in(text: str) -> list[float]:
    return [float(word) for word in NUMBER.findall(text)]


def _neutral(key: str, text: str) -> bool:
    """Return whether a scale, clip or history changes nothing."""
    numbers = _numbers_in(text)
    if re.sub(r'none|[\s,\[\]()]', '', NUMBER.sub('', text), flags=re.IGNORECASE):
        return False  # words that are no list of numbers
    if 'scale' in key:
        return all(number == 1.0 for number in numbers)
    if 'clip' in key:
        return all(abs(number) >= NO_CLIP for number in numbers)
    return all(number in {0.0, 1.0} for number in numbers)

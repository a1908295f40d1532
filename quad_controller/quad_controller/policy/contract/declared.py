# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the metadata of a file say of its sizes and rate, and keys that nobody understands.

Nobody has agreed on these keys; those below are in use (unitree_rl_lab's deploy.yaml, rl_sar,
IsaacLab). The sizes are compared with the contract. What looks like one of them and is not
understood is reported, and what would change observations or actions is refused.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math
import re

STEP_KEYS = ('step_dt', 'control_dt', 'policy_dt')
"""Time between two steps in [s]."""

OBSERVATION_SIZE_KEYS = ('obs_dim', 'observation_dim', 'input_dim', 'num_obs', 'num_observations')
ACTION_SIZE_KEYS = ('action_dim', 'act_dim', 'output_dim', 'num_actions', 'num_joints', 'num_dofs')
SIZES_KEY = 'dims'
"""Both sizes: the first number is the observation's, the last one the action's."""

KNOWN_KEYS = frozenset(
    {
        'action_scale',
        'observation_terms_scale',
        'observation_terms_clip',
        'observation_terms_history_length',
        'observation_terms_flatten_history_dim',
        SIZES_KEY,
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


@dataclass(frozen=True, slots=True)
class Declared:
    """What the metadata of a file say beside the contract."""

    step_periods: Mapping[str, float]  # time between two steps in [s], by key
    observation_sizes: Mapping[str, float]  # width of the observation, by key
    action_sizes: Mapping[str, float]  # number of actions, by key
    unknown: Mapping[str, str]  # keys that look as if they mattered, with their values


def read_declared(values: Mapping[str, str]) -> Declared:
    """Read what metadata say of sizes and rate."""
    return Declared(
        step_periods(values), observation_sizes(values), action_sizes(values),
        not_understood(values),
    )  # fmt: skip


def step_periods(values: Mapping[str, str]) -> dict[str, float]:
    """Return the time between two steps in [s], by key; NaN for no number."""
    return {key: (_numbers(values[key]) or [math.nan])[0] for key in STEP_KEYS if key in values}


def observation_sizes(values: Mapping[str, str]) -> dict[str, float]:
    """Return the width of the observation, by key; NaN for no number."""
    return _ends(values, (*OBSERVATION_SIZE_KEYS, SIZES_KEY), 0)


def action_sizes(values: Mapping[str, str]) -> dict[str, float]:
    """Return the number of actions, by key; NaN for no number."""
    return _ends(values, (*ACTION_SIZE_KEYS, SIZES_KEY), -1)


def changing(values: Mapping[str, str]) -> dict[str, str]:
    """Return the keys that would change observations or actions, with their texts."""
    return {
        key: text
        for key, text in values.items()
        if key not in KNOWN_KEYS and CHANGING.search(key) and not _neutral(key, text)
    }


def not_understood(values: Mapping[str, str]) -> dict[str, str]:
    """Return the keys that look as if they mattered and are not known, with their texts."""
    return {
        key: text
        for key, text in values.items()
        if key not in KNOWN_KEYS and SUSPICIOUS.search(key) and not CHANGING.search(key)
    }


def _ends(values: Mapping[str, str], keys: Iterable[str], end: int) -> dict[str, float]:
    return {key: (_numbers(values[key]) or [math.nan])[end] for key in keys if key in values}


def _numbers(text: str) -> list[float]:
    return [float(word) for word in NUMBER.findall(text)]


def _neutral(key: str, text: str) -> bool:
    """Return whether a scale, clip or history changes nothing."""
    numbers = _numbers(text)
    if re.sub(r'none|[\s,\[\]()]', '', NUMBER.sub('', text), flags=re.IGNORECASE):
        return False  # words that are no list of numbers
    if 'scale' in key:
        return all(number == 1.0 for number in numbers)
    if 'clip' in key:
        return all(abs(number) >= NO_CLIP for number in numbers)
    return all(number in {0.0, 1.0} for number in numbers)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What an ONNX file has about its policy: the keys of mjlab's exporter, read leniently.

All values are texts; lists are joined by commas, numbers have three decimals (mjlab,
rl/exporter_utils.py). Newer exporters print nested lists as Python does. A joint may have a prefix
like ``robot/``. Keys of our own, which the exporters lack: :data:`OWN_KEYS`.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass
import math

from ..exceptions import PolicyError
from . import metadata_keys

OWN_KEYS = {
    'phase_period': 'period of the phase in [s]',
    'phase_command_threshold': 'a slower command has no phase',
    'imu_frame': 'frame of the angular velocity: base or yawed',
    'kind': 'how the policy was made',
}
"""Keys that only policies made by this package have."""


@dataclass(frozen=True, slots=True)
class PolicyMetadata:
    """What is known of a policy.

    Attributes:
        joint_names: Joints in the order of its actions.
        default_joint_pos: Positions that its actions are added to in [rad], in that order.
        action_scale: Positions in [rad] for an action of one, in that order.
        observation_names: Terms of its observation, in their order.
        phase_period: Period of the phase in [s], None where the file has none.
        phase_threshold: A command whose norm is smaller has no phase; None where there is none.
        imu_frame: Frame of the angular velocity, None where there is none.
        kind: How it was made; empty where there is none.
        step_periods: Time between two steps in [s], by key.
        observation_sizes: Width of the observation, by key.
        action_sizes: Number of actions, by key.
        unusual: Keys that would change observations or actions, with their values.
        unknown: Keys that look as if they mattered, with their values.
    """

    joint_names: tuple[str, ...]
    default_joint_pos: tuple[float, ...]
    action_scale: tuple[float, ...]
    observation_names: tuple[str, ...]
    phase_period: float | None
    phase_threshold: float | None
    imu_frame: str | None
    kind: str
    step_periods: Mapping[str, float]
    observation_sizes: Mapping[str, float]
    action_sizes: Mapping[str, float]
    unusual: Mapping[str, str]
    unknown: Mapping[str, str]


def read_metadata(values: Mapping[str, str]) -> PolicyMetadata:
    """Read the metadata of a file.

    Args:
        values: Keys and texts.

    Raises:
        PolicyError: A key is missing, or a text is not a number or a list.
    """
    names = tuple(_base_name(name) for name in _words(values, 'joint_names'))
    defaults = _numbers(values, 'default_joint_pos')
    scale = _numbers(values, 'action_scale')
    return PolicyMetadata(
        joint_names=names,
        default_joint_pos=defaults,
        action_scale=scale * len(names) if len(scale) == 1 else scale,
        observation_names=tuple(_base_name(name) for name in _words(values, 'observation_names')),
        phase_period=_optional(values, 'phase_period'),
        phase_threshold=_optional(values, 'phase_command_threshold'),
        imu_frame=values.get('imu_frame'),
        kind=values.get('kind', ''),
        step_periods=metadata_keys.step_periods(values),
        observation_sizes=metadata_keys.observation_sizes(values),
        action_sizes=metadata_keys.action_sizes(values),
        unusual=metadata_keys.changing(values),
        unknown=metadata_keys.not_understood(values),
    )


def _words(values: Mapping[str, str], key: str) -> list[str]:
    text = values.get(key)
    if text is None:
        known = ', '.join(sorted(values)) or 'nothing'
        raise PolicyError(f'the policy has no metadata {key!r}, only {known}; export it again')
    return _flat(text)


def _flat(text: str) -> list[str]:
    """Take a list apart, whether it is joined by commas or printed by Python."""
    if '[' not in text and '(' not in text:
        return [word.strip() for word in text.split(',')]
    try:
        tree = ast.literal_eval(text)
    except (SyntaxError, ValueError):
        return [text]
    flat, waiting = [], [tree]
    while waiting:
        item = waiting.pop(0)
        if isinstance(item, (list, tuple)):
            waiting[:0] = item
        else:
            flat.append(str(item))
    return flat


def _numbers(values: Mapping[str, str], key: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(word) for word in _words(values, key))
    except ValueError:
        raise PolicyError(f'metadata {key} {values[key]!r} is not a list of numbers') from None
    if not all(map(math.isfinite, numbers)):
        raise PolicyError(f'metadata {key} {values[key]!r} has a number that is not finite')
    return numbers


def _optional(values: Mapping[str, str], key: str) -> float | None:
    return _numbers(values, key)[0] if key in values else None


def _base_name(name: str) -> str:
    return name.rpartition('/')[2]

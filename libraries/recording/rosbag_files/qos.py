# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The QoS of publishers as rosbag2 writes it down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from .exceptions import BagError

UNLIMITED = 2**63 - 1  # the duration in [ns] that stands for no limit

_NANO = 1_000_000_000

# what rmw calls them, at their numbers, which versions before 9 of metadata.yaml have
_NAMES: Mapping[str, tuple[str, ...]] = {
    'history': ('system_default', 'keep_last', 'keep_all', 'unknown'),
    'reliability': ('system_default', 'reliable', 'best_effort', 'unknown', 'best_available'),
    'durability': ('system_default', 'transient_local', 'volatile', 'unknown', 'best_available'),
    'liveliness': (
        'system_default',
        'automatic',
        '',
        'manual_by_topic',
        'unknown',
        'best_available',
    ),
}
_DURATIONS = ('deadline', 'lifespan', 'liveliness_lease_duration')


@dataclass(frozen=True, slots=True)
class OfferedQos:
    """What a publisher offers. Durations are in [ns]; policies have the names of rmw.

    A subscription cannot find out history and depth of a publisher: they are `unknown` and 0 then.
    """

    history: str = 'unknown'
    depth: int = 0
    reliability: str = 'reliable'
    durability: str = 'volatile'
    deadline: int = UNLIMITED
    lifespan: int = UNLIMITED
    liveliness: str = 'automatic'
    liveliness_lease_duration: int = UNLIMITED
    avoid_ros_namespace_conventions: bool = False

    def to_dict(self) -> dict[str, Any]:
        """As it stands in metadata.yaml, version 9."""
        values = asdict(self)
        for name in _DURATIONS:
            seconds, rest = divmod(values[name], _NANO)
            values[name] = {'sec': seconds, 'nsec': rest}
        return values


def read_qos(values: object, where: str) -> OfferedQos:
    """Read a QoS profile of metadata.yaml, or of a file with overrides.

    What is left out of the mapping has its default; `where` stands in messages.

    Raises:
        BagError: A key or a value that no QoS profile has.
    """
    if not isinstance(values, Mapping):
        raise BagError(f'{where}: a QoS profile is a mapping, not {values!r}')
    known = OfferedQos.__dataclass_fields__
    if unknown := [key for key in values if key not in known]:
        raise BagError(f'{where}: unknown key {unknown[0]!r}; choose from {", ".join(known)}')
    return OfferedQos(**{key: _value(key, value, where) for key, value in values.items()})


def _value(key: str, value: object, where: str) -> Any:  # noqa: ANN401  # as the field has it
    if key in _NAMES:
        return _policy(key, value, where)
    if key in _DURATIONS:
        return _duration(key, value, where)
    expected = bool if key == 'avoid_ros_namespace_conventions' else int
    if type(value) is not expected or value < 0:
        raise BagError(f'{where}: {key} is {value!r}, not {expected.__name__} of 0 or more')
    return value


def _policy(key: str, value: object, where: str) -> str:
    names = _NAMES[key]
    if isinstance(value, int) and 0 <= value < len(names):
        return names[value]
    if value not in names or not isinstance(value, str):
        choice = ', '.join(filter(None, names))
        raise BagError(f'{where}: unknown {key} {value!r}; choose one of {choice}')
    return value


def _duration(key: str, value: object, where: str) -> int:
    if isinstance(value, Mapping) and set(value) <= {'sec', 'nsec'}:
        parts = [value.get('sec', 0), value.get('nsec', 0)]
        if all(isinstance(part, int) and part >= 0 for part in parts):
            # 0 and more than 2**63 - 1 are other ways to write that there is no limit
            return min(parts[0] * _NANO + parts[1], UNLIMITED) or UNLIMITED
    raise BagError(f'{where}: {key} is {value!r}; write it as {{sec: 1, nsec: 0}}')

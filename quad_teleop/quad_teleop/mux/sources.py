# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the multiplexer listens to, read from parameters as twist_mux 4 names them.

``topics.<name>.{topic, timeout, priority}`` and ``locks.<name>.{topic, timeout, priority}``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import difflib
import math

from ..exceptions import SettingError

MAX_PRIORITY = 255
FIELDS = ('topic', 'timeout', 'priority')


@dataclass(frozen=True, slots=True)
class Input:
    """A topic with velocities, or one with a lock.

    Attributes:
        name: Name among the parameters.
        topic: Name of the topic.
        timeout: Silence after which it is stale [s]; 0 for never.
        priority: 0 to 255; of those that publish, the highest is active.

    Raises:
        SettingError: A value makes no sense; the message names it.
    """

    name: str
    topic: str
    timeout: float
    priority: int

    def __post_init__(self) -> None:
        """Check the values."""
        if not self.topic:
            raise SettingError(f'{self.name}.topic is empty: name the topic')
        if not 0.0 <= self.timeout < math.inf:
            raise SettingError(
                f'{self.name}.timeout is {self.timeout}: it must be a time in [s], or 0 for never'
            )
        if not 0 <= self.priority <= MAX_PRIORITY:
            raise SettingError(
                f'{self.name}.priority is {self.priority}: it must be 0 to {MAX_PRIORITY}'
            )

    def is_stale(self, received: float, now: float) -> bool:
        """Return whether it has been silent for too long.

        Args:
            received: When it was received last [s].
            now: Time [s].
        """
        return self.timeout > 0.0 and now - received > self.timeout


@dataclass(frozen=True, slots=True)
class Inputs:
    """All that the multiplexer subscribes.

    Attributes:
        sources: Velocities, in the order of their names.
        locks: Locks, in the order of their names.
    """

    sources: tuple[Input, ...]
    locks: tuple[Input, ...]


DEFAULTS = Inputs(
    sources=(
        Input('joystick', 'joy_vel', 0.5, 100),
        Input('keyboard', 'key_vel', 0.5, 90),
        Input('navigation', 'nav_vel', 0.5, 10),
    ),
    locks=(
        Input('e_stop', 'e_stop', 0.0, 255),
        Input('pause_navigation', 'pause_navigation', 0.0, 50),
    ),
)
"""What is used without any parameters."""


def read_inputs(topics: Mapping[str, object], locks: Mapping[str, object]) -> Inputs:
    """Read the parameters.

    Args:
        topics: Values below ``topics.``, by what follows it: ``keyboard.topic``.
        locks: Values below ``locks.``.

    Returns:
        The inputs; :data:`DEFAULTS` when there is not one parameter.

    Raises:
        SettingError: One is misspelt, missing or wrong; the message names it.
    """
    if not topics and not locks:
        return DEFAULTS
    sources = _read('topics', topics)
    if not sources:
        raise SettingError('there are locks but no topics: nothing could ever be forwarded')
    inputs = Inputs(sources, _read('locks', locks))
    seen: dict[str, str] = {}
    for each in (*inputs.sources, *inputs.locks):
        if each.topic in seen:
            raise SettingError(f'{seen[each.topic]} and {each.name} both name {each.topic!r}')
        seen[each.topic] = each.name
    return inputs


def _read(group: str, values: Mapping[str, object]) -> tuple[Input, ...]:
    fields: dict[str, dict[str, object]] = {}
    for path, value in sorted(values.items()):
        name, _, field = path.rpartition('.')
        if not name or field not in FIELDS:
            close = difflib.get_close_matches(field, FIELDS, n=1)
            hint = f'; did you mean {close[0]!r}?' if close else f'; there are {", ".join(FIELDS)}'
            raise SettingError(f'unknown parameter {group}.{path}{hint}')
        fields.setdefault(name, {})[field] = value
    return tuple(_input(f'{group}.{name}', name, found) for name, found in fields.items())


def _input(path: str, name: str, found: Mapping[str, object]) -> Input:
    missing = [field for field in FIELDS if field not in found]
    if missing:
        raise SettingError(f'{path}.{missing[0]} is missing')
    topic, timeout, priority = (found[field] for field in FIELDS)
    if not isinstance(topic, str):
        raise SettingError(f'{path}.topic is {topic!r}: it must be the name of a topic')
    if isinstance(timeout, bool) or not isinstance(timeout, float | int):
        raise SettingError(f'{path}.timeout is {timeout!r}: it must be a time in [s]')
    if isinstance(priority, bool) or not isinstance(priority, int):
        raise SettingError(f'{path}.priority is {priority!r}: it must be a whole number')
    return Input(name, topic, float(timeout), priority)

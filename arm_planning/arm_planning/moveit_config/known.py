# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of MoveIt's move_group that have an effect here, by their names, and their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import difflib
from functools import cache
import math
import re
from typing import Any, NamedTuple

from ..exceptions import ConfigError
from .yaml_file import Place

PLANNING = 'robot_description_planning.'
LIMITS, CARTESIAN = f'{PLANNING}joint_limits', f'{PLANNING}cartesian_limits'
KINEMATICS = 'robot_description_kinematics'
MANAGER, EXECUTION = 'moveit_simple_controller_manager', 'trajectory_execution'


class Kind(NamedTuple):
    """What a value must be."""

    words: str  # in words
    fits: Callable[[Any], bool]  # whether a value is that


def _in(least: float, most: float = math.inf, *, beyond: bool = False) -> Callable[[Any], bool]:
    """Return whether a value is a number within bounds, or beyond the least one only."""

    def fits(value: object) -> bool:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (is_number and math.isfinite(value)):  # type: ignore[arg-type]
            return False
        return least <= value <= most and not (beyond and value == least)  # type: ignore[operator]

    return fits


TEXT = Kind('a text', lambda value: isinstance(value, str))
FLAG = Kind('true or false', lambda value: isinstance(value, bool))
TEXTS = Kind(
    'a list of texts',
    lambda value: isinstance(value, list | tuple) and all(isinstance(each, str) for each in value),
)
NUMBER = Kind('a number', _in(-math.inf))
FACTOR = Kind('a number above 0, up to 1', _in(0.0, 1.0, beyond=True))
POSITIVE = Kind('a positive number', _in(0.0, beyond=True))
NEGATIVE = Kind('a negative number', lambda value: NUMBER.fits(value) and value < 0.0)
FROM_ZERO = Kind('a number of 0 or more', _in(0.0))
FROM_ONE = Kind('a number of 1 or more', _in(1.0))

_LIMITED = ('position', 'velocity', 'acceleration', 'jerk', 'deceleration', 'effort')
_BOUNDS = ('min_position', *(f'max_{each}' for each in _LIMITED))

KNOWN: Mapping[str, Kind] = {
    'robot_description': TEXT,
    'robot_description_semantic': TEXT,
    f'{KINEMATICS}.*.kinematics_solver_timeout': FROM_ZERO,
    f'{PLANNING}default_velocity_scaling_factor': FACTOR,
    f'{PLANNING}default_acceleration_scaling_factor': FACTOR,
    **{f'{LIMITS}.*.has_{each}_limits': FLAG for each in _LIMITED},
    **{f'{LIMITS}.*.{each}': NUMBER for each in _BOUNDS},
    f'{LIMITS}.*.angle_wraparound': FLAG,
    f'{CARTESIAN}.max_trans_vel': POSITIVE,
    f'{CARTESIAN}.max_trans_acc': POSITIVE,
    f'{CARTESIAN}.max_trans_dec': NEGATIVE,
    f'{CARTESIAN}.max_rot_vel': POSITIVE,
    'planning_pipelines': TEXTS,
    'planning_pipelines.pipeline_names': TEXTS,
    'default_planning_pipeline': TEXT,
    'ompl.planner_configs.*.type': TEXT,
    'ompl.*.planner_configs': TEXTS,
    'ompl.*.default_planner_config': TEXT,
    'pilz_industrial_motion_planner.default_planner_config': TEXT,
    f'{MANAGER}.controller_names': TEXTS,
    f'{MANAGER}.*.type': TEXT,
    f'{MANAGER}.*.action_ns': TEXT,
    f'{MANAGER}.*.default': FLAG,
    f'{MANAGER}.*.joints': TEXTS,
    f'{MANAGER}.*.command_joint': TEXT,
    f'{MANAGER}.*.max_effort': FROM_ZERO,
    f'{EXECUTION}.allowed_start_tolerance': FROM_ZERO,
    f'{EXECUTION}.allowed_execution_duration_scaling': FROM_ONE,
    f'{EXECUTION}.allowed_goal_duration_margin': FROM_ZERO,
    f'{EXECUTION}.execution_duration_monitoring': FLAG,
    'allow_trajectory_execution': FLAG,
}
"""Names, in which ``*`` is one key; the first that matches counts."""

WITHOUT_EFFECT = frozenset(
    {
        *('kinematics_solver', 'kinematics_solver_search_resolution'),
        *('kinematics_solver_attempts', 'max_rot_acc', 'max_rot_dec'),
        *('publish_robot_description', 'publish_robot_description_semantic'),
    }
)
"""Keys of MoveIt that have no effect here and look like some that have."""

ALIKE = 0.8  # how much a key that is misspelt resembles the right one, of 1

CLOSED = (f'{LIMITS}.', f'{CARTESIAN}.')
"""Tables whose keys are all known: another one is misspelt."""


@cache
def _pattern(name: str) -> re.Pattern[str]:
    return re.compile(re.escape(name).replace(r'\*', '[^.]+'))


def known_of(name: str) -> Kind | None:
    """Return what the value of a parameter must be; None for a name that has no effect."""
    found = (kind for known, kind in KNOWN.items() if _pattern(known).fullmatch(name))
    return next(found, None)


def at(name: str, places: Mapping[str, Place]) -> str:
    """Return a name with its place, for the beginning of a message."""
    return f'{places[name]}: {name}' if name in places else name


def check(values: Mapping[str, object], places: Mapping[str, Place]) -> None:
    """Refuse a value of the wrong kind, and misspelt names of limits.

    Args:
        values: Parameters by name; others than MoveIt's are passed over.
        places: Where they come from, of those that come from a file.

    Raises:
        ConfigError: There is one; the message has its place, its name and what it must be.
    """
    for name, value in values.items():
        kind = known_of(name)
        if kind is not None:
            if not kind.fits(value):
                raise ConfigError(f'{at(name, places)} is {value!r}; it must be {kind.words}')
        elif name.startswith(PLANNING):
            table, _, key = name.rpartition('.')
            close = _meant(name)
            if close or (name.startswith(CLOSED) and key not in WITHOUT_EFFECT):
                hint = f'did you mean {close!r}?' if close else f'it has {", ".join(_keys(table))}'
                raise ConfigError(f'{at(name, places)}: {table} has no {key!r}; {hint}')


def _keys(table: str) -> list[str]:
    """Return the keys that are known in a table."""
    keys = [name.rpartition('.') for name in KNOWN]
    return [key for above, _, key in keys if above and _pattern(above).fullmatch(table)]


def _meant(name: str) -> str:
    """Return the key of its table that an unknown name resembles; empty for none."""
    table, _, key = name.rpartition('.')
    close = difflib.get_close_matches(key, _keys(table), 1, ALIKE)
    return close[0] if close and key not in WITHOUT_EFFECT else ''


def misspelt(names: Sequence[str], places: Mapping[str, Place]) -> list[str]:
    """Return a line for each parameter without effect that resembles one that has some.

    Args:
        places: Where they come from, of those that come from a file.
    """
    meant = {name: _meant(name) for name in names if known_of(name) is None}
    return [
        f'{at(name, places)}: without effect; did you mean {key!r}?'
        for name, key in meant.items()
        if key
    ]

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of MoveIt's move_group that count here, by their names: what they must be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import difflib
import math
import re

from ..exceptions import ConfigError
from .yaml_file import Place

LIMITS = 'robot_description_planning.joint_limits'
CARTESIAN = 'robot_description_planning.cartesian_limits'
KINEMATICS = 'robot_description_kinematics'
MANAGER = 'moveit_simple_controller_manager'
PLANNING = 'robot_description_planning.'


@dataclass(frozen=True, slots=True)
class Known:
    """A parameter, or several alike."""

    pattern: str  # its name; ``*`` is one key, ``**`` one or more
    needed: str = ''  # what its value must be, in words; empty for anything
    fits: Callable[[object], bool] = lambda _: True  # whether a value is that

    def matches(self, name: str) -> bool:
        """Return whether a name is one of these."""
        keys = re.escape(self.pattern).replace(r'\*\*', '.+').replace(r'\*', '[^.]+')
        return re.fullmatch(keys, name) is not None


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def number(pattern: str, least: float = -math.inf, most: float = math.inf) -> Known:
    """Return a number within bounds."""
    bounds = f' of {least:g} to {most:g}' if math.isfinite(most) else f' of {least:g} or more'
    words = f'a number{bounds}' if math.isfinite(least) else 'a number'
    return Known(
        pattern,
        words,
        lambda value: _is_number(value) and least <= value <= most,  # type: ignore[operator]
    )


def factor(pattern: str) -> Known:
    """Return a factor of limits."""
    words = 'a number above 0, up to 1'
    return Known(pattern, words, lambda value: _is_number(value) and 0.0 < value <= 1.0)  # type: ignore[operator]


def signed(pattern: str, sign: float) -> Known:
    """Return a number that is positive, or negative."""
    words = 'a positive number' if sign > 0 else 'a negative number'
    return Known(pattern, words, lambda value: _is_number(value) and value * sign > 0.0)  # type: ignore[operator]


def flag(pattern: str) -> Known:
    """Return parameters that are on or off."""
    return Known(pattern, 'true or false', lambda value: isinstance(value, bool))


def text(pattern: str) -> Known:
    """Return parameters with a string, whatever is in it."""
    return Known(pattern, 'a text', lambda value: isinstance(value, str))


def texts(pattern: str) -> Known:
    """Return parameters with strings in order."""

    def fits(value: object) -> bool:
        is_list = isinstance(value, Sequence) and not isinstance(value, str | bytes)
        return is_list and all(isinstance(each, str) for each in value)  # type: ignore[attr-defined]

    return Known(pattern, 'a list of texts', fits)


KNOWN: Sequence[Known] = (
    text('robot_description'),
    text('robot_description_semantic'),
    number(f'{KINEMATICS}.*.kinematics_solver_timeout', 0.0),
    factor('robot_description_planning.default_velocity_scaling_factor'),
    factor('robot_description_planning.default_acceleration_scaling_factor'),
    *(
        flag(f'{LIMITS}.*.has_{kind}_limits')
        for kind in ('position', 'velocity', 'acceleration', 'jerk', 'deceleration', 'effort')
    ),
    flag(f'{LIMITS}.*.angle_wraparound'),
    *(
        number(f'{LIMITS}.*.{key}')
        for key in (
            *('min_position', 'max_position', 'max_velocity', 'max_acceleration'),
            *('max_deceleration', 'max_jerk', 'max_effort'),
        )
    ),
    signed(f'{CARTESIAN}.max_trans_vel', 1.0),
    signed(f'{CARTESIAN}.max_trans_acc', 1.0),
    signed(f'{CARTESIAN}.max_trans_dec', -1.0),
    signed(f'{CARTESIAN}.max_rot_vel', 1.0),
    texts('planning_pipelines'),
    texts('planning_pipelines.pipeline_names'),
    text('default_planning_pipeline'),
    text('ompl.planner_configs.*.type'),
    texts('ompl.*.planner_configs'),
    text('ompl.*.default_planner_config'),
    text('pilz_industrial_motion_planner.default_planner_config'),
    texts(f'{MANAGER}.controller_names'),
    text(f'{MANAGER}.*.type'),
    text(f'{MANAGER}.*.action_ns'),
    flag(f'{MANAGER}.*.default'),
    texts(f'{MANAGER}.*.joints'),
    text(f'{MANAGER}.*.command_joint'),
    number(f'{MANAGER}.*.max_effort', 0.0),
    number('trajectory_execution.allowed_start_tolerance', 0.0),
    number('trajectory_execution.allowed_execution_duration_scaling', 1.0),
    number('trajectory_execution.allowed_goal_duration_margin', 0.0),
    flag('trajectory_execution.execution_duration_monitoring'),
    flag('allow_trajectory_execution'),
)
"""All of them; the first that matches counts."""

WITHOUT_EFFECT = frozenset(
    {
        *('kinematics_solver', 'kinematics_solver_search_resolution'),
        *('kinematics_solver_attempts', 'max_rot_acc', 'max_rot_dec'),
        *('publish_robot_description', 'publish_robot_description_semantic'),
    }
)
"""Keys of MoveIt that do not count here and look like some that do."""

ALIKE = 0.8  # how much a key that is misspelt resembles the right one, of 1

CLOSED = (f'{LIMITS}.', f'{CARTESIAN}.')
"""Tables whose keys are all known: another one is misspelt."""


def known_of(name: str) -> Known | None:
    """Return what is known of a name."""
    return next((each for each in KNOWN if each.matches(name)), None)


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
        found = known_of(name)
        if found is not None:
            if not found.fits(value):
                raise ConfigError(f'{at(name, places)} is {value!r}; it must be {found.needed}')
        elif name.startswith(PLANNING):
            table, _, key = name.rpartition('.')
            close = _meant(name)
            if close or (name.startswith(CLOSED) and key not in WITHOUT_EFFECT):
                hint = f'did you mean {close!r}?' if close else f'it has {", ".join(_keys(table))}'
                raise ConfigError(f'{at(name, places)}: {table} has no {key!r}; {hint}')


def _keys(table: str) -> list[str]:
    """Return the keys that are known in a table."""
    keys = [each.pattern.rpartition('.') for each in KNOWN]
    return [key for above, _, key in keys if above and Known(above).matches(table)]


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

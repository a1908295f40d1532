# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of MoveIt's move_group that have an effect here, and the settings they make."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import difflib
from functools import cache
import math
import re
from typing import Any, NamedTuple

from .exceptions import ConfigError
from .moveit_package import Place, PLANNING

LIMITS, CARTESIAN = f'{PLANNING}joint_limits', f'{PLANNING}cartesian_limits'
KINEMATICS = 'robot_description_kinematics'
MANAGER, EXECUTION = 'moveit_simple_controller_manager', 'trajectory_execution'


class Kind(NamedTuple):
    """What a value must be."""

    words: str  # in words
    fits: Callable[[Any], bool]  # whether a value is that


def _in(least: float, most: float = math.inf, *, beyond: bool = False) -> Callable[[Any], bool]:
    """Return a check that a value is a number within bounds; ``beyond`` excludes the lower."""

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
"""Patterns of parameter names; ``*`` matches one key, and the first match applies."""

WITHOUT_EFFECT = frozenset(
    {
        *('kinematics_solver', 'kinematics_solver_search_resolution'),
        *('kinematics_solver_attempts', 'max_rot_acc', 'max_rot_dec'),
        *('publish_robot_description', 'publish_robot_description_semantic'),
    }
)
"""MoveIt keys without effect here that resemble keys with effect."""

ALIKE = 0.8  # how much a key that is misspelt resembles the right one, of 1

CLOSED = (f'{LIMITS}.', f'{CARTESIAN}.')
"""Tables whose keys are all known: any other key is misspelt."""


@cache
def _pattern(name: str) -> re.Pattern[str]:
    return re.compile(re.escape(name).replace(r'\*', '[^.]+'))


def known_of(name: str) -> Kind | None:
    """Return the kind of value that a parameter takes; None for a name without effect."""
    found = (kind for known, kind in KNOWN.items() if _pattern(known).fullmatch(name))
    return next(found, None)


def at(name: str, places: Mapping[str, Place]) -> str:
    """Return a name with its place, to begin a message."""
    return f'{places[name]}: {name}' if name in places else name


def check(values: Mapping[str, object], places: Mapping[str, Place]) -> None:
    """Refuse a value of the wrong kind, and misspelt limit names, with place and name.

    Parameters that MoveIt does not know are ignored.
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
    """Return the known keys of a table."""
    keys = [name.rpartition('.') for name in KNOWN]
    return [key for above, _, key in keys if above and _pattern(above).fullmatch(table)]


def _meant(name: str) -> str:
    """Return the known key of the table that an unknown name resembles; empty for none."""
    table, _, key = name.rpartition('.')
    close = difflib.get_close_matches(key, _keys(table), 1, ALIKE)
    return close[0] if close and key not in WITHOUT_EFFECT else ''


def misspelt(names: Sequence[str], places: Mapping[str, Place]) -> list[str]:
    """Return a warning for each parameter without effect that resembles one with effect."""
    meant = {name: _meant(name) for name in names if known_of(name) is None}
    return [
        f'{at(name, places)}: without effect; did you mean {key!r}?'
        for name, key in meant.items()
        if key
    ]


TIMEOUT = 'kinematics_solver_timeout'
TYPE = 'type'  # key of what searches, in a planner configuration
PIPELINES = ('ompl', 'pilz_industrial_motion_planner')  # planning pipelines that are here


@dataclass(frozen=True, slots=True)
class PlannerConfigs:
    """Planner names that clients may request, from ompl_planning.yaml."""

    # entries of each configuration, by its name
    configs: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    # names of the configurations of each group
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    # that of a group whose requests name none
    defaults: Mapping[str, str] = field(default_factory=dict)

    @property
    def ids(self) -> Sequence[str]:
        """Planner ids as MoveIt lists them: the group, and the group with each configuration."""
        return [
            name
            for group, configs in self.groups.items()
            for name in (group, *(f'{group}[{config}]' for config in configs))
        ]

    def name(self, planner_id: str, group: str) -> str:
        """Return the configuration that a client names: ``x``, ``group[x]``, group or nothing."""
        name = planner_id.removeprefix(f'{group}[').removesuffix(']')
        return self.defaults.get(group, '') if name in {'', group} else name

    def search(self, name: str) -> str:
        """Return the OMPL name of the planner of a configuration; empty if it is unknown."""
        listed = {each for names in self.groups.values() for each in names}
        if not self.configs and name in listed:  # by the names of MoveIt's own configurations
            return f'geometric::{name.removesuffix("ConfigDefault").removesuffix("k")}'
        return str(self.configs.get(name, {}).get(TYPE, ''))


@dataclass(frozen=True, slots=True)
class MoveItSettings:
    """Settings from MoveIt's parameters; the defaults apply where none is set."""

    # tables of limits by joint; None where no parameter has any
    joint_limits: Mapping[str, Mapping[str, object]] | None = None
    cartesian_limits: Mapping[str, object] = field(default_factory=dict)  # limits of LIN and CIRC
    velocity_scaling: float = 1.0  # factor of requests that have none
    acceleration_scaling: float = 1.0  # factor of requests that have none
    # time for inverse kinematics in [s], by group
    ik_timeouts: Mapping[str, float] = field(default_factory=dict)
    planners: PlannerConfigs = field(default_factory=PlannerConfigs)  # planner configurations
    default_pipeline: str = ''  # of requests that name none; empty for ours
    default_industrial: str = 'PTP'  # planner of requests to Pilz' pipeline that name none
    sensors: Sequence[str] = ()  # names of updaters of octomaps, whose tables have no effect


def read_settings(
    values: Mapping[str, object], places: Mapping[str, Place] | None = None
) -> MoveItSettings:
    """Read settings from parameters; refuse invalid values and unknown names."""
    places = places or {}
    check(values, places)
    defaults = _below(values, PLANNING.rstrip('.'))
    has_limits = LIMITS in places or any(name.startswith(f'{LIMITS}.') for name in values)
    listed = values.get('sensors')
    sensors = [str(each) for each in listed] if isinstance(listed, list | tuple) else []
    return MoveItSettings(
        joint_limits=_tables(values, LIMITS) if has_limits else None,
        cartesian_limits=_below(values, CARTESIAN),
        velocity_scaling=_number(defaults.get('default_velocity_scaling_factor', 1.0)),
        acceleration_scaling=_number(defaults.get('default_acceleration_scaling_factor', 1.0)),
        ik_timeouts={
            group: _number(table[TIMEOUT])
            for group, table in _tables(values, KINEMATICS).items()
            if TIMEOUT in table
        },
        planners=_planners(values, places),
        default_pipeline=_pipeline(values, places),
        default_industrial=_industrial(values, places),
        sensors=sensors,
    )


def of_nothing(
    names: Sequence[str],
    places: Mapping[str, Place],
    groups: Sequence[str],
    joints: Sequence[str],
    controllers: Sequence[str],
) -> list[str]:
    """Return a warning for each table of an unknown group, joint or controller.

    MoveIt ignores such tables silently.
    """
    lines = []
    for above, kind, known in (
        (KINEMATICS, 'group', groups),
        ('ompl', 'group', groups),
        (LIMITS, 'movable joint', joints),
        (MANAGER, 'controller', controllers),
    ):
        for name, entries in _tables(dict.fromkeys(names), above).items():
            if name.partition('.')[0] in {*known, 'planner_configs'}:
                continue
            first = f'{above}.{name}.{next(iter(entries))}'
            place = f'{places[first]}: ' if first in places else ''
            lines.append(
                f'{place}{above}.{name}: without effect, there is no {kind} {name!r};'
                f' {kind}s: {", ".join(known)}'
            )
    return lines


def _below(values: Mapping[str, object], table: str) -> dict[str, object]:
    """Return the entries of a table, without nested tables."""
    names = {
        name: name.removeprefix(f'{table}.') for name in values if name.startswith(f'{table}.')
    }
    return {key: values[name] for name, key in names.items() if '.' not in key}


def _tables(values: Mapping[str, object], above: str) -> dict[str, dict[str, object]]:
    """Return the tables in a table, by name."""
    found: dict[str, dict[str, object]] = {}
    for name, value in values.items():
        if name.startswith(f'{above}.'):
            table, _, key = name.removeprefix(f'{above}.').rpartition('.')
            if table:
                found.setdefault(table, {})[key] = value
    return found


def _number(value: object) -> float:
    return float(value)  # type: ignore[arg-type]  # it was checked


def _planners(values: Mapping[str, object], places: Mapping[str, Place]) -> PlannerConfigs:
    configs = _tables(values, 'ompl.planner_configs')
    tables = {
        group: table
        for group, table in _tables(values, 'ompl').items()
        if not group.startswith('planner_configs')
    }
    groups: dict[str, Sequence[str]] = {}
    defaults: dict[str, str] = {}
    for group, table in tables.items():
        names = table.get('planner_configs')
        listed = [str(each) for each in names] if isinstance(names, Sequence) else list(configs)
        default = table.get('default_planner_config')
        for key, given in (('planner_configs', listed), ('default_planner_config', [default])):
            for name in given:
                if configs and name is not None and name not in configs:
                    raise ConfigError(
                        f'{at(f"ompl.{group}.{key}", places)} names {name!r}, which'
                        f' ompl.planner_configs does not have; it has'
                        f' {", ".join(configs)}'
                    )
        groups[group] = listed
        if default is not None:
            defaults[group] = str(default)
    return PlannerConfigs(configs, groups, defaults)


def _pipeline(values: Mapping[str, object], places: Mapping[str, Place]) -> str:
    name = str(values.get('default_planning_pipeline', ''))
    listed = values.get('planning_pipelines.pipeline_names', values.get('planning_pipelines', ()))
    names = [str(each) for each in listed] if isinstance(listed, Sequence) else []
    if name and names and name not in names:
        raise ConfigError(
            f'{at("default_planning_pipeline", places)} is {name!r}, and planning_pipelines has'
            f' {", ".join(names)}; choose one of them'
        )
    return name if name in PIPELINES else ''


def _industrial(values: Mapping[str, object], places: Mapping[str, Place]) -> str:
    key = 'pilz_industrial_motion_planner.default_planner_config'
    name = str(values.get(key, 'PTP'))
    if name not in {'PTP', 'LIN', 'CIRC'}:
        raise ConfigError(f'{at(key, places)} is {name!r}; it must be PTP, LIN or CIRC')
    return name

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of MoveIt's move_group by their names: what they must be, and what has no effect."""

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

OWN_IK = 'inverse kinematics is closed form where the arm has one, else a numeric one of its own'
OWN_PLANNERS = "RRT-Connect and Pilz' motions are built in, checked and timed without plug-ins"
MEASURED = 'paths are measured everywhere, not at samples'
OWN_SEARCH = 'the search sets itself up'
NO_PIPELINE = 'this planning pipeline is not here'
DIRECT = 'controllers are reached by their actions, and switched by nobody'
ALWAYS = 'all capabilities and topics are there always'
NO_SENSORS = 'there are no updaters of octomaps; send octomaps with planning scenes'
ONE_ROTATION = "Pilz' planner uses the velocity of rotation only"
NO_DATABASE = 'there is no warehouse'
NO_MOVEIT_CPP = 'these are of MoveItCpp'


@dataclass(frozen=True, slots=True)
class Known:
    """A parameter, or several alike."""

    pattern: str  # its name; ``*`` is one key, ``**`` one or more
    needed: str = ''  # what its value must be, in words; empty for anything
    fits: Callable[[object], bool] = lambda _: True  # whether a value is that
    reason: str = ''  # why it has no effect; empty where it has one

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


def ignored(reason: str, *patterns: str) -> list[Known]:
    """Return parameters that have no effect."""
    return [Known(pattern, reason=reason) for pattern in patterns]


KNOWN: Sequence[Known] = (
    text('robot_description'),
    text('robot_description_semantic'),
    number(f'{KINEMATICS}.*.kinematics_solver_timeout', 0.0),
    *ignored(
        OWN_IK,
        *(
            f'{KINEMATICS}.*.kinematics_solver{part}'
            for part in ('', '_search_resolution', '_attempts')
        ),
        f'{KINEMATICS}.**',
    ),
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
    *ignored(ONE_ROTATION, f'{CARTESIAN}.max_rot_acc', f'{CARTESIAN}.max_rot_dec'),
    texts('planning_pipelines'),
    texts('planning_pipelines.pipeline_names'),
    *ignored(NO_MOVEIT_CPP, 'planning_pipelines.**'),
    text('default_planning_pipeline'),
    text('ompl.planner_configs.*.type'),
    *ignored(OWN_SEARCH, 'ompl.planner_configs.*.*'),
    texts('ompl.*.planner_configs'),
    text('ompl.*.default_planner_config'),
    text('pilz_industrial_motion_planner.default_planner_config'),
    *ignored(
        MEASURED, 'ompl.*.longest_valid_segment_fraction', 'ompl.longest_valid_segment_fraction'
    ),
    *ignored(OWN_PLANNERS, 'ompl.**', 'pilz_industrial_motion_planner.**'),
    *ignored(NO_PIPELINE, 'chomp.**', 'stomp.**', 'trajopt.**', 'lerp.**'),
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
    *ignored(DIRECT, f'{MANAGER}.**', 'moveit_controller_manager', 'moveit_manage_controllers'),
    *ignored(DIRECT, 'moveit_ros_control_interface.**', 'trajectory_execution.**'),
    *ignored(
        ALWAYS,
        *('capabilities', 'disable_capabilities', 'monitor_dynamics'),
        *('publish_robot_description', 'publish_robot_description_semantic'),
        *('publish_planning_scene', 'publish_geometry_updates'),
        *('publish_state_updates', 'publish_transforms_updates', 'publish_planning_scene_hz'),
    ),
    *ignored(
        NO_SENSORS, 'sensors', 'sensors.**', 'octomap_frame', 'octomap_resolution', 'max_range'
    ),
    *ignored(NO_DATABASE, 'warehouse_host', 'warehouse_port', 'warehouse_plugin', 'warehouse.**'),
    *ignored(NO_MOVEIT_CPP, 'planning_scene_monitor_options.**', 'plan_request_params.**'),
    *ignored(NO_MOVEIT_CPP, 'planning_scene_monitor.**', 'plan_execution.**', 'sense_for_plan.**'),
)
"""All of them; the first that matches counts."""

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
    """Refuse a value that is none.

    Args:
        values: Parameters by name; others than MoveIt's are passed over.
        places: Where they come from, of those that come from a file.

    Raises:
        ConfigError: There is one; the message has its place, its name and what it must be.
    """
    for name, value in values.items():
        found = known_of(name)
        if found is None:
            table, _, key = name.rpartition('.')
            keys = _keys(table)
            close = difflib.get_close_matches(key, keys, 1, ALIKE)
            if close or name.startswith(CLOSED):
                hint = f'did you mean {close[0]!r}?' if close else f'it has {", ".join(keys)}'
                raise ConfigError(f'{at(name, places)}: {table} has no {key!r}; {hint}')
        elif not found.fits(value):
            raise ConfigError(f'{at(name, places)} is {value!r}; it must be {found.needed}')


def _keys(table: str) -> list[str]:
    """Return the keys that are known in a table."""
    keys = [each.pattern.rpartition('.') for each in KNOWN if not each.reason]
    return [key for above, _, key in keys if above and Known(above).matches(table)]


def misspelt(names: Sequence[str], places: Mapping[str, Place]) -> list[str]:
    """Return a line for each parameter without effect that resembles one that has some.

    Args:
        places: Where they come from, of those that come from a file.
    """
    lines = []
    for name in names:
        found, (table, _, key) = known_of(name), name.rpartition('.')
        if found is not None and found.reason and found.pattern.endswith('**'):
            close = difflib.get_close_matches(key, _keys(table), 1, ALIKE)
            lines += [
                f'{at(name, places)}: without effect; did you mean {each!r}?' for each in close
            ]
    return lines


def without_effect(names: Sequence[str], sensors: Sequence[str] = ()) -> list[str]:
    """Return a line for each reason why parameters have no effect, with their names.

    Args:
        sensors: Names of updaters of octomaps, which have tables of their own.
    """
    reasons: dict[str, dict[str, None]] = {}
    for name in names:
        found, table = known_of(name), name.partition('.')[0]
        if found is None and table in sensors:
            reasons.setdefault(NO_SENSORS, {})[f'{table}.*'] = None
        elif found is not None and found.reason:
            key = name.rpartition('.')[2]
            shown = f'ompl.planner_configs.*.{key}' if found.reason is OWN_SEARCH else name
            reasons.setdefault(found.reason, {})[shown] = None
    return [f'{", ".join(shown)}: without effect, {reason}' for reason, shown in reasons.items()]

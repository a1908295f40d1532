# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint limits: from the URDF, narrowed by a limits file.

The file has MoveIt's format (joint_limits.yaml)::

    joint_limits:
      joint_1:
        has_velocity_limits: true
        max_velocity: 1.57          # [rad/s]
        has_acceleration_limits: true
        max_acceleration: 3.49      # [rad/s2]
        has_jerk_limits: true
        max_jerk: 70.0              # [rad/s3]

Position limits (``has_position_limits``, ``min_position``, ``max_position``) and velocities may be
narrower than those of the URDF, never wider. For prismatic joints, metres replace radians.

The table may be nested in node parameters (``move_group: {ros__parameters: ...}``), and may omit
joints. A limit that neither file sets gets a default, with a note: MoveIt's files have no jerk
and often no acceleration, and some URDFs have velocity 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import difflib
import math
from pathlib import Path
from typing import Any

import numpy as np
from urdf_reader import Joint, JointKind, KinematicTree

from .arrays import Array, frozen, Mask
from .exceptions import LimitsError

KEYS = {
    'velocity': ('max_velocity',),
    'acceleration': ('max_acceleration',),
    'jerk': ('max_jerk',),
    'position': ('min_position', 'max_position'),
}
"""Keys that belong to each ``has_..._limits`` of MoveIt's format."""

DEFAULT_VELOCITY, DEFAULT_SLIDING_VELOCITY = 1.0, 0.1
"""Default velocity if URDF and limits file have none, or 0, in [rad/s] and in [m/s]."""
DEFAULT_ACCELERATION = 1.0  # acceleration where the limits file has none in [rad/s2], as in MoveIt
DEFAULT_JERK_RATIO = 20.0
"""Default ratio of jerk to acceleration in [1/s], if the limits file has no jerk.

As in MoveIt's time parameterization: its points are 0.1 s apart, and the acceleration may
reverse from full positive to full negative between two of them.
"""
NO_JERK = f'no max_jerk in the limits file, so {DEFAULT_JERK_RATIO:g}/s of max_acceleration'

TURN = 2.0 * math.pi  # a whole turn in [rad]
ROUNDING_TOLERANCE = 1e-3  # how much a limit may exceed the description's for rounding, as a share

_Row = tuple[float, float, float, float, float]
"""Lower, upper, velocity, acceleration and jerk of a joint."""

KNOWN_KEYS = frozenset(
    {
        *(f'has_{kind}_limits' for kind in KEYS),
        *(key for keys in KEYS.values() for key in keys),
        'has_deceleration_limits',
        'max_deceleration',
        'has_effort_limits',
        'max_effort',
        'angle_wraparound',
    }
)


@dataclass(frozen=True, slots=True, eq=False)
class JointLimits:
    """Limits of every joint of a group, in the group's order; radians or metres."""

    names: tuple[str, ...]  # names of the joints
    lower: Array  # least positions in [rad]; minus infinity for a continuous joint
    upper: Array  # greatest positions in [rad]; infinity for a continuous joint
    velocity: Array  # greatest speeds in [rad/s]
    acceleration: Array  # greatest accelerations in [rad/s2]
    jerk: Array  # greatest jerks in [rad/s3]
    # joints whose jerk is assumed: the limits file has none
    assumed_jerk: frozenset[str] = frozenset()

    def __len__(self) -> int:
        """Return the number of joints."""
        return len(self.names)

    def error(self, wanted: Array, actual: Array) -> Array:
        """Return wanted minus actual in [rad]; wrapped to half a turn for continuous joints."""
        error: Array = wanted - actual
        turns = np.where(self.continuous, TURN * np.round(error / TURN), 0.0)
        return error - turns

    def in_nearest_turn(self, positions: Array, seed: Array) -> Array:
        """Return positions, with continuous joints shifted to the turn nearest to a seed."""
        return np.where(self.continuous, seed + self.error(positions, seed), positions)

    def span(self, near: Array, turn: float = math.pi) -> tuple[Array, Array]:
        """Return position ranges; endless joints get ``near`` plus and minus ``turn`` in [rad]."""
        return (
            np.where(np.isfinite(self.lower), self.lower, near - turn),
            np.where(np.isfinite(self.upper), self.upper, near + turn),
        )

    def scaled(
        self, velocity: float, acceleration: float = 1.0, fastest: float = math.inf
    ) -> JointLimits:
        """Return the limits with velocity scaled by one factor, acceleration and jerk by another.

        Args:
            fastest: Greatest speed of any joint in [rad/s], before scaling.
        """
        return replace(
            self,
            velocity=frozen(np.minimum(self.velocity, fastest) * velocity),
            acceleration=frozen(self.acceleration * acceleration),
            jerk=frozen(self.jerk * acceleration),
        )

    def beyond(self, positions: Array, tolerance: float) -> str:
        """Describe the joint that is farthest beyond its limits; empty if there is none."""
        off = np.maximum(self.lower - positions, positions - self.upper)
        joint = int(off.argmax())
        return self.beyond_words(joint, float(positions[joint])) if off[joint] > tolerance else ''

    def beyond_words(self, joint: int, position: float) -> str:
        """Describe that a joint, given by its index, is beyond its limits."""
        lower, upper = self.lower[joint], self.upper[joint]
        return (
            f'{self.names[joint]} at {position:.4f} is beyond its limits {lower:.4f}..{upper:.4f}'
        )

    @property
    def continuous(self) -> Mask:
        """Mask of the continuous joints."""
        mask: Mask = np.isinf(self.lower) & np.isinf(self.upper)
        return mask


def load_limits(path: Path | str) -> Mapping[str, Any]:
    """Read the ``joint_limits`` of a limits file.

    Raises:
        LimitsError: The file cannot be read, or lacks the table ``joint_limits``.
    """
    import yaml  # which nodes do not need: they have limits as parameters

    try:
        document = yaml.safe_load(Path(path).read_text(encoding='utf-8'))
    except (OSError, yaml.YAMLError) as error:
        raise LimitsError(f'{path}: {error}') from error
    table = _table(document)
    if not isinstance(table, dict):
        raise LimitsError(f'{path}: there is no table joint_limits')
    return table


def _table(document: object) -> object:
    """Return the first ``joint_limits`` at any depth; None if there is none."""
    if not isinstance(document, dict):
        return None
    if 'joint_limits' in document:
        return document['joint_limits']
    return next(filter(None, map(_table, document.values())), None)


def merge_limits(
    names: Sequence[str], tree: KinematicTree, table: Mapping[str, Any], notes: list[str]
) -> JointLimits:
    """Merge the limits of a URDF with the table of a limits file.

    Args:
        notes: Receives a line for each kind of limit that got a default, with the joints.

    Raises:
        LimitsError: The table has no joint of the URDF, or a limit is not positive, misspelt
            or wider than in the URDF.
    """
    joints = {joint.name: joint for joint in tree.joints}
    if joints.keys().isdisjoint(table):
        known = ', '.join(table) or 'none'
        raise LimitsError(f'joint {names[0]} is missing in the limits file, which has: {known}')
    defaults: dict[str, list[str]] = {}
    rows: list[_Row] = []
    problems: list[str] = []
    for name in names:
        try:
            rows.append(_row(joints[name], table, defaults))
        except LimitsError as error:  # noqa: PERF203  # reported with what is wrong with others
            problems += error.problems
    if problems:
        raise LimitsError(*problems)
    notes += [f'{default}: {", ".join(found)}' for default, found in defaults.items()]
    lower, upper, velocity, acceleration, jerk = (
        frozen(column) for column in zip(*rows, strict=True)
    )
    assumed = frozenset(defaults.get(NO_JERK, ()))
    return JointLimits(tuple(names), lower, upper, velocity, acceleration, jerk, assumed)


def _row(joint: Joint, table: Mapping[str, Any], defaults: dict[str, list[str]]) -> _Row:
    name, span = joint.name, joint.range
    entry = table.get(name, {})
    if not isinstance(entry, dict):
        raise LimitsError(f'joint {name} of the limits file is {entry!r}, a table is needed')
    if unknown := sorted(set(entry) - KNOWN_KEYS):
        longer = [key for key in KNOWN_KEYS if key.startswith(unknown[0])]
        close = longer or difflib.get_close_matches(unknown[0], KNOWN_KEYS, n=1)
        meant = f' (is {close[0]!r} meant?)' if close else ''
        raise LimitsError(f'joint {name}: unknown key {unknown[0]!r}{meant} in the limits file')

    def default(words: str, value: float) -> float:
        defaults.setdefault(words, []).append(name)
        return value

    sliding = joint.kind is JointKind.PRISMATIC
    unit = 'm' if sliding else 'rad'
    # MoveIt's wizard writes a velocity of 0 where there is none
    is_given = entry.get('max_velocity') != 0.0
    velocity = (is_given and _positive(name, entry, 'velocity')) or span.velocity
    if not velocity:
        value = DEFAULT_SLIDING_VELOCITY if sliding else DEFAULT_VELOCITY
        velocity = default(f'no max_velocity in any file, so {value:g} {unit}/s', value)
    elif span.velocity and velocity > span.velocity * (1 + ROUNDING_TOLERANCE):
        raise LimitsError(
            f'joint {name}: max_velocity {velocity:g} is wider than the description'
            f' ({span.velocity:g}); a limits file may only narrow'
        )
    lower, upper = _span(joint, entry)
    acceleration = _positive(name, entry, 'acceleration') or default(
        f'no max_acceleration in the limits file, so {DEFAULT_ACCELERATION:g} {unit}/s2',
        DEFAULT_ACCELERATION,
    )
    jerk = _positive(name, entry, 'jerk') or default(NO_JERK, DEFAULT_JERK_RATIO * acceleration)
    return lower, upper, velocity, acceleration, jerk


def _positive(name: str, entry: Mapping[str, Any], kind: str) -> float:
    """Return a limit of the limits file; 0 if it is missing."""
    key = KEYS[kind][0]
    if not entry.get(f'has_{kind}_limits', key in entry):
        return 0.0
    return _number(name, entry, key, least=0.0)


def _span(joint: Joint, entry: Mapping[str, Any]) -> tuple[float, float]:
    """Return the range of a joint; a limits file has precedence over soft limits of the URDF."""
    name = joint.name
    if not entry.get('has_position_limits', 'max_position' in entry):
        return joint.range.lower, joint.range.upper
    lower, upper = (_number(name, entry, key) for key in KEYS['position'])
    least, most = joint.stops
    if lower < least - ROUNDING_TOLERANCE or upper > most + ROUNDING_TOLERANCE:
        raise LimitsError(
            f'joint {name}: positions {lower:g}..{upper:g} are wider than the description'
            f' ({least:g}..{most:g}); a limits file may only narrow'
        )
    if lower >= upper:
        raise LimitsError(
            f'joint {name}: min_position {lower:g} is not below max_position {upper:g}'
        )
    return lower, upper


def _number(name: str, entry: Mapping[str, Any], key: str, least: float = -math.inf) -> float:
    value = entry.get(key)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise LimitsError(f'joint {name}: {key} is {value!r}, a number is needed')
    if not math.isfinite(value) or value <= least:
        raise LimitsError(f'joint {name}: {key} is {value}, a positive number is needed')
    return float(value)

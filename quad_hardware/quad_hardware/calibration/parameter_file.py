# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The YAML file that ``hardware_node`` takes with ``--params-file``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math
from pathlib import Path
from typing import cast

import yaml

from quad_description.rotations import roll_pitch_yaw

from ..estimation import ImuMounting
from ..exceptions import CommandError
from ..joints import JointServo

NODE, PARAMETERS = 'hardware_node', 'ros__parameters'

Tree = dict[str, object]


def read_parameters(path: Path) -> Tree:
    """Return the parameters of hardware_node in a file; none where there is no file.

    Raises:
        CommandError: It is no parameter file.
    """
    if not path.exists():
        return {}
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8')) or {}
    except yaml.YAMLError as error:
        raise CommandError(f'{path} is not YAML: {error}') from error
    node = content.get(NODE, {}) if isinstance(content, dict) else None
    parameters = node.get(PARAMETERS, {}) if isinstance(node, dict) else None
    if not isinstance(parameters, dict):
        raise CommandError(f'{path} holds no parameters of {NODE}: {NODE}: {PARAMETERS}: ...')
    return cast('Tree', parameters)


def write_parameters(path: Path, changes: Mapping[str, object]) -> None:
    """Write parameters into a file, beside those that it has.

    Args:
        path: The file; it is replaced as a whole, or not at all.
        changes: By name; a mapping changes what it names only.

    Raises:
        CommandError: The file that is there is no parameter file.
    """
    tree = _merged(read_parameters(path), changes)
    text = yaml.safe_dump({NODE: {PARAMETERS: tree}}, sort_keys=False)
    temporary = path.with_suffix(f'{path.suffix}.new')
    temporary.write_text(text, encoding='utf-8')
    temporary.replace(path)


def servo_parameters(servos: Iterable[JointServo]) -> Tree:
    """Return what was measured of servos, by joint as hardware_node reads it."""
    joints: dict[str, Tree] = {}
    for servo in servos:
        numbers = {'offset': servo.offset, 'lower': servo.lower, 'upper': servo.upper}
        finite = {name: round(value, 5) for name, value in numbers.items() if math.isfinite(value)}
        joints[servo.joint] = {'motor': servo.motor, 'sign': servo.sign, **finite}
    return {'joints': joints}


def imu_parameters(mounting: ImuMounting) -> Tree:
    """Return how the IMU sits in the body, as hardware_node reads it; signs where checked."""
    gyro: Tree = (
        {'rate_signs': list(mounting.rate_signs), 'rates_checked': True}
        if mounting.rates_checked
        else {}
    )
    return {
        'imu': {
            'mounting': [round(angle, 5) for angle in roll_pitch_yaw(mounting.rotation)],
            'attitude_signs': list(mounting.attitude_signs),
            'acceleration_signs': list(mounting.acceleration_signs),
            'mounting_checked': mounting.checked,
            **gyro,
        }
    }


def _merged(old: Mapping[str, object], new: Mapping[str, object]) -> Tree:
    result = dict(old)
    for key, value in new.items():
        before = result.get(key)
        nested = isinstance(before, dict) and isinstance(value, Mapping)
        result[key] = _merged(cast('Tree', before), cast('Tree', value)) if nested else value
    return result

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The URDF and the poses of a preset, and the numbers for both: model/robot.yaml."""

from __future__ import annotations

from enum import Enum
from functools import lru_cache
import math
from pathlib import Path
import re
from typing import Any, Final

from urdf_reader import DescriptionError
import yaml

from .kinematics.leg import LEGS


class PresetError(DescriptionError):
    """There is no such preset.

    Scenarios: a name misspelt, a preset of another robot.
    """


MODEL = Path(__file__).parent / 'model'
"""Folder with the xacro files and their numbers."""


@lru_cache(maxsize=1)
def robot_numbers() -> dict[str, Any]:
    """Return the numbers of robot.yaml; one copy, which must not be changed."""
    with (MODEL / 'robot.yaml').open(encoding='utf-8') as file:
        numbers: dict[str, Any] = yaml.safe_load(file)
    return numbers


PRESETS: Final[tuple[str, ...]] = tuple(sorted(robot_numbers()['presets']))
"""Names of the robots that there are."""

TRUNK_MASS_RANGE: Final = (0.05, 5.0)  # [kg] what the legs could carry, with room to spare


@lru_cache(maxsize=16)
def robot_urdf(
    preset: str = 'lite',
    arm: bool = False,
    trunk_mass: float | None = None,
    *,
    base_footprint: bool = True,
) -> str:
    """Make the URDF of a robot.

    Args:
        preset: One of :data:`PRESETS`.
        arm: With the arm and gripper on its back.
        trunk_mass: Mass of the trunk in [kg] when the robot carries more than the bare one, whose
            figure is the preset's.
        base_footprint: With that frame on a floating joint, for robot_state_publisher.

    Returns:
        The URDF as XML text.

    Raises:
        PresetError: There is no such preset.
        DescriptionError: The mass of the trunk is none.
    """
    if preset not in PRESETS:
        raise PresetError(f'unknown preset {preset!r}; choose one of {", ".join(PRESETS)}')
    lowest, highest = TRUNK_MASS_RANGE
    if trunk_mass is not None and not (
        math.isfinite(trunk_mass) and lowest <= trunk_mass <= highest
    ):
        raise DescriptionError(
            f'trunk_mass {trunk_mass} kg is not {lowest} to {highest} kg; '
            "leave it out for the preset's own"
        )
    return _expand(
        {
            'preset': preset,
            'arm': str(bool(arm)).lower(),
            'trunk_mass': repr(float(trunk_mass or 0.0)),
            'base_footprint': str(base_footprint).lower(),
        }
    )


def preset_of(urdf: str) -> str:
    """Return the preset that a URDF was made of, by the name of its robot; empty for none."""
    found = re.search(r'<robot [^>]*name="xgo_(\w+)"', urdf)
    return found[1] if found and found[1] in PRESETS else ''


def _expand(arguments: dict[str, str]) -> str:
    import xacro

    path = MODEL / 'quadruped.urdf.xacro'
    document = xacro.process_file(str(path), mappings=arguments)
    # the root without the comment before it, which names the path on this machine
    urdf: str = document.documentElement.toprettyxml(indent='  ')
    return urdf.rstrip()


STREAM_TIMEOUT: Final = 0.5
"""A pause [s] that ends a stream of joint commands: a robot that it leaves with a foot in the air
is laid down by the hardware node, so the next stream has to begin where the joints are then."""


_LEG_JOINTS = ('hip', 'thigh', 'calf')
_ARM_JOINTS = ('yaw', 'thigh', 'calf')
_GRIPPER = 'hand_right_joint'


class Pose(Enum):
    """A pose that robot.yaml has the numbers of."""

    STAND = 'stand'
    LIE = 'lie'


def pose_positions(pose: Pose, arm: bool = False) -> dict[str, float]:
    """Return the joint positions of a pose.

    Returns:
        Positions in [rad], for the gripper in [m], by the joint's name in the order of the URDF.
    """
    numbers: dict[str, Any] = robot_numbers()['poses'][pose.value]
    positions = {
        f'{leg}_{joint}_joint': float(value)
        for leg in LEGS
        for joint, value in zip(_LEG_JOINTS, numbers['leg'], strict=True)
    }
    if arm:
        for joint, value in zip(_ARM_JOINTS, numbers['arm'], strict=True):
            positions[f'arm_{joint}_joint'] = float(value)
        positions[_GRIPPER] = 0.0
    return positions

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The URDF of a preset, and the numbers that its xacro files read: model/robot.yaml."""

from __future__ import annotations

from functools import lru_cache
import math
from pathlib import Path
from typing import Any, Final

from urdf_reader import DescriptionError
import yaml

from .exceptions import PresetError

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


def _expand(arguments: dict[str, str]) -> str:
    import xacro

    path = MODEL / 'quadruped.urdf.xacro'
    document = xacro.process_file(str(path), mappings=arguments)
    # the root without the comment before it, which names the path on this machine
    urdf: str = document.documentElement.toprettyxml(indent='  ')
    return urdf.rstrip()

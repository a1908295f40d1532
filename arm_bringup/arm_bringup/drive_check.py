# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Limits of joints against what their drives are set to: speed, and ramps of their own stops."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from .findings import Finding, warning

if TYPE_CHECKING:
    from arm_canopen.config import AxisUnits
    from arm_model import JointLimits

LONGER = 5.0  # times the way of a stop within the limits, from which on one surprises


def check_drives(
    place: str, drives: Mapping[str, AxisUnits | None], limits: JointLimits
) -> Iterable[Finding]:
    """Check speed limit and decelerations of each drive; None where these are unknown."""
    from canopen_core.standard import Index

    rows = zip(limits.names, limits.velocity, limits.acceleration, strict=True)
    for name, velocity, acceleration in rows:
        drive = drives.get(name)
        motion = drive.motion if drive is not None else {}
        greatest = motion.get(Index.MAX_PROFILE_VELOCITY)
        if greatest and velocity > greatest:
            yield warning(
                place,
                f'{name} may have {velocity:.4g} per second, and its drive takes up to '
                f'{greatest:.4g} (0x607F in bus.yml or the EDS): the arm is not led then',
                'lower its max_velocity, or raise 0x607F in the sdo list of bus.yml',
            )
        ramps = [
            (motion[index], index)
            for index in (Index.PROFILE_DECELERATION, Index.QUICK_STOP_DECELERATION)
            if motion.get(index)
        ]
        deceleration, index = min(ramps, default=(acceleration, None))
        if index is not None and LONGER * deceleration < acceleration:
            speed = min(velocity, greatest or velocity)
            yield warning(
                place,
                f'{name}: halted at full speed its drive goes on for '
                f'{speed**2 / (2.0 * deceleration):.3g} (0x{index:04X} is {deceleration:.3g} per '
                f's2), within its limits it would be {speed**2 / (2.0 * acceleration):.3g}',
                f'raise 0x{index:04X} in the sdo list of bus.yml to about {acceleration:.3g} '
                'per s2, in units of the drive',
            )

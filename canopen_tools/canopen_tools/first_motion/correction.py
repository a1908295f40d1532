# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A correction in the file: written, read back as the master reads it, then kept."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from arm_canopen import load_bus
from first_motion import BusEditError, Correction, edited, replace_file

from .dialogue import FirstMotionError


def apply(
    correction: Correction, path: Path, device: str, joint: str, channel: int | None
) -> None:
    """Change keys in a bus.yml; the file is replaced as a whole, or not at all.

    The channel is the place of the axis in ``channels``; None for a device with one axis.

    Raises:
        FirstMotionError: It has a form in which nothing is changed, or the result would differ.
        ConfigError: The file could not be read with these keys.
    """
    values = correction.values

    def check(new: Path) -> None:
        for axis in load_bus(new).node(device).axes:
            is_meant = (axis.name or device) == joint
            if is_meant and any(getattr(axis, key) != value for key, value in values.items()):
                raise FirstMotionError(
                    f'{path}: the keys of {device} are not where they were expected; write by '
                    f'hand: {", ".join(f"{key}: {value}" for key, value in values.items())}'
                )

    edit = partial(edited, device=device, values=values, reason=correction.reason, channel=channel)
    try:
        replace_file(path, edit, check)
    except BusEditError as error:
        raise FirstMotionError(f'{path}: {error}') from error

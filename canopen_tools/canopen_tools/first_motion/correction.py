# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The correction of a bus.yml: which keys, and the file with them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from arm_canopen import load_bus

from .bus_edit import BusEditError, edited


@dataclass(frozen=True, slots=True)
class Correction:
    """Keys of a device to change.

    Attributes:
        device: Its name.
        joint: Name of its axis.
        channel: Place of the axis in ``channels``; None for a device with one axis.
        values: New values by key.
        reason: Why, in a line.
    """

    device: str
    joint: str
    channel: int | None
    values: Mapping[str, float | bool]
    reason: str


def apply(correction: Correction, path: Path) -> None:
    """Change keys in a bus.yml; the file is replaced as a whole, or not at all.

    Raises:
        BusEditError: It has a form in which nothing is changed, or the result would differ.
        ConfigError: The file could not be read with these keys.
    """
    device, values = correction.device, correction.values
    before = path.read_text(encoding='utf-8')
    text = edited(before, device, values, correction.reason, correction.channel)
    new = path.with_name(f'{path.name}.new')
    try:
        new.write_text(text, encoding='utf-8')
        for axis in load_bus(new).node(device).axes:
            is_meant = (axis.name or device) == correction.joint
            if is_meant and any(getattr(axis, key) != value for key, value in values.items()):
                raise BusEditError(
                    f'{path}: the keys of {device} are not where they were expected; write by '
                    f'hand: {", ".join(f"{key}: {value}" for key, value in values.items())}'
                )
        new.chmod(path.stat().st_mode)
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Velocities and accelerations of a drive that counts them in another unit, such as rpm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

from ..objects.object_store import Integer

RateUnits: TypeAlias = Mapping[int, tuple[float, float]]
"""By axis: what 1 of its velocities is in [inc/s], and of its accelerations in [inc/s^2]."""
INCREMENTS_PER_SECOND: RateUnits = {}
"""Of a device whose axes all count [inc/s]."""


@dataclass(slots=True)
class RateUnit:
    """What 1 of all velocities, or of all accelerations, of a drive is."""

    value: float  # [inc/s] or [inc/s^2]


class Rate:
    """An object in a unit of its drive, seen in increments per second (or second squared)."""

    __slots__ = ('_object', '_unit')

    def __init__(self, variable: Integer, unit: RateUnit) -> None:
        self._object = variable
        self._unit = unit

    @property
    def value(self) -> float:
        """What it holds in [inc/s]."""
        return self._object.value * self._unit.value

    def put(self, rate: float) -> None:
        """Store a rate in [inc/s], rounded and held within the type of the object."""
        self._object.put(rate / self._unit.value)

    @property
    def listener(self) -> Callable[[float], None] | None:
        """Called with the steady time in [s] after an SDO or an RPDO wrote the object."""
        return self._object.listener

    @listener.setter
    def listener(self, listener: Callable[[float], None] | None) -> None:
        self._object.listener = listener

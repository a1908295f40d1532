# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults of a robot and its serial line, and their schedule.

Faults have the syntax ``KIND[,name=value...]``: ``drop,rate=0.01`` or ``silence,at=5,for=2``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
import math
from types import MappingProxyType
from typing import NamedTuple

from .exceptions import SetupError


class FaultKind(Enum):
    """Kinds of faults."""

    DROP = 'drop'  # bytes are lost, both ways
    FLIP = 'flip'  # a bit of a byte is inverted, both ways
    SILENCE = 'silence'  # the robot receives, and sends nothing
    DEAF = 'deaf'  # the robot receives nothing
    SLOW = 'slow'  # everything that the robot sends is late
    BROWN_OUT = 'brown_out'  # the supply fails: the board starts anew, its servos without torque
    UNPLUG = 'unplug'  # the serial port is gone
    LIMP = 'limp'  # a servo loses its torque, and the board reports a silent one
    IMU = 'imu'  # the IMU is dead: the board reports an attitude of NaN
    BATTERY = 'battery'  # the charge is another one from now on


FOREVER = math.inf


class Setting(NamedTuple):
    """A parameter of a fault."""

    default: float
    lowest: float
    highest: float
    meaning: str


_RATE = Setting(0.01, 0.0, 1.0, 'share of the bytes')

SETTINGS: Mapping[FaultKind, Mapping[str, Setting]] = MappingProxyType(
    {kind: {} for kind in FaultKind}
    | {
        FaultKind.DROP: {'rate': _RATE},
        FaultKind.FLIP: {'rate': _RATE},
        FaultKind.SLOW: {'delay': Setting(0.05, 0.0, 60.0, 'later by [s]')},
        FaultKind.LIMP: {'motor': Setting(11.0, 11.0, 54.0, 'id')},
        FaultKind.BATTERY: {'level': Setting(5.0, 0.0, 100.0, 'charge [%]')},
    }
)
"""Details of a fault, beside ``at`` and ``for``."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault with its start and duration."""

    kind: FaultKind  # what
    start: float = 0.0  # from when [s], since the start of the robot
    duration: float = FOREVER  # for how long [s]; infinite until it is ended
    values: Mapping[str, float] = field(default_factory=dict)  # its details by name

    def __getitem__(self, name: str) -> float:
        """Return a parameter, or its default."""
        return self.values.get(name, SETTINGS[self.kind][name].default)

    @property
    def end(self) -> float:
        """End time [s]."""
        return self.start + self.duration


def make_fault(
    name: str, settings: Iterable[str], start: float = 0.0, duration: float = FOREVER
) -> Fault:
    """Create a fault from words ``name=value``; ``at`` and ``for`` override the arguments [s].

    Raises:
        SetupError: A word is unknown; the message lists the known ones.
    """
    try:
        kind = FaultKind(name)
    except ValueError:
        kinds = ', '.join(kind.value for kind in FaultKind)
        raise SetupError(f'unknown fault {name!r}; there are {kinds}') from None
    known, values = SETTINGS[kind], {'at': start, 'for': duration}
    for word in settings:
        detail, _, text = (part.strip() for part in word.partition('='))
        if detail not in {*values, *known}:
            takes = ', '.join(('at', 'for', *known))
            raise SetupError(f'fault {name} has no {detail!r}; it takes {takes}')
        try:
            values[detail] = float(text)
        except ValueError:
            raise SetupError(f'fault {name}: {word!r} is not name=number') from None
        _, lowest, highest, meaning = known.get(detail, (0.0, -math.inf, math.inf, ''))
        if meaning and not lowest <= values[detail] <= highest:
            raise SetupError(
                f'fault {name}: {detail} {values[detail]} ({meaning}) is not '
                f'{lowest:g} to {highest:g}'
            )
    start, duration = values.pop('at'), values.pop('for')
    if not (math.isfinite(start) and start >= 0.0 and duration > 0.0):
        raise SetupError(
            f'fault {name}: at {start} for {duration}; give times in [s], from zero on'
        )
    return Fault(kind, start, duration, values)


def parse_fault(text: str) -> Fault:
    """Parse a fault in the syntax ``KIND[,name=value...]``.

    Raises:
        SetupError: The text is wrong; the message lists the known faults.
    """
    name, *settings = (word.strip() for word in text.split(','))
    return make_fault(name, settings)


class FaultPlan:
    """Schedule of a robot's faults."""

    def __init__(self, faults: Iterable[Fault] = ()) -> None:
        """Schedule faults."""
        self._faults = list(faults)

    def add(self, fault: Fault) -> None:
        """Schedule another fault."""
        self._faults.append(fault)

    def end_all(self) -> None:
        """Cancel all faults, including future ones."""
        self._faults.clear()

    def active(self, kind: FaultKind, now: float) -> Fault | None:
        """Return the active fault of a kind at a time; the latest added wins."""
        for fault in reversed(self._faults):
            if fault.kind is kind and fault.start <= now < fault.end:
                return fault
        return None

    def next_change(self, now: float) -> float:
        """Return the next time a fault begins or ends [s]; infinity if none."""
        times = (time for fault in self._faults for time in (fault.start, fault.end))
        return min((time for time in times if time > now), default=FOREVER)

    def prune(self, now: float) -> None:
        """Remove the faults that have ended."""
        self._faults = [fault for fault in self._faults if fault.end > now]

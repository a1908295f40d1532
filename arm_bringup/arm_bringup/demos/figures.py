# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What /diagnostics says of bus and drives, and what a demo measured, in types."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
import math
from typing import Protocol

ENABLED = 'Operation enabled'
"""Title of the state in which a drive can move (CiA 402-2, figure 4)."""
FOLLOWING_MODES = ('Interpolated position', 'Cyclic position')
"""Titles of the modes in which a drive follows targets along a path (7 and 8)."""


class KeyValue(Protocol):
    """As diagnostic_msgs/KeyValue."""

    @property
    def key(self) -> str:
        """Name of the figure."""

    @property
    def value(self) -> str:
        """The figure as text."""


class Status(Protocol):
    """As diagnostic_msgs/DiagnosticStatus, as far as it is looked at."""

    @property
    def name(self) -> str:
        """What it is about."""

    @property
    def message(self) -> str:
        """A summary in words."""

    @property
    def values(self) -> Iterable[KeyValue]:
        """The figures."""


@dataclass(frozen=True, slots=True)
class DriveFigures:
    """A drive.

    Attributes:
        online: It is booted and its heartbeat is there.
        nmt: NMT state.
        state: State of the power drive system, as the standard writes it.
        mode: Mode of operation.
        position: Position in [rad].
        velocity: Velocity in [rad/s].
        setpoint: Position last commanded in [rad].
        following_error: Set-point minus position in [rad].
        message: The master's word on it.
    """

    online: bool = False
    nmt: str = ''
    state: str = ''
    mode: str = ''
    position: float = math.nan
    velocity: float = math.nan
    setpoint: float = math.nan
    following_error: float = math.nan
    message: str = ''

    @property
    def enabled(self) -> bool:
        """It can move."""
        return self.online and self.state == ENABLED

    @property
    def follows_targets(self) -> bool:
        """It follows a stream of positions, unless something else moves it."""
        return self.enabled and self.mode in FOLLOWING_MODES


@dataclass(frozen=True, slots=True)
class BusFigures:
    """The bus and its cycle.

    Attributes:
        frames_per_second: Frames in both directions per second.
        load: Bus load in [%].
        lost: Frames that were lost.
        jitter_p50: Median deviation of the cycle in [s].
        jitter_p99: 99th percentile of that in [s].
        missed_pdos: Synchronous PDOs that did not come in their cycle.
    """

    frames_per_second: float = math.nan
    load: float = math.nan
    lost: int = 0
    jitter_p50: float = math.nan
    jitter_p99: float = math.nan
    missed_pdos: int = 0


@dataclass(frozen=True, slots=True)
class AxisFigures:
    """What a demo measured on an axis.

    Attributes:
        active: The demo moves it.
        lowest: Least position in [rad].
        highest: Greatest position in [rad].
        error_max: Greatest path error in [rad].
        error_rms: Root mean square of the path error in [rad].
    """

    active: bool = False
    lowest: float = math.nan
    highest: float = math.nan
    error_max: float = math.nan
    error_rms: float = math.nan

    @property
    def moved(self) -> float:
        """Range of its positions in [rad]; 0 before there is one."""
        moved = self.highest - self.lowest
        return moved if math.isfinite(moved) else 0.0


@dataclass(frozen=True, slots=True)
class Figures:
    """All of it; immutable, a new one for each message.

    Attributes:
        drives: The drives by name.
        bus: The bus.
        axes: What the demo measured on each axis, by the name of the drive.
    """

    drives: Mapping[str, DriveFigures] = field(default_factory=dict)
    bus: BusFigures = BusFigures()
    axes: Mapping[str, AxisFigures] = field(default_factory=dict)

    def updated(self, statuses: Iterable[Status]) -> Figures:
        """Take in a message.

        Args:
            statuses: The status list of a DiagnosticArray.

        Returns:
            New figures; statuses of others are passed over.
        """
        figures = self
        for status in statuses:
            figures = figures.with_status(status)
        return figures

    def with_status(self, status: Status) -> Figures:
        """Take in one status.

        Args:
            status: Of whatever kind.
        """
        source, _, part = status.name.partition(': ')
        values = {each.key: each.value for each in status.values}
        if (source, part) == ('master', 'bus'):
            return replace(self, bus=_bus(values))
        if part == 'drive':
            return replace(self, drives={**self.drives, source: _drive(values, status.message)})
        return self

    @property
    def line(self) -> str:
        """A line of the demo's own; empty for none."""
        return ''

    @property
    def enabled(self) -> int:
        """Number of drives that can move."""
        return sum(drive.enabled for drive in self.drives.values())


def _number(values: Mapping[str, str], key: str) -> float:
    """Read a number; what is missing or is none becomes NaN, which is shown as such."""
    try:
        return float(values[key].split()[0])
    except (KeyError, ValueError, IndexError):
        return math.nan


def _count(values: Mapping[str, str], key: str) -> int:
    number = _number(values, key)
    return int(number) if math.isfinite(number) else 0


def _drive(values: Mapping[str, str], message: str) -> DriveFigures:
    return DriveFigures(
        online=values.get('online') == 'True',
        nmt=values.get('nmt_state', ''),
        state=values.get('state', ''),
        mode=values.get('mode', ''),
        position=_number(values, 'position'),
        velocity=_number(values, 'velocity'),
        setpoint=_number(values, 'setpoint'),
        following_error=_number(values, 'following_error'),
        message=message,
    )


def _bus(values: Mapping[str, str]) -> BusFigures:
    return BusFigures(
        frames_per_second=_number(values, 'frames_per_second'),
        load=_number(values, 'bus_load'),
        lost=_count(values, 'frames_lost'),
        jitter_p50=_number(values, 'jitter_p50'),
        jitter_p99=_number(values, 'jitter_p99'),
        missed_pdos=_count(values, 'missed_pdos'),
    )

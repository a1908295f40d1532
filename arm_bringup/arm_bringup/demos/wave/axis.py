# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One drive in the wave: when it takes part, where it is sent, and how well it follows."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

from ..figures import AxisFigures, DriveFigures
from .plan import Swing, WaveStyle

READY_WITHIN = 5.0
"""Time in [s] within which a drive that was asked for has to be ready; later it stays out."""
STANDING = 3
"""Observations in which a set-point stands beside the wave before it is somebody else's."""
BESIDE = 0.1
"""Distance as a share of the amplitude at which a set-point is beside the wave."""


@dataclass(slots=True)
class Entry:
    """How a drive came in.

    Attributes:
        start: Where it stood in [rad] or [m].
        time: When, in [s].
        duration: How long its entry takes in [s].
    """

    start: float
    time: float
    duration: float


@dataclass(slots=True)
class Tracking:
    """How well a drive followed.

    Attributes:
        lowest: Least measured position in [rad] or [m].
        highest: Greatest measured position in [rad] or [m].
        error_max: Greatest distance between set-point and measured position in [rad] or [m].
        squares: Sum of the squares of that distance in [rad^2] or [m^2].
        samples: Number of measurements.
    """

    lowest: float = math.inf
    highest: float = -math.inf
    error_max: float = 0.0
    squares: float = 0.0
    samples: int = 0

    def measure(self, drive: DriveFigures) -> None:
        """Take in an observation."""
        error = abs(drive.following_error)
        self.lowest = min(self.lowest, drive.position)
        self.highest = max(self.highest, drive.position)
        self.error_max = max(self.error_max, error)
        self.squares += error * error
        self.samples += 1


@dataclass(slots=True)
class WaveAxis:
    """A drive on its swing; times are on the steady clock in [s].

    A drive that is not enabled, in a mode that follows no targets, or whose set-point stands while
    the wave moves on, is somebody else's: it leaves the wave, and is taken back only when it is
    asked for again.

    Attributes:
        swing: Its path.
        left: Why it takes no part any more; empty when it does, or never did.
    """

    swing: Swing
    left: str = ''
    _entry: Entry | None = None
    _asked: bool = False
    _asked_since: float = math.nan  # when it was first observed after that
    _target: float = math.nan
    _setpoint: float = math.nan
    _standing: int = 0
    _tracking: Tracking = field(default_factory=Tracking)

    @property
    def active(self) -> bool:
        """Whether it takes part."""
        return self._entry is not None

    def ask(self) -> None:
        """Let it take part as soon as it stands and can follow."""
        self._asked, self._asked_since = True, math.nan

    def target(self, now: float, omega: float) -> float | None:
        """Return where it is to be; None when it takes no part.

        Args:
            now: The time.
            omega: Angular velocity of the wave in [rad/s].
        """
        entry = self._entry
        if entry is None:
            return None
        entered = (now - entry.time) / entry.duration
        self._target = self.swing.position(entry.start, entered, omega * now)
        return self._target

    def observe(self, drive: DriveFigures, now: float, style: WaveStyle) -> None:
        """See how it is, and whether it takes part.

        Args:
            drive: Its figures.
            now: The time.
            style: The style of the wave.
        """
        stands = drive.setpoint == self._setpoint
        self._setpoint = drive.setpoint
        if self._entry is not None:
            reason = self._lost(drive, stands=stands)
            if reason:
                self.leave(reason)
            else:
                self._tracking.measure(drive)
        elif self._asked:
            if math.isnan(self._asked_since):
                self._asked_since = now
            if stands and drive.follows_targets:
                self._enter(drive.setpoint, now, style)
            elif now - self._asked_since > READY_WITHIN:
                self._asked = False

    def leave(self, reason: str) -> None:
        """Take no part any more, and say why."""
        self._entry, self._asked, self.left = None, False, reason

    def figures(self) -> AxisFigures:
        """Sum up what was measured."""
        seen = self._tracking
        if not seen.samples:
            return AxisFigures(self.active)
        rms = math.sqrt(seen.squares / seen.samples)
        return AxisFigures(self.active, seen.lowest, seen.highest, seen.error_max, rms)

    def _enter(self, setpoint: float, now: float, style: WaveStyle) -> None:
        self._entry = Entry(setpoint, now, self.swing.entry_duration(setpoint, style))
        self._asked, self._standing = False, 0
        self._target, self.left = setpoint, ''

    def _lost(self, drive: DriveFigures, *, stands: bool) -> str:
        """Return why it is not ours any more; empty when it is."""
        if not drive.enabled:
            return f'it is not enabled: {drive.message or drive.state}'
        if not drive.follows_targets:
            return f'it is in mode {drive.mode}'
        beside = abs(self._target - drive.setpoint) > BESIDE * self.swing.amplitude
        self._standing = self._standing + 1 if stands and beside else 0
        if self._standing < STANDING:
            return ''
        return f'it was halted or sent elsewhere: its set-point stands at {drive.setpoint:.3f}'

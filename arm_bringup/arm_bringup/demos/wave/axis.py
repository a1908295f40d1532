# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One drive in the wave: where it entered, and how well it follows."""

from __future__ import annotations

from dataclasses import dataclass
import math

from .plan import Swing, WaveStyle


@dataclass(frozen=True, slots=True)
class AxisReport:
    """How well an axis followed since the wave was started from standstill.

    Attributes:
        name: Name of the drive.
        active: It takes part.
        left: Why it takes no part any more; empty when it does, or never did.
        lowest: Least measured position in [rad].
        highest: Greatest measured position in [rad].
        error_max: Greatest distance in [rad] between a measured position and the last set-point
            that was sent before it was measured.
        error_rms: Root mean square of that distance in [rad].
        samples: Number of measurements.
    """

    name: str
    active: bool
    left: str
    lowest: float
    highest: float
    error_max: float
    error_rms: float
    samples: int


@dataclass(slots=True)
class WaveAxis:
    """A drive on its swing.

    Attributes:
        swing: Its motion.
        active: It takes part.
        left: Why it takes no part any more.
        start: Where it entered in [rad].
        entered: How long ago that was, in [s] of the wave.
        duration: How long its entry takes in [s].
        sent: The last set-point in [rad], None when it got none.
        lowest: Least measured position in [rad].
        highest: Greatest measured position in [rad].
        error_max: Greatest path error in [rad].
        squares: Sum of the squares of the path errors in [rad^2].
        samples: Number of path errors.
    """

    swing: Swing
    active: bool = False
    left: str = ''
    start: float = 0.0
    entered: float = 0.0
    duration: float = 1.0
    sent: float | None = None
    lowest: float = math.inf
    highest: float = -math.inf
    error_max: float = 0.0
    squares: float = 0.0
    samples: int = 0

    def clear(self) -> None:
        """Forget what was measured."""
        self.lowest, self.highest = math.inf, -math.inf
        self.error_max = self.squares = 0.0
        self.samples = 0

    def enter(self, setpoint: float, style: WaveStyle) -> None:
        """Take part from now on.

        Args:
            setpoint: Where it stands in [rad].
            style: The style of the wave.
        """
        self.active = True
        self.left = ''
        self.start = setpoint
        self.entered = 0.0
        self.duration = self.swing.entry_duration(setpoint, style)

    def leave(self, reason: str) -> None:
        """Take no part any more.

        Args:
            reason: Why; empty when there is nothing to log.
        """
        if self.active:
            self.left = reason
        self.active = False
        self.sent = None

    def measure(self, position: float) -> None:
        """Compare a measured position with the last set-point.

        Args:
            position: In [rad].
        """
        if self.sent is None:
            return
        error = abs(position - self.sent)
        self.lowest = min(self.lowest, position)
        self.highest = max(self.highest, position)
        self.error_max = max(self.error_max, error)
        self.squares += error * error
        self.samples += 1

    def advance(self, step: float, theta: float) -> float:
        """Go on, and return the next set-point in [rad].

        Args:
            step: By how much time of the wave in [s].
            theta: Phase of the wave in [rad].
        """
        self.entered += step
        self.sent = self.swing.position(self.start, self.entered / self.duration, theta)
        return self.sent

    def report(self) -> AxisReport:
        """Sum up what was measured."""
        rms = math.sqrt(self.squares / self.samples) if self.samples else 0.0
        return AxisReport(
            self.swing.name,
            self.active,
            self.left,
            self.lowest,
            self.highest,
            self.error_max,
            rms,
            self.samples,
        )

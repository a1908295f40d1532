# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo found out of squares, the singular pose, and the motion as a whole."""

from __future__ import annotations

from dataclasses import dataclass

from ..figures import BusFigures
from ..report import bus_line
from ..results import Results

WORST_LINE = 3e-3
"""Greatest distance of the tool from the line that it is jogged along, in [m]."""
WORST_SPEED = 0.01
"""Greatest difference of the tool's speed from the asked one, as a share."""
LATE_COMMANDS = 0.05
"""Time between two jog commands in [s] from which on the tool may stop in between: each counts
for 0.1 s, of which its way to the servo takes some."""
WORST_PATH = 5e-3
"""Greatest distance of a set-point from the path of a trajectory, in [rad]."""
WORST_JERK = 1.05
"""Greatest jerk, as a share of the limit; the numbers in the messages are rounded."""
LEAST_RETURN = 0.9
"""Share of the way that the tool must come back from the singular pose."""
WORST_TRACKING = 0.2
"""A joint that was this far from its set-point in [rad] did not follow; judged only where
every drive answered in every cycle."""


@dataclass(frozen=True, slots=True)
class Square:
    """What was measured along the sides of a square.

    Attributes:
        asked: Speed of the tool that was asked in [m/s].
        reached: Speed that was reached in [m/s].
        commanded: Greatest distance of the commanded tool from the sides in [m].
        measured: The same of the measured tool in [m].
        missed: PDOs of drives that came late: joints of different times are not where the tool is.
        gap: Longest time between two jog commands in [s].
        limited: What the servo said that limits the motion; empty for nothing.
    """

    asked: float
    reached: float
    commanded: float
    measured: float
    missed: int = 0
    gap: float = 0.0
    limited: str = ''


@dataclass(slots=True)
class MotionResults(Results):
    """Filled while the demo runs."""

    def square(self, name: str, square: Square) -> None:
        """Take in a square of the tool.

        Args:
            name: What it was.
            square: What was measured.
        """
        off = f'{1e3 * square.commanded:.2f} mm commanded, {1e3 * square.measured:.2f} mm measured'
        figures = (
            f'TCP speed asked {square.asked:.3f} m/s, reached {square.reached:.4f} m/s; '
            f'off the line {off}'
        )
        problem = ''
        worst = square.commanded if square.missed else square.measured
        if worst > WORST_LINE:
            problem = f'the tool was {1e3 * worst:.1f} mm off its line'
        elif abs(square.reached - square.asked) > WORST_SPEED * square.asked:
            if square.gap > LATE_COMMANDS:
                figures += (
                    f'; speed not judged: jog commands were up to {square.gap:.2f} s apart, this '
                    'computer is too busy'
                )
            elif square.limited and square.reached < square.asked:
                figures += f'; the limits of this arm allow no more: {square.limited}'
            else:
                problem = (
                    f'the tool moved at {square.reached:.4f} m/s instead of {square.asked:.3f} m/s'
                )
        self.add(name, figures, problem)

    def singularity(self, out: float, back: float, words: str) -> None:
        """Take in the way to the singular pose and back.

        Args:
            out: Way of the tool out in [m].
            back: Way that it came back in [m].
            words: What the servo said there.
        """
        problem = ''
        if out <= 0.0 or back < LEAST_RETURN * out:
            problem = (
                f'the tool came back {back:.3f} m of {out:.3f} m; {words or "no reason given"}'
            )
        figures = f'{out:.3f} m out, {back:.3f} m back; there: {words or "nothing limits"}'
        self.add('singularity', figures, problem)

    def motion(self, jerk: float, tracking: float, bus: BusFigures) -> None:
        """Take in what was measured all the time.

        Args:
            jerk: Greatest jerk, as a share of the limit.
            tracking: Greatest distance of a joint from where it was sent in [rad].
            bus: Bus and cycle.
        """
        figures = f'{100 * jerk:.1f} % of the limit of the joint'
        problem = f'{100 * jerk:.0f} % of a limit' if jerk > WORST_JERK else ''
        self.add('peak jerk', figures, problem)
        slow = f'a joint was {tracking:.3f} rad from its set-point'
        problem = slow if tracking > WORST_TRACKING and not bus.missed_pdos else ''
        self.add('joint tracking error', f'{1e3 * tracking:.2f} mrad', problem)
        self.add('bus and loop', bus_line(bus))

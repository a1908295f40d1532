# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The wave: which drives are in it, and where each is sent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..figures import AxisFigures, DriveFigures
from .axis import WaveAxis
from .plan import Swing, WaveStyle


class Wave:
    """Targets for the drives, at whatever rate they are asked for; times are steady, in [s].

    A drive that somebody else has stopped or moved stays out until the next :meth:`start`; the
    others go on.
    """

    def __init__(self, swings: Sequence[Swing], style: WaveStyle) -> None:
        """Send nobody anywhere.

        Args:
            swings: The motion of each axis, planned with this style.
            style: The style of the wave.
        """
        self._style = style
        self._axes = {swing.name: WaveAxis(swing) for swing in swings}
        self._left: list[str] = []

    @property
    def axes(self) -> Sequence[str]:
        """Names of the drives that it is for."""
        return list(self._axes)

    @property
    def active(self) -> Sequence[str]:
        """Names of the drives that are in it."""
        return [name for name, axis in self._axes.items() if axis.active]

    @property
    def figures(self) -> Mapping[str, AxisFigures]:
        """What was measured, by the name of the drive."""
        return {name: axis.figures() for name, axis in self._axes.items()}

    def start(self) -> None:
        """Take in every drive that stands and can follow; those that are in it go on."""
        for axis in self._axes.values():
            axis.ask()

    def stop(self) -> Sequence[str]:
        """Send nobody anywhere any more; return who was in it."""
        active = self.active
        for axis in self._axes.values():
            axis.leave('')
        return active

    def observe(self, drives: Mapping[str, DriveFigures], now: float) -> None:
        """See how the drives are; those that are no longer ours leave.

        Args:
            drives: What a message says of them, by name.
            now: The time.
        """
        for name, axis in self._axes.items():
            if name not in drives:
                continue
            before = axis.active
            axis.observe(drives[name], now, self._style)
            if before and not axis.active:
                self._left.append(f'{name} left the wave: {axis.left}')

    def departures(self) -> Sequence[str]:
        """Return who left it since this was called last, and why."""
        left, self._left = self._left, []
        return left

    def target(self, name: str, now: float) -> float | None:
        """Return where a drive is to be at a time, in [rad] or [m]; None when it is not in it."""
        return self._axes[name].target(now, self._style.omega)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The wave as a motion source: set-points for the drives, cycle by cycle."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
import math
from typing import TYPE_CHECKING

from .axis import AxisReport, WaveAxis
from .plan import quintic_step, stop_duration, Swing, WaveStyle

if TYPE_CHECKING:
    from arm_canopen import AxisFeedback, Refusal

REPORT_PERIOD = 0.2
"""Time between two reports in [s]."""


class WaveState(Enum):
    """What the wave is doing."""

    IDLE = 'idle'
    RUNNING = 'running'
    STOPPING = 'stopping'


class Command(Enum):
    """What it is asked to do, from other threads."""

    START = 'start'
    STOP = 'stop'


@dataclass(frozen=True, slots=True)
class WaveReport:
    """What the wave says of itself; immutable, so that any thread may read it.

    Attributes:
        state: What it is doing.
        axes: Its axes.
    """

    state: WaveState
    axes: tuple[AxisReport, ...]


@dataclass(frozen=True, slots=True)
class _Release:
    axis: str
    reason: str


class WaveSource:
    """Commands the wave; a :class:`arm_canopen.MotionSource`.

    :meth:`start`, :meth:`stop`, :meth:`released` and :attr:`report` are for any thread;
    :meth:`update` is for the cycle. An axis that is taken away stays out until the next start;
    the others go on.
    """

    def __init__(self, swings: Sequence[Swing], style: WaveStyle) -> None:
        """Stand still.

        Args:
            swings: The motion of each axis, planned with this style.
            style: The style of the wave.
        """
        self._style = style
        self._stop_duration = stop_duration(swings, style)
        self._axes = [WaveAxis(swing) for swing in swings]
        self._commands: deque[Command | _Release] = deque()
        self._state = WaveState.IDLE
        self._start_again = False
        self._theta = 0.0
        self._stopping = 0.0
        self._since_report = 0.0
        self._report = self._make_report()

    @property
    def axes(self) -> Sequence[str]:
        """Names of the drives."""
        return [axis.swing.name for axis in self._axes]

    @property
    def report(self) -> WaveReport:
        """The latest report, at most :data:`REPORT_PERIOD` of cycles old."""
        return self._report

    @property
    def stop_duration(self) -> float:
        """How long a stop takes in [s]."""
        return self._stop_duration

    def start(self) -> None:
        """Let every axis that can follow take part, at the next cycle; those that do go on."""
        self._commands.append(Command.START)

    def stop(self) -> None:
        """Slow down on the path and stand still."""
        self._commands.append(Command.STOP)

    def released(self, axis: str, refusal: Refusal) -> None:
        """Leave an axis alone until the next start.

        Args:
            axis: Name of the drive.
            refusal: Why it was taken away.
        """
        self._commands.append(_Release(axis, f'it {refusal}'))

    def update(
        self, now: float, period: float, feedback: Sequence[AxisFeedback]
    ) -> Sequence[float | None]:
        """Answer the set-points of a cycle.

        The wave advances by nominal cycles, not by the clock: a late cycle must not show up as a
        jump of the set-point.

        Args:
            now: Steady time in [s]; not needed.
            period: Time to the next cycle in [s].
            feedback: State of each axis.

        Returns:
            A position in [rad] for each axis that takes part, None for the others.
        """
        del now
        while self._commands:  # first: a release says why an axis can no longer follow
            self._carry_out(self._commands.popleft(), feedback)
        for axis, state in zip(self._axes, feedback, strict=True):
            axis.measure(state.position)
            if axis.active and state.refusal is not None:
                axis.leave(f'it {state.refusal}')
        setpoints = self._advance(period)
        self._since_report += period
        if self._since_report >= REPORT_PERIOD:
            self._since_report = 0.0
            self._report = self._make_report()
        return setpoints

    def _carry_out(self, command: Command | _Release, feedback: Sequence[AxisFeedback]) -> None:
        if command is Command.START:
            self._enter(feedback)
        elif command is Command.STOP:
            self._start_again = False
            if self._state is WaveState.RUNNING:
                self._state = WaveState.STOPPING
                self._stopping = 0.0
        elif isinstance(command, _Release):
            for axis in self._axes:
                if axis.swing.name == command.axis:
                    axis.leave(command.reason)

    def _enter(self, feedback: Sequence[AxisFeedback]) -> None:
        if self._state is WaveState.STOPPING:
            self._start_again = True  # when it stands still
            return
        fresh = self._state is WaveState.IDLE
        for axis, state in zip(self._axes, feedback, strict=True):
            if fresh:
                axis.clear()
            if state.refusal is None and not axis.active:
                axis.enter(state.setpoint, self._style)
        self._state = WaveState.RUNNING

    def _advance(self, period: float) -> Sequence[float | None]:
        if self._state is WaveState.IDLE:
            return [None] * len(self._axes)
        step = period * self._phase_rate(period)
        self._theta = math.remainder(self._theta + self._style.omega * step, 2 * math.pi)
        setpoints = [
            axis.advance(step, self._theta) if axis.active else None for axis in self._axes
        ]
        if self._state is WaveState.STOPPING and self._stopping >= self._stop_duration:
            self._stand_still()
        return setpoints

    def _phase_rate(self, period: float) -> float:
        """How fast the time of the wave goes in this cycle, from 1 down to 0 in a stop."""
        if self._state is WaveState.RUNNING:
            return 1.0
        self._stopping += period
        return 1.0 - quintic_step((self._stopping - period / 2) / self._stop_duration)

    def _stand_still(self) -> None:
        self._state = WaveState.IDLE
        for axis in self._axes:
            axis.leave('')
        if self._start_again:
            self._start_again = False
            self._commands.append(Command.START)
        self._report = self._make_report()

    def _make_report(self) -> WaveReport:
        return WaveReport(self._state, tuple(axis.report() for axis in self._axes))

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Progress in a line, the summary at the end, and whether all went well."""

from __future__ import annotations

from collections.abc import Sequence
import math

from .figures import AxisFigures, BusFigures, DriveFigures, Figures

LEAST_MOTION = 0.1
"""A joint that moved less than this in [rad] or [m] did not wave."""
WORST_PATH_ERROR = 0.2
"""A joint that was this far from its set-point in [rad] or [m] did not follow."""


def bus_line(bus: BusFigures) -> str:
    """Say how the bus and its cycle are.

    Args:
        bus: Its figures.
    """
    jitter = f'{_known(1000 * bus.jitter_p50, 2)}/{_known(1000 * bus.jitter_p99, 2)} ms'
    return (
        f'{_known(bus.frames_per_second)} frames/s, load {_known(bus.load)} %, lost {bus.lost}, '
        f'cycle jitter p50/p99 {jitter}, missed PDOs {bus.missed_pdos}'
    )


def progress_line(figures: Figures, joints: Sequence[str]) -> str:
    """Say how it goes.

    Args:
        figures: The latest.
        joints: Names of all joints of the demo.
    """
    errors = [axis.error_max for axis in figures.axes.values()]
    worst = f', path error {_known(1000 * max(errors), 1)} mrad' if errors else ''
    enabled = f'{figures.enabled}/{len(joints)} joints enabled'
    return f'{enabled}, {bus_line(figures.bus)}{worst}'


def summary_lines(figures: Figures, joints: Sequence[str], duration: float) -> list[str]:
    """Sum a demo up.

    Args:
        figures: The last ones before it was stopped.
        joints: Names of all joints of the demo.
        duration: How long the wave ran in [s].
    """
    width = max(len('joint'), *map(len, joints))
    head = (
        f'{"joint":<{width}}  {"from [rad]":>10}  {"to [rad]":>8}  {"moved":>6}  '
        f'{"path error max [mrad]":>21}  {"rms":>6}'
    )
    rows = [
        f'{name:<{width}}  {_known(axis.lowest, 3):>10}  {_known(axis.highest, 3):>8}  '
        f'{_known(axis.moved, 3):>6}  {_known(1000 * axis.error_max, 2):>21}  '
        f'{_known(1000 * axis.error_rms, 2):>6}'
        for name in joints
        for axis in [figures.axes.get(name, AxisFigures())]
    ]
    return [
        f'{duration:.1f} s of wave, {figures.enabled}/{len(joints)} joints enabled',
        head,
        *rows,
        bus_line(figures.bus),
    ]


def _known(value: float, digits: int = 0) -> str:
    return f'{value:.{digits}f}' if math.isfinite(value) else '-'


def problems(figures: Figures, joints: Sequence[str]) -> list[str]:
    """Say what went wrong: each joint that was not enabled, did not move or did not follow.

    A joint that somebody took out of the wave from a second terminal has moved before. Where
    drives answered late, what they measured does not judge a path.

    Args:
        figures: The last ones before it was stopped.
        joints: Names of all joints of the demo.

    Returns:
        One sentence each; empty when all went well.
    """
    found = []
    for name in joints:
        drive = figures.drives.get(name, DriveFigures())
        axis = figures.axes.get(name, AxisFigures())
        if not drive.enabled:
            why = drive.message or drive.state or 'not heard of'
            found.append(f'{name} is not enabled: {why}')
        elif axis.moved < LEAST_MOTION:
            found.append(f'{name} did not move: {axis.moved:.3f} rad, less than {LEAST_MOTION}')
        elif axis.error_max > WORST_PATH_ERROR and not figures.bus.missed_pdos:
            found.append(f'{name} was {axis.error_max:.3f} rad away from its path')
    return found


def warnings(figures: Figures) -> list[str]:
    """Say what is worth a look although the demo went well.

    Args:
        figures: The last ones before it was stopped.
    """
    found = []
    if figures.bus.lost:
        busy = 'this host was too busy to read them in time'
        found.append(f'{figures.bus.lost} frames were lost: {busy}')
    if figures.bus.missed_pdos:
        old = 'what was measured then is older than what was commanded'
        found.append(f'{figures.bus.missed_pdos} PDOs of drives missed their cycle: {old}')
    return found

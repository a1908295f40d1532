# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Progress in a line, the summary at the end, and whether all went well."""

from __future__ import annotations

from collections.abc import Mapping
import math

from urdf_reader import JointRange

from .figures import AxisFigures, BusFigures, DriveFigures, Figures

LEAST_MOTION, LEAST_MOTION_SHARE, LEAST_MOTION_TIME = 0.1, 0.1, 0.2
"""A joint that moved less than the least of these did not wave: in [rad] or [m], as a share of its
range, and in [s] at its greatest speed."""
WORST_PATH_ERROR = 2.0
"""A joint that was as many times as far from its set-point did not follow."""


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


def least_motion(limits: JointRange) -> float:
    """Return how far a joint must move to count as moved, in [rad] or [m].

    Args:
        limits: Its range and speed.
    """
    bounds = [LEAST_MOTION, LEAST_MOTION_SHARE * (limits.upper - limits.lower)]
    if limits.velocity > 0.0:
        bounds.append(LEAST_MOTION_TIME * limits.velocity)
    return min(bounds)


def progress_line(figures: Figures, joints: Mapping[str, JointRange]) -> str:
    """Say how it goes.

    Args:
        figures: The latest.
        joints: All joints of the demo.
    """
    errors = {
        name: figures.axes[name].error_max / least_motion(limits)
        for name, limits in joints.items()
        if name in figures.axes
    }
    worst = ''
    if errors:
        name = max(errors, key=lambda each: errors[each])
        error = _known(1000 * figures.axes[name].error_max, 1)
        worst = f', path error {error} m{joints[name].unit}'
    enabled = f'{figures.enabled}/{len(joints)} joints enabled'
    return f'{enabled}, {bus_line(figures.bus)}{worst}'


def summary_lines(
    figures: Figures, joints: Mapping[str, JointRange], duration: float
) -> list[str]:
    """Sum a demo up.

    Args:
        figures: The last ones before it was stopped.
        joints: All joints of the demo.
        duration: How long the wave ran in [s].
    """
    width = max(len('joint'), *map(len, joints))
    head = (
        f'{"joint":<{width}}  {"from":>8}  {"to":>8}  {"moved":>11}  '
        f'{"path error max":>15}  {"rms":>6}'
    )
    rows = [
        f'{name:<{width}}  {_known(axis.lowest, 3):>8}  {_known(axis.highest, 3):>8}  '
        f'{_known(axis.moved, 3):>7} {limits.unit:<3}  '
        f'{_known(1000 * axis.error_max, 2):>10} {"m" + limits.unit:<4}  '
        f'{_known(1000 * axis.error_rms, 2):>6}'
        for name, limits in joints.items()
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


def problems(figures: Figures, joints: Mapping[str, JointRange]) -> list[str]:
    """Say what went wrong: each joint that was not enabled, did not move or did not follow.

    A joint is judged in its own unit, and by its own range and speed.

    A joint that somebody took out of the wave from a second terminal has moved before. Where
    drives answered late, what they measured does not judge a path.

    Args:
        figures: The last ones before it was stopped.
        joints: All joints of the demo.

    Returns:
        One sentence each; empty when all went well.
    """
    found = []
    for name, limits in joints.items():
        least = least_motion(limits)
        drive = figures.drives.get(name, DriveFigures())
        axis = figures.axes.get(name, AxisFigures())
        if not drive.enabled:
            why = drive.message or drive.state or 'no diagnostics'
            found.append(f'{name} is not enabled: {why}')
        elif axis.moved < least:
            far = f'{axis.moved:.3f} {limits.unit}, less than {least:g}'
            found.append(f'{name} did not move: {far}')
        elif axis.error_max > WORST_PATH_ERROR * least and not figures.bus.missed_pdos:
            found.append(f'{name} was {axis.error_max:.3f} {limits.unit} away from its path')
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

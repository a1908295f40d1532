# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All that was found of a policy, as tables for people and as a file of figures."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
import math
from typing import TextIO

from ..gait.velocity import Velocity
from .conditions import Sweep
from .course import AXES, axis_of, CourseFigures, Passage

POLICY, GAIT = 'policy', 'gait'


@dataclass(frozen=True, slots=True)
class Compared:
    """What two came to on the same course."""

    title: str  # where that was
    policy: CourseFigures  # what the policy came to
    gait: CourseFigures  # what the gait came to


@dataclass(frozen=True, slots=True)
class Swept:
    """What a sweep of one parameter came to."""

    sweep: Sweep  # what was tried
    results: tuple[Compared, ...]  # for each of its values


@dataclass(slots=True)
class Findings:
    """All that was found of a policy."""

    courses: list[Compared] = field(default_factory=list)  # courses that policy and gait walked
    sweeps: list[Swept] = field(default_factory=list)  # what was tried besides
    # single walks: commanded, went in [m/s] and [rad/s], largest tilt in [rad]
    walks: list[tuple[Velocity, Velocity, float]] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)  # why it does not stand up
    notes: list[str] = field(default_factory=list)  # what else is to be known


Table = list[tuple[str, ...]]
"""Rows of cells; the first one has the headings."""


def tracking_table(compared: Compared) -> Table:
    """Return what was commanded and what both came to."""
    table: Table = [('axis', 'commanded', POLICY, 'off by', GAIT, 'off by')]
    for mine, other in zip(compared.policy.passages, compared.gait.passages, strict=True):
        axis = mine.axis
        commanded = _along(axis, mine.commanded)
        cells = [axis, f'{commanded:+.3f} {"rad/s" if axis == "turn" else "m/s"}']
        for each in (mine, other):
            error = each.turning_error if axis == 'turn' else each.error
            cells += [_number(_along(axis, each.went), '+.3f'), _number(error, '.3f')]
        table.append(tuple(cells))
    return table


def figures_table(compared: Compared) -> Table:
    """Return figures of the whole course, a row for each."""
    pair = compared.policy, compared.gait
    rows: Table = [('', POLICY, GAIT)]
    for axis in AXES:
        name, unit = ('turning_error', 'rad/s') if axis == 'turn' else ('error', 'm/s')
        cells = [_number(each.mean(name, axis), '.3f') for each in pair]
        if any(passage.axis == axis for passage in pair[0].passages):
            rows.append((f'{axis}, off by [{unit}]', *cells))
    rows.append(('falls in a minute', *(_number(each.falls_per_minute, '.1f') for each in pair)))
    for title, name, form, factor in (
        ('largest tilt, mean [deg]', 'tilt', '.1f', 180.0 / math.pi),
        ('servos at their largest torque [%]', 'torque_saturation', '.1f', 100.0),
        ('joints at their largest speed [%]', 'speed_saturation', '.1f', 100.0),
        ('bend of the targets, rms [mrad]', 'smoothness', '.1f', 1e3),
        ('cost of transport', 'cost_of_transport', '.2f', 1.0),
    ):
        rows.append((title, *(_number(factor * each.mean(name), form) for each in pair)))
    timings = [each.timing for each in pair]
    if any(timings):
        for title, share, kind in (
            ('observation to command, p50 [ms]', 0.5, 'latency'),
            ('observation to command, p99 [ms]', 0.99, 'latency'),
            ('jitter of commands, p99 [ms]', 0.99, 'jitter'),
        ):
            figures = [
                math.nan if each is None else getattr(each, kind)(share) for each in timings
            ]
            rows.append((title, *(_number(1e3 * each, '.1f') for each in figures)))
    return rows


def sweep_table(swept: Swept) -> Table:
    """Return falls and errors at each value."""
    sweep = swept.sweep
    heading = f'{sweep.title} [{sweep.unit}]' if sweep.unit else sweep.title
    table: Table = [(heading, f'{POLICY}, falls/min', 'off by [m/s]')]
    table[0] += (f'{GAIT}, falls/min', 'off by [m/s]')
    for value, result in zip(sweep.values, swept.results, strict=True):
        cells = [sweep.text(value)]
        for each in (result.policy, result.gait):
            cells += [_number(each.falls_per_minute, '.1f'), _number(each.error, '.3f')]
        table.append(tuple(cells))
    return table


def text_of(table: Table) -> str:
    """Return a table for a terminal."""
    widths = [max(len(row[column]) for row in table) for column in range(len(table[0]))]
    return '\n'.join(
        '  '.join(
            cell.rjust(width) if column else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in table
    )


CSV_COLUMNS = (
    *('tried', 'walker', 'axis', 'commanded x [m/s]', 'commanded y [m/s]'),
    *('commanded yaw [rad/s]', 'went x [m/s]', 'went y [m/s]', 'went yaw [rad/s]'),
    *('tilt [rad]', 'time [s]', 'falls', 'torque saturation', 'speed saturation'),
    *('smoothness [rad]', 'cost of transport', 'latency p50 [s]', 'latency p99 [s]'),
    'jitter p99 [s]',
)


def write_csv(file: TextIO, findings: Findings) -> None:
    """Write a row for each command that policy or gait walked; what was not measured is empty."""
    writer = csv.writer(file, lineterminator='\n')
    writer.writerow(CSV_COLUMNS)
    for commanded, went, tilt in findings.walks:
        row = 'walk', POLICY, axis_of(commanded), *commanded, *went, tilt
        writer.writerow([*row, *[''] * (len(CSV_COLUMNS) - len(row))])
    named = [(each.title, each) for each in findings.courses]
    named += [
        (f'{swept.sweep.title} {each.title} {swept.sweep.unit}'.rstrip(), each)
        for swept in findings.sweeps
        for each in swept.results
    ]
    for title, compared in named:
        for who, course in ((POLICY, compared.policy), (GAIT, compared.gait)):
            writer.writerows(_csv_row(title, who, each) for each in course.passages)


def _csv_row(title: str, who: str, passage: Passage) -> list[str | float]:
    timing = passage.timing
    times = () if timing is None else (
        timing.latency(0.5), timing.latency(0.99), timing.jitter(0.99)
    )  # fmt: skip
    figures = (
        *(passage.tilt, passage.time, passage.falls, passage.torque_saturation),
        *(passage.speed_saturation, passage.smoothness, passage.cost_of_transport),
    )
    values = *passage.commanded, *passage.went, *figures, *times
    row = [title, who, passage.axis, *('' if math.isnan(value) else value for value in values)]
    return row + [''] * (len(CSV_COLUMNS) - len(row))


def _along(axis: str, velocity: Velocity) -> float:
    return float(getattr(velocity, AXES[axis]))


def _number(value: float, form: str) -> str:
    return format(value, form) if math.isfinite(value) else '-'

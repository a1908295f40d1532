# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen check BUS.yml`` and ``canopen eds FILE``: check files."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path

from arm_canopen.config import (
    ACCELERATION_KEY,
    AxisUnits,
    check_file,
    LoadEstimate,
    MOTION_OBJECTS,
    Report,
    RPDO,
    TPDO,
    Traffic,
    UnitRule,
)
from canopen_core.eds import Eds
from canopen_core.standard import Index

from ..eds_lint import EdsReport, lint_eds
from .arguments import (
    bitrate,
    counted,
    print_line,
    print_problem,
    print_table,
    RED,
    SubParsers,
    YELLOW,
)

MOTION_TITLES = {
    Index.PROFILE_VELOCITY: 'speed of moves',
    Index.MAX_PROFILE_VELOCITY: 'at most',
    Index.PROFILE_ACCELERATION: 'acceleration',
    Index.PROFILE_DECELERATION: 'deceleration',
    Index.QUICK_STOP_DECELERATION: 'quick stop',
}
"""Column titles; the values are in the units of bus.yml."""


def add_check(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'check',
        help='report everything that is wrong with a bus.yml and its EDS files',
        description='Report everything that is wrong with a bus.yml and its EDS files, and what '
        'the bus will carry. Exit code: 0, 1 with errors, 2 wrong usage.',
    )
    parser.add_argument('bus_yml', metavar='BUS.yml', type=Path)
    parser.add_argument(
        '--bitrate',
        type=bitrate,
        help='bit rate of the bus in bit/s, for its load, e.g. 500000 or 500k (default: baudrate '
        'of the file)',
    )
    parser.add_argument('--strict', action='store_true', help='warnings count as errors')
    parser.add_argument('--frames', action='store_true', help='list the load of each frame')
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Check a file; return the exit code."""
    return show_check(
        options.bus_yml, options.bitrate, strict=options.strict, frames=options.frames
    )


def show_check(
    path: Path, bit_rate: int | None = None, *, strict: bool = False, frames: bool = False
) -> int:
    """Check a bus.yml, and print problems and bus load; return the exit code.

    bit_rate in [bit/s] overrides the file; strict makes warnings errors; frames lists each frame.
    """
    report = check_file(path, bit_rate)
    _print_problems(report)
    if report.units:
        _print_units(report.units)
        _print_motion(report.units)
    if report.load is not None and report.load.traffic:
        _print_load(report.load, each=frames)
    return _conclude(report, f'{path}: ', strict=strict)


def _print_problems(report: Report | EdsReport) -> None:
    for problem in report.errors:
        print_problem(problem, 'error', RED)
    for problem in report.warnings:
        print_problem(problem, 'warning', YELLOW)


def _conclude(report: Report | EdsReport, subject: str, *, strict: bool) -> int:
    """Print the last line of a report; return its exit code."""
    errors, warnings = len(report.errors), len(report.warnings)
    print_line(f'{subject}{counted(errors, "error")}, {counted(warnings, "warning")}')
    return 1 if errors or (strict and warnings) else 0


def _print_units(units: Sequence[AxisUnits]) -> None:
    rows = [
        (
            axis.name,
            f'{axis.increments:g}',
            '?' if axis.radians is None else f'{axis.radians:.4g}',
            f'{axis.velocity:g}',
            _acceleration(axis),
            _rule(axis),
        )
        for axis in units
    ]
    head = ('1.0 of', 'increments', 'rad', 'velocity units', 'acceleration units', 'by')
    print_table(head, rows, right='increments,rad,velocity units,acceleration units')
    if any(axis.radians is not None and f'{axis.radians:.4g}' != '1' for axis in units):
        print_line(
            'rad: how far 1.0 is by the factor group of the EDS: 1 where 1.0 is a radian, '
            'more where the EDS lacks the gear, or the joint slides'
        )
    if any(axis.radians is None for axis in units):
        print_line(
            '?: the EDS has no factor group (0x608F, 0x6091, 0x6092) that says how many rad it is'
        )


def _acceleration(axis: AxisUnits) -> str:
    """Return the acceleration scale, with its source if that is not bus.yml."""
    assumed = 'default' if axis.rule is UnitRule.UPSTREAM else 'assumed'  # there is a warning
    by = axis.acceleration_by or assumed
    return f'{axis.acceleration:g}' + ('' if by == ACCELERATION_KEY else f' ({by})')


def _rule(axis: AxisUnits) -> str:
    """Return the source of a scale, with the objects that the EDS contains."""
    if axis.rule is not UnitRule.FACTOR_GROUP or not axis.factors:
        return axis.rule.value
    return f'{axis.rule.value} ({", ".join(f"0x{index:04X}" for index in axis.factors)})'


def _print_motion(units: Sequence[AxisUnits]) -> None:
    """Print each drive's profile velocity and accelerations; a slow drive seems to hang."""
    known = [index for index in MOTION_OBJECTS if any(index in axis.motion for axis in units)]
    if not known:
        return
    rows = [
        (axis.name, *(f'{axis.motion[i]:.4g}' if i in axis.motion else '-' for i in known))
        for axis in units
    ]
    titles = [f'0x{index:04X} {MOTION_TITLES[index]}' for index in known]
    print_table(('in user units, s', *titles), rows, right=','.join(titles))


def _print_load(load: LoadEstimate, *, each: bool) -> None:
    if each:
        rows = [
            (f'{t.service} of {t.device}', f'{t.cob_id:03X}', *_figures([t], load.bitrate))
            for t in sorted(load.traffic, key=lambda t: t.cob_id)
        ]
        head = ('frame', 'id', 'bytes', 'frames/s', 'load', 'when')
        print_table(head, rows, right='bytes,frames/s,load')
    else:
        _print_groups(load)
    print_line(
        f'load at {load.bitrate / 1000:g} kbit/s: {load.frames_per_second:.0f} frames/s, '
        f'{load.load:.1%} ({load.load_worst:.1%} with the most stuffing)'
    )


def _print_groups(load: LoadEstimate) -> None:
    """Print a table with equal frames of several devices in one row."""

    def likeness(item: Traffic) -> tuple[str, int, str]:
        return item.service, item.size, item.reason

    groups = [list(group) for _, group in groupby(sorted(load.traffic, key=likeness), likeness)]
    groups.sort(key=lambda group: group[0].cob_id)
    rows = [
        (
            group[0].service,
            str(len({item.device for item in group})),
            *_figures(group, load.bitrate),
        )
        for group in groups
    ]
    head = ('frame', 'devices', 'bytes', 'frames/s', 'load', 'when')
    print_table(head, rows, right='devices,bytes,frames/s,load')


def _figures(group: Iterable[Traffic], bit_rate: int) -> tuple[str, str, str, str]:
    items = list(group)
    share = sum(item.bits for item in items) / bit_rate
    rate = sum(item.rate for item in items)
    return str(items[0].size), f'{rate:.1f}', f'{share:.1%}', items[0].reason


def add_eds(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'eds',
        help='report what is wrong with EDS and DCF files',
        description='Report what is wrong with EDS and DCF files (CiA 306), and what reading them '
        'passes over. Exit code: 0, 1 with errors, 2 wrong usage.',
    )
    parser.add_argument('files', metavar='FILE', type=Path, nargs='+')
    parser.add_argument('--strict', action='store_true', help='warnings count as errors')
    parser.set_defaults(run=check_eds)


def check_eds(options: argparse.Namespace) -> int:
    """Check files; return the exit code."""
    code = 0
    for path in options.files:
        report = lint_eds(path)
        _print_problems(report)
        what = f'{_summary(report.eds)}; ' if report.eds is not None else ''
        code |= _conclude(report, f'{path}: {what}', strict=options.strict)
    return code


def _summary(eds: Eds) -> str:
    indices = {entry.index for entry in eds.dictionary}
    parts = [
        counted(len(indices), 'object'),
        counted(len(RPDO.numbers(eds.dictionary)), 'RPDO'),
        counted(len(TPDO.numbers(eds.dictionary)), 'TPDO'),
    ]
    if eds.node_id is not None:
        parts.append(f'for node {eds.node_id}')
    return ', '.join(parts)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``canopen eds FILE``: what is wrong with EDS and DCF files."""

from __future__ import annotations

import argparse
from pathlib import Path

from arm_canopen.config import RPDO, TPDO
from canopen_core.eds import Eds

from ..eds_lint import EdsReport, lint_eds
from .arguments import SubParsers
from .output import counted, print_line, print_problem, RED, YELLOW


def add_parser(parsers: SubParsers) -> None:
    """Add the verb."""
    parser = parsers.add_parser(
        'eds',
        help='report what is wrong with EDS and DCF files',
        description='Report what is wrong with EDS and DCF files (CiA 306), and what reading them '
        'passes over. Exit code: 0, 1 with errors, 2 wrong usage.',
    )
    parser.add_argument('files', metavar='FILE', type=Path, nargs='+')
    parser.add_argument('--strict', action='store_true', help='warnings count as errors')
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> int:
    """Check files; return the exit code."""
    reports = [_show(path, lint_eds(path)) for path in options.files]
    bad = any(report.errors or (options.strict and report.warnings) for report in reports)
    return 1 if bad else 0


def _show(path: Path, report: EdsReport) -> EdsReport:
    for problem in report.errors:
        print_problem(problem, 'error', RED)
    for problem in report.warnings:
        print_problem(problem, 'warning', YELLOW)
    what = f'{_summary(report.eds)}; ' if report.eds is not None else ''
    errors, warnings = len(report.errors), len(report.warnings)
    print_line(f'{path}: {what}{counted(errors, "error")}, {counted(warnings, "warning")}')
    return report


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

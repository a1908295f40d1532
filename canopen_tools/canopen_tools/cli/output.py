# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writing results and tables to the terminal; warnings go to stderr."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
import os
import sys

from canopen_core import Problem

RED, YELLOW, RESET = '\x1b[1;31m', '\x1b[33m', '\x1b[0m'


def print_line(text: str = '') -> None:
    """Write a line of the result.

    Raises:
        BrokenPipeError: Nobody reads any more.
    """
    sys.stdout.write(f'{text}\n')


def warn(text: str) -> None:
    """Write a line for a person, beside the result."""
    with suppress(BrokenPipeError):
        sys.stdout.flush()
        sys.stderr.write(f'canopen: {text}\n')
        sys.stderr.flush()


def print_problem(problem: Problem, kind: str, color: str) -> None:
    """Write a problem as compilers do, its remedy in the line below."""
    place = f'{problem.file}:{problem.line}' if problem.line else str(problem.file)
    key = f'{problem.key}: ' if problem.key else ''
    print_line(f'{place}: {painted(kind, color)}: {key}{problem.message}')
    if problem.remedy:
        print_line(f'    {problem.remedy}')


def painted(text: str, color: str) -> str:
    """Return a text in colour, when a person looks at it."""
    if not sys.stdout.isatty() or 'NO_COLOR' in os.environ:
        return text
    return f'{color}{text}{RESET}'


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], right: str = '') -> None:
    """Write a table; right names the columns that are flush right, separated by commas."""
    flush_right = set(right.split(','))
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = (
            cell.rjust(width) if title in flush_right else cell.ljust(width)
            for cell, width, title in zip(row, widths, head, strict=True)
        )
        print_line('  '.join(cells).rstrip())


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``1 error``, ``2 errors``."""
    return f'{number} {noun}' if number == 1 else f'{number} {noun}s'

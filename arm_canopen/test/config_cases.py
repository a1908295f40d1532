# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Wrong pieces of a bus.yml, and the check that each is reported as it should be."""

from __future__ import annotations

from pathlib import Path
import re
import textwrap
from typing import NamedTuple

from config_samples import BUS, errors_of, write_bus

HERE = '# <-'
"""Marks the line that a problem must name."""

PREFIXES = {'master': 'master.', 'defaults': 'defaults.', 'joint1': 'nodes.joint1.', 'top': ''}


class Case(NamedTuple):
    """A wrong piece of a bus.yml.

    Attributes:
        section: Section that the piece is added to: ``master``, ``defaults``, ``joint1``, or
            ``top`` for the top level.
        piece: What is added.
        key: Key path of the problem, from the section on.
        message: Pattern of what is said.
        remedy: Pattern of what is advised.
    """

    section: str
    piece: str
    key: str
    message: str
    remedy: str


def added(section: str, piece: str) -> str:
    """Add a piece to a section of the sample; own keys replace equal ones."""
    piece = textwrap.dedent(piece).strip('\n')
    if section == 'top':
        return f'{BUS}{piece}\n'
    depth = 4 if section == 'joint1' else 2
    lines = BUS.splitlines()
    start = next(i for i, line in enumerate(lines) if line.strip() == f'{section}:')
    end = next((i for i in range(start + 1, len(lines)) if lines[i][:depth].strip()), len(lines))
    names = re.findall(r'^([\w]+):', piece, flags=re.MULTILINE)
    body = _without(lines[start + 1 : end], {' ' * depth + name for name in names})
    addition = textwrap.indent(piece, ' ' * depth).splitlines()
    return '\n'.join([*lines[: start + 1], *body, *addition, *lines[end:]]) + '\n'


def _without(lines: list[str], names: set[str]) -> list[str]:
    """Leave out keys and what is indented below them."""
    kept: list[str] = []
    dropping = False
    for line in lines:
        is_key = line.partition(':')[0] in names
        dropping = is_key or (dropping and line.startswith(' ' * 4))
        if not dropping:
            kept.append(line)
    return kept


def check(folder: Path, case: Case, eds: str | None = None) -> None:
    """Assert that a case is reported with the marked line, its key, its message and its remedy."""
    text = added(case.section, case.piece)
    line = next(i for i, line in enumerate(text.splitlines(), 1) if HERE in line)
    path = write_bus(folder, text, eds=eds)
    problems = errors_of(path)
    assert any(
        problem.file == path
        and problem.line == line
        and problem.key == PREFIXES[case.section] + case.key
        and re.search(case.message, problem.message)
        and re.search(case.remedy, problem.remedy)
        for problem in problems
    ), [str(problem) for problem in problems]

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Pieces that are added to the sample of a bus.yml."""

from __future__ import annotations

import re
import textwrap

from config_samples import BUS


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

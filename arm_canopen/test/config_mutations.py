# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Damaging texts as people, editors and cut cables do."""

from collections.abc import Sequence
import random

MUTATIONS_MAX = 3


def mutated(text: str, snippets: Sequence[str], generator: random.Random) -> str:
    """Return a text with a few random changes; snippets are inserted beside its own parts."""
    for _ in range(generator.randint(1, MUTATIONS_MAX)):
        text = _mutate_once(text, snippets, generator)
    return text


def _mutate_once(text: str, snippets: Sequence[str], generator: random.Random) -> str:
    start = generator.randrange(len(text) + 1)
    end = min(len(text), start + generator.choice((0, 1, 2, 5, 20, 200)))
    lines = text.split('\n')
    line = generator.randrange(len(lines))
    kind = generator.randrange(6)
    if kind == 0:
        return text[:start] + text[end:]
    if kind == 1:
        return text[:start] + generator.choice(snippets) + text[end:]
    if kind == 2:
        return text[:start] + text[start:end] * 2 + text[end:]
    if kind == 3:
        lines[line] = generator.choice(snippets)
    elif kind == 4:
        lines.insert(line, generator.choice(lines))
    else:
        head, mark, _ = lines[line].partition(generator.choice(('=', ':')))
        lines[line] = head + mark + generator.choice(snippets)
    return '\n'.join(lines)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The commands of a page of the manual, with what the page shows of their output.

A command stands behind ``$`` in a block of the language console; the lines below it are what it
prints. A line ``...`` stands for any lines, ``...`` in a line for anything; numbers count as
numbers only. A command that ends with ``<<'END'`` goes on to the line ``END``. A comment before
the block says what differs from a command that ends well:

    <!-- stays -->                     it goes on in its terminal until the page ends
    <!-- in any order -->              the commands of the block run at the same time
    <!-- until Ctrl-C -->              it is ended when all of it was printed
    <!-- fails -->                     its exit code is not 0
    <!-- keys: q -->                   in a terminal, where these keys end it
    <!-- run by: tests/test_x.py -->   another test runs it, and compares its output
    <!-- not run: why -->              this machine cannot
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
import re

CHECKOUT = Path(__file__).parents[1]
PAGES = sorted((CHECKOUT / 'docs').rglob('*.md'))
_BLOCK = re.compile(
    r'(?:^<!-- (?P<how>[a-zA-Z -]+?)(?:: (?P<detail>[^>]*?))? -->\n+)?'
    r'^```(?P<language>\w*)\n(?P<text>.*?)^```$',
    re.MULTILINE | re.DOTALL,
)
_NUMBER = re.compile(r'(?<![\w.])[-+]?\d+(?:\.\d+)*')
_TYPED = re.compile(r"[^\n]*<<'END'\n.*?^END$|(?:[^\n]*\\\n)*[^\n]*", re.MULTILINE | re.DOTALL)
_ANY_NUMBER = r'[-+]?\d+(?:\.\d+)*(?:e-?\d+)?'


class How(Enum):
    """How a command is run; the value is how a page says it."""

    RUN = ''
    TOGETHER = 'in any order'
    STAYS = 'stays'
    INTERRUPTED = 'until Ctrl-C'
    FAILS = 'fails'
    KEYS = 'keys'
    ELSEWHERE = 'run by'
    NOT_HERE = 'not run'


@dataclass(frozen=True, slots=True)
class Command:
    """A command of a page."""

    text: str  # as it is typed
    shown: tuple[str, ...]  # lines that the page shows of its output
    how: How  # how it is run
    block: int  # where its block begins in the page
    detail: str  # its keys, the test that runs it, or why it is not run

    def missing(self, printed: Iterable[str]) -> str:
        """Return the first shown line that was not printed, behind those before it; or nothing."""
        lines = iter(printed)
        for shown in self.shown:
            if shown.strip() == '...' or not shown.strip():
                continue
            pattern = line_pattern(shown)
            if not any(pattern.search(line) for line in lines):
                return shown
        return ''


def line_pattern(shown: str) -> re.Pattern[str]:
    """Return what a printed line has to match."""
    parts = (_with_any_number(part) for part in re.split(r'\.\.\.', ' '.join(shown.split())))
    return re.compile(r'^\s*' + '.*'.join(parts) + r'\s*$')


def commands(page: Path) -> Iterator[Command]:
    """Yield the commands of a page in order.

    Raises:
        ValueError: A comment or a block is not as it has to be.
    """
    for block in _BLOCK.finditer(page.read_text(encoding='utf-8')):
        if block['language'] != 'console':
            continue
        how = How(block['how'] or '')
        if not block['text'].startswith('$ '):
            raise ValueError(f'{page}: a block of console begins with "$ ":\n{block["text"]}')
        for typed in re.split(r'^\$ ', block['text'], flags=re.MULTILINE)[1:]:
            text = next(_TYPED.finditer(typed))[0]
            shown = typed.removeprefix(text).splitlines()[1:]
            yield Command(text, tuple(shown), how, block.start(), block['detail'] or '')


def missing_in_run(page: str, command: str, output: str) -> str:
    """Return the first line that a page shows of a command and that another test did not see.

    Args:
        page: Path of the page below docs.
        command: How it begins there.
        output: What the test saw.

    Raises:
        ValueError: The page has no such command.
    """
    for each in commands(CHECKOUT / 'docs' / page):
        if each.text.startswith(command) and each.how is How.ELSEWHERE:
            return each.missing(output.splitlines())
    raise ValueError(f'{page} has no {command!r} that is run elsewhere')


def _with_any_number(text: str) -> str:
    parts = _NUMBER.split(text)
    return _ANY_NUMBER.join(re.escape(part).replace(r'\ ', r'\s+') for part in parts)

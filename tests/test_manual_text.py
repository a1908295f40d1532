# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the manual says is there: texts of programs, commands, links; and it needs no network."""

from __future__ import annotations

import ast
from functools import cache
from html.parser import HTMLParser
import itertools
import os
from pathlib import Path
import re
import subprocess
import sys
from urllib.parse import unquote, urlsplit

from manual_page import CHECKOUT, commands, How, PAGES
import pytest

NOT_ENABLED = CHECKOUT / 'docs' / 'not_enabled.md'
SOURCES = (
    'arm_bringup/arm_bringup',
    'arm_canopen/arm_canopen',
    'arm_servo/arm_servo',
    'canopen_core/canopen_core',
    'canopen_sim/canopen_sim',
    'canopen_tools/canopen_tools',
    'libraries/ros_runtime/process_supervisor',
)
SHORTEST = 3  # characters of a text that follows another one
VALUE = '\0'  # stands for what a text puts in


@cache
def texts() -> str:
    """Collect every text of the sources, what is put into it left out."""

    def text(node: ast.expr) -> str:
        if isinstance(node, ast.JoinedStr):
            return ''.join(map(text, node.values))
        return str(node.value) if isinstance(node, ast.Constant) else VALUE

    files = [file for folder in SOURCES for file in sorted((CHECKOUT / folder).rglob('*.py'))]
    nodes = (node for file in files for node in ast.walk(ast.parse(file.read_text('utf-8'))))
    found = (node for node in nodes if isinstance(node, (ast.JoinedStr, ast.Constant)))
    return '\n'.join(map(text, found))


@cache
def tables() -> list[list[str]]:
    """Return the texts of each table of the page."""
    parts = re.split(r'^## ', NOT_ENABLED.read_text('utf-8'), flags=re.MULTILINE)[1:]
    return [re.findall(r'^\| `(.+?)` \|', part, re.MULTILINE) for part in parts if '\n| `' in part]


@pytest.mark.parametrize('text', [text for table in tables() for text in table])
def test_a_program_prints_the_text(text: str) -> None:
    """Each part between what differs is in a text of the sources, or put together of two."""
    for part in text.split('...'):
        assert is_printed(part.strip()), part


def test_texts_are_found_by_their_order() -> None:
    """A reader who has the text finds its row."""
    for table in tables():
        assert table == sorted(table, key=str.casefold)


def is_printed(part: str) -> bool:
    """Return whether the sources have a text, or two that it begins and ends with."""
    blanks = (place.start() for place in re.finditer(' ', part))
    halves = ((part[:place], part[place + 1 :]) for place in blanks)
    return part in texts() or any(
        one in texts() and other in texts() for one, other in halves if len(other) > SHORTEST
    )


def typed() -> list[str]:
    """Return all that the pages say to type, commands and words in the middle of a sentence."""
    found = []
    for page in PAGES:
        found += re.findall(r'`([^`\n]+)`', page.read_text('utf-8'))
        found += [command.text for command in commands(page)]
    return found


def test_executables_exist() -> None:
    """`ros2 run PACKAGE EXECUTABLE` names an entry point of a package."""
    foreign = {'plotjuggler', 'rviz2', 'tf2_ros'}
    for package, name in {pair for text in typed() for pair in _executables(text)}:
        if package not in foreign:
            marks = (CHECKOUT.glob(f'{top}*/resource/{package}') for top in ('', 'libraries/'))
            setup = next(itertools.chain(*marks)).parents[1] / 'setup.py'
            assert re.search(rf"['\"]{name}\b", setup.read_text('utf-8')), f'{package} {name}'


def test_targets_of_make_exist() -> None:
    """`make TARGET` is in the Makefile, and its help names it."""
    makefile = (CHECKOUT / 'Makefile').read_text('utf-8')
    targets = {match for text in typed() for match in re.findall(r'\bmake ([a-z][a-z-]*)\b', text)}
    assert targets
    for target in targets:
        assert re.search(rf'^{target}:', makefile, re.MULTILINE), target
        assert f"'make {target} " in makefile


def test_whoever_runs_a_command_elsewhere_compares_it() -> None:
    """A page that leaves a command to another test names one that looks at the page."""
    for page in PAGES:
        for command in commands(page):
            if command.how is How.ELSEWHERE:
                assert 'missing_in_run' in (CHECKOUT / command.detail).read_text('utf-8')
            if command.how is How.NOT_HERE:
                assert command.detail, 'why is it not run?'


def test_a_command_goes_on_behind_a_backslash_and_to_the_end_of_its_file(tmp_path: Path) -> None:
    """What it prints begins behind that."""
    page = tmp_path / 'page.md'
    blocks = "$ cat > a <<'END'\none \\\n\ntwo\nEND\n$ echo a \\\n  b\na b\n$ ls\na\nb\n"
    page.write_text(f'```console\n{blocks}```\n', 'utf-8')
    assert [(each.text, each.shown) for each in commands(page)] == [
        ("cat > a <<'END'\none \\\n\ntwo\nEND", ()),
        ('echo a \\\n  b', ('a b',)),
        ('ls', ('a', 'b')),
    ]


class Links(HTMLParser):
    """Collects what a page leads to, and what it fetches."""

    def __init__(self) -> None:
        super().__init__()
        self.links: set[str] = set()
        self.fetched: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Look at a tag."""
        values = dict(attrs)
        target = values.get('src') or values.get('href') or ''
        if tag == 'a':
            self.links.add(target)
        elif target and values.get('rel') not in {'canonical', 'prev', 'next'}:
            self.fetched.add(target)


def test_the_site_is_whole_and_fetches_nothing(tmp_path: Path) -> None:
    """It is built with warnings as errors; links lead to files, and nothing is got from a host."""
    mkdocs = Path(sys.executable).with_name('mkdocs')
    command: list[str | Path] = [mkdocs, 'build', '--quiet', '--strict', '--site-dir', tmp_path]
    env = os.environ | {'NO_MKDOCS_2_WARNING': '1'}
    done = subprocess.run(
        command, cwd=CHECKOUT, env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    pages = sorted(tmp_path.rglob('*.html'))
    assert {'index.html', 'not_enabled.html'} <= {page.name for page in pages}
    programs = (tmp_path / 'reference' / 'programs.html').read_text('utf-8')
    assert all(f'<code>{name}</code>' in programs for name in ('master', 'teleop_keyboard'))
    assert '<code>arm_msgs/srv/Move</code>' in programs
    for page in pages:
        found = Links()
        found.feed(page.read_text('utf-8'))
        for target in found.links | found.fetched:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                assert target not in found.fetched, f'{page}: {target}'
            elif parts.path and page.name != '404.html':
                assert (page.parent / unquote(parts.path)).exists(), f'{page}: {target}'


def _executables(text: str) -> list[tuple[str, str]]:
    return re.findall(r'\bros2 run ([a-z]\w+) ([a-z]\w+)', text)

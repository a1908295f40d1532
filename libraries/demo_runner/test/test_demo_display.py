# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the demo shows itself: table or lines."""

from __future__ import annotations

import io

import pytest
from rich.console import Console, RenderableType
from rich.text import Text

from demo_runner import (
    choose_display,
    compose,
    DemoStatus,
    LineDisplay,
    Setting,
    TableDisplay,
)
from process_supervisor import LineWriter, Notice, Painter, Severity

FIGURES = 3
"""The figures of the demo of this test: how many widgets run."""


class Widgets:
    """A view of a single number."""

    title = 'widgets on vcan0'

    def fits(self, width: int, height: int) -> bool:
        """Need the room of the smallest table."""
        return width >= 80 and height >= 14

    def render(self, figures: int, status: DemoStatus, width: int, height: int) -> RenderableType:
        """Draw one line."""
        return compose(self.title, status, [Text(f'{figures} widgets')], (width, width), height)

    def progress(self, figures: int) -> str:
        """Count them."""
        return f'{figures} widgets run'


SETTING = Setting(
    Widgets(), 0, ['ros2 topic hz /joint_states'], Painter('demo', ['master'], colour=False)
)


class Utf8(io.StringIO):
    """A file of a terminal, or of a printer from the last century."""

    encoding = 'utf-8'


class Latin1(io.StringIO):
    """A file that knows no dots and lines."""

    encoding = 'iso8859-1'


@pytest.mark.parametrize(
    'case',
    [
        (Utf8(), True, 'xterm', (80, 24), True),
        (Utf8(), False, 'xterm', (80, 24), False),
        (Utf8(), True, 'dumb', (80, 24), False),
        (Latin1(), True, 'xterm', (80, 24), False),
        (Utf8(), True, 'xterm', (60, 24), False),
        (Utf8(), True, 'xterm', (80, 10), False),
    ],
    ids=['terminal', 'pipe', 'dumb', 'no unicode', 'narrow', 'low'],
)
def test_the_table_is_for_terminals_that_have_room_for_it(
    monkeypatch: pytest.MonkeyPatch,
    case: tuple[io.StringIO, bool, str, tuple[int, int], bool],
) -> None:
    """Everything else gets lines; a warning says so where the terminal is too small."""
    file, terminal, term, size, table = case
    monkeypatch.setenv('TERM', term)
    width, height = size
    console = Console(file=file, force_terminal=terminal, width=width, height=height)
    lines = io.StringIO()
    display = choose_display(SETTING, console, LineWriter(lines))
    display.close()
    assert isinstance(display, TableDisplay if table else LineDisplay)
    assert ('too few' in lines.getvalue()) == (size != (80, 24))


def test_lines_show_phases_warnings_and_notices() -> None:
    """Information of the processes is left out: it would bury the rest."""
    lines = io.StringIO()
    display = LineDisplay(SETTING, LineWriter(lines))
    display.phase('booting')
    display.line('master', '[INFO] [master]: joint1 operational')
    display.line('master', '[WARN] [master]: joint2 silent')
    display.line('master', 'Traceback (most recent call last):')
    display.notice(Notice(Severity.INFO, 'all is ready'))
    display.show(FIGURES)  # too soon after a phase
    text = lines.getvalue()
    for words in ('widgets on vcan0', 'booting', 'joint2 silent', 'Traceback', 'all is ready'):
        assert words in text
    for words in ('joint1 operational', 'widgets run'):
        assert words not in text


def test_the_table_shows_what_was_said_last_and_stays_when_it_is_closed() -> None:
    """After the end it has no commands to be tried any more."""
    file = Utf8()
    console = Console(file=file, force_terminal=True, width=80, height=40, color_system=None)
    display = TableDisplay(SETTING, console)
    display.phase('waving')
    display.line('master', '[INFO] [master]: joint1 operational')
    display.line('master', '[ERROR] [master]: heartbeat lost')
    display.notice(Notice(Severity.INFO, 'stopping'))
    display.show(FIGURES)
    display.close()
    pictures = file.getvalue().split('widgets on vcan0')
    waving = [picture for picture in pictures if 'waving' in picture][-1]
    for words in ('waving', 'heartbeat lost', 'stopping', 'ros2 topic hz', '3 widgets'):
        assert words in waving
    assert 'joint1 operational' not in file.getvalue()
    assert 'ended' in pictures[-1]
    assert 'ros2 topic hz' not in pictures[-1]
    length = len(file.getvalue())
    display.show(FIGURES)
    assert len(file.getvalue()) == length


def test_what_lasts_stays_in_the_table_until_its_process_says_something_else() -> None:
    """The URL of a page, until the page is gone; other notices come and go."""
    file = Utf8()
    console = Console(file=file, force_terminal=True, width=80, height=40, color_system=None)
    display = TableDisplay(SETTING, console)
    display.notice(Notice(Severity.INFO, 'seen at http://localhost:8080', 'viewer', lasting=True))
    for number in range(20):
        display.notice(Notice(Severity.INFO, f'notice {number}'))
    display.phase('waving')
    assert 'http://localhost:8080' in file.getvalue().split('widgets on vcan0')[-1]
    display.notice(Notice(Severity.WARNING, 'viewer ended', 'viewer'))
    last = file.getvalue().split('widgets on vcan0')[-1]
    assert 'viewer ended' in last
    assert 'http://localhost:8080' not in last
    display.close()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Prefixes and colours, and bytes to lines."""

from __future__ import annotations

import io

from hypothesis import given
from hypothesis import strategies as st
import pytest

from process_supervisor import LineWriter, Notice, Painter, Severity, severity_of, wants_colour
from process_supervisor.runner import LineSplitter, LONGEST_LINE


class Terminal(io.StringIO):
    """Says that it is one."""

    def isatty(self) -> bool:
        """Return True."""
        return True


@pytest.mark.parametrize(
    ('stream', 'environment', 'colour'),
    [
        (Terminal(), {'TERM': 'xterm-256color'}, True),
        (Terminal(), {'TERM': 'xterm', 'NO_COLOR': '1'}, False),
        (Terminal(), {'TERM': 'dumb'}, False),
        (Terminal(), {}, False),
        (io.StringIO(), {'TERM': 'xterm'}, False),
    ],
    ids=['terminal', 'NO_COLOR', 'dumb', 'no TERM', 'pipe'],
)
def test_colours_are_for_terminals_that_want_them(
    stream: io.StringIO, environment: dict[str, str], colour: bool
) -> None:
    """A pipe, a dumb terminal and NO_COLOR get plain text."""
    assert wants_colour(stream, environment) is colour


def test_plain_lines_have_aligned_names_and_no_escape_codes() -> None:
    """All prefixes are as wide as the widest."""
    painter = Painter('bringup', ['master', 'joint_states'], colour=False)
    assert painter.line('master', 'hello') == 'master       | hello'
    assert painter.line('joint_states', 'hello') == 'joint_states | hello'
    assert painter.notice(Notice(Severity.ERROR, 'no')) == 'bringup      | error: no'


def test_warnings_and_errors_have_their_own_colours() -> None:
    """As the severity at the start of a line of a ROS log says."""
    painter = Painter('bringup', ['master'], colour=True)
    lines = [
        painter.line('master', f'[{word}] [master]: text') for word in ('INFO', 'WARN', 'ERROR')
    ]
    assert '\x1b[33m' not in lines[0]
    assert '\x1b[33m[WARN]' in lines[1]
    assert '\x1b[31m[ERROR]' in lines[2]
    assert all(line.count('\x1b[0m') == line.count('\x1b[3') for line in lines)


@pytest.mark.parametrize(
    ('line', 'severity'),
    [
        ('[DEBUG] [master]: text', Severity.INFO),
        ('[INFO] [master]: [ERROR]', Severity.INFO),
        ('[FATAL] [master]: text', Severity.ERROR),
        ('Traceback (most recent call last):', Severity.WARNING),
    ],
)
def test_what_is_no_log_line_is_a_warning(line: str, severity: Severity) -> None:
    """So a traceback is seen where only warnings are shown."""
    assert severity_of(line) is severity


def test_a_closed_output_is_no_error() -> None:
    """The reader has gone, but the drives still have to be stopped."""
    stream = io.StringIO()
    write = LineWriter(stream)
    write('seen')
    stream.close()
    write('unseen')


texts = st.lists(st.text(st.characters(blacklist_characters='\r\n'), max_size=20), max_size=10)


@given(texts, st.lists(st.integers(1, 7)), st.booleans())
def test_lines_come_out_whole_however_the_bytes_come_in(
    lines: list[str], cuts: list[int], ended: bool
) -> None:
    """Cut anywhere, also inside a character, the lines are the same; the last may have no end."""
    data = '\n'.join(lines).encode(errors='surrogatepass') + (b'\n' if ended else b'')
    splitter = LineSplitter()
    found: list[str] = []
    for size in cuts:
        found += splitter.feed(data[:size])
        data = data[size:]
    found += splitter.feed(data) + splitter.flush()
    expected = [line.encode(errors='surrogatepass').decode(errors='replace') for line in lines]
    if not ended and expected and not expected[-1]:
        expected.pop()  # an empty last line without an end is no line
    if ended and not lines:
        expected = ['']
    assert found == expected


def test_a_line_without_an_end_is_cut() -> None:
    """Memory stays bounded, and no byte is lost; a carriage return before the end is dropped."""
    assert LineSplitter().feed(b'a\r\nb\r\n') == ['a', 'b']
    splitter = LineSplitter()
    found = [line for _ in range(10) for line in splitter.feed(b'x' * 5000)]
    assert all(len(line) == LONGEST_LINE for line in found)
    assert sum(map(len, found + splitter.flush())) == 50_000

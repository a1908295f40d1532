# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from operator_input import status_text, StatusLine, Style
from operator_input.terminal import fitted


class Paper:
    """Remembers what was written."""

    def __init__(self, columns: int) -> None:
        """Set the width."""
        self.text = ''
        self.columns = columns

    def write(self, text: str) -> None:
        """Write."""
        self.text += text

    def width(self) -> int:
        """Return the width."""
        return self.columns


def test_same_line_is_written_once() -> None:
    """An unchanged line costs nothing, which matters over SSH."""
    paper = Paper(40)
    line = StatusLine(paper)
    line.show('0.15 m/s')
    written = paper.text
    line.show('0.15 m/s')
    assert paper.text == written
    line.show('0.20 m/s')
    assert paper.text != written


def test_message_stays_above_the_line() -> None:
    """A message erases the line, ends with a new line, and the line comes again."""
    paper = Paper(40)
    line = StatusLine(paper)
    line.show('status')
    line.message('message')
    assert paper.text.endswith('\r\x1b[Kmessage\nstatus')


def test_line_never_wraps() -> None:
    """In a narrow tmux pane the line is cut, colours are switched off again."""
    paper = Paper(8)
    StatusLine(paper).show('\x1b[1mspeed 0.15 m/s\x1b[0m')
    assert paper.text == '\r\x1b[K\x1b[1mspeed 0\x1b[0m'


@given(st.text(st.characters(codec='ascii', categories=['L', 'N', 'P', 'Zs'])), st.integers(0, 80))
def test_cut_text_is_a_beginning(text: str, width: int) -> None:
    """What fits is kept whole; else as many columns as there are: a wide character has two."""
    assert fitted(text, width) == text[:width]
    assert fitted('狗ab', 3) == '狗a'
    assert fitted('狗狗', 3) == '狗'


def test_colours_change_no_words() -> None:
    """Of the parts of a line."""
    parts = [('idle', Style.DIM), ('0.15 m/s', Style.PLAIN)]
    assert status_text(parts, colour=False) == 'idle | 0.15 m/s'
    assert status_text(parts, colour=True) == '\x1b[2midle\x1b[0m | 0.15 m/s'

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bytes to lines."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from process_supervisor.runner import LineSplitter, LONGEST_LINE

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
    """Memory stays bounded, and no byte is lost."""
    splitter = LineSplitter()
    found = [line for _ in range(10) for line in splitter.feed(b'x' * 5000)]
    assert all(len(line) == LONGEST_LINE for line in found)
    assert sum(map(len, found + splitter.flush())) == 50_000


def test_windows_line_ends_are_line_ends() -> None:
    """A carriage return before the end is dropped."""
    assert LineSplitter().feed(b'a\r\nb\r\n') == ['a', 'b']

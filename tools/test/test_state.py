# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import pytest

from workspace.layout import fingerprint, fingerprint_files, read_state

PARTS = st.lists(st.text(max_size=5), max_size=4)


@given(PARTS, PARTS)
def test_fingerprints_agree_only_for_equal_parts(one: list[str], two: list[str]) -> None:
    """Moving a border between two parts makes another fingerprint."""
    assert (fingerprint(*one) == fingerprint(*two)) == (one == two)


def test_fingerprint_of_files_sees_contents_and_absence(tmp_path: Path) -> None:
    """Absent, empty and filled are three different things."""
    path = tmp_path / 'file'
    seen = [fingerprint_files([path])]
    for text in ('', 'x'):
        path.write_text(text)
        seen.append(fingerprint_files([path]))
    assert len(set(seen)) == 3


@pytest.mark.parametrize('text', ['', '{', '[]', '{"base": "x"}', '{"other": 1}', 'null'])
def test_damaged_state_counts_as_none(tmp_path: Path, text: str) -> None:
    """A file of another version or half a file leads to a new environment, not to a traceback."""
    (tmp_path / 'state').write_text(text)
    assert read_state(tmp_path / 'state') is None

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The checklist in the README names tests that exist, and leaves no row out."""

from __future__ import annotations

from pathlib import Path
import re

import pytest

PACKAGE = Path(__file__).parents[1]
ROW = re.compile(r'^\| (\d+) \| (.+?) \| (yes|partly|no) \| (.+?) \|$', re.MULTILINE)
POINTER = re.compile(r'`((?:tests/)?test_\w+\.py)::(test_\w+)`')
ROWS = ROW.findall((PACKAGE / 'README.md').read_text())
ROW_COUNT = 46


def test_every_row_is_there() -> None:
    """Numbered from 1, in their order."""
    assert [int(number) for number, *_ in ROWS] == list(range(1, ROW_COUNT + 1))


@pytest.mark.parametrize(('number', 'answer', 'text'), [(n, a, t) for n, _, a, t in ROWS])
def test_a_row_points_at_tests_that_exist(number: str, answer: str, text: str) -> None:
    """Each yes has one at least."""
    pointers = POINTER.findall(text)
    assert pointers or answer != 'yes', f'row {number} says yes without a test'
    for file, name in pointers:
        folder = PACKAGE.parent if file.startswith('tests/') else PACKAGE / 'test'
        source = (folder / file).read_text()
        assert f'def {name}(' in source, f'row {number}: there is no {name} in {file}'

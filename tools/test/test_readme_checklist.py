# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tests that the protocol checklist of arm_canopen/README.md names are there."""

from __future__ import annotations

from pathlib import Path
import re

ROOT = Path(__file__).parents[2]
PACKAGES = ('arm_canopen', 'canopen_sim', 'canopen_tools', 'tests')
REFERENCE = re.compile(r'`(?:tests/)?(?P<file>test_\w+\.py)::(?P<test>\w+)`')


def test_every_test_of_the_checklist_exists() -> None:
    """A test that was renamed or removed proves nothing any more."""
    text = (ROOT / 'arm_canopen' / 'README.md').read_text('utf-8')
    named = [(found['file'], found['test']) for found in REFERENCE.finditer(text)]
    assert len(named) > 40
    missing = [
        f'{file}::{test}'
        for file, test in named
        if not any(
            f'def {test}(' in path.read_text('utf-8')
            for package in PACKAGES
            for path in (ROOT / package).rglob(file)
        )
    ]
    assert missing == []

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What tables of READMEs name is there: the tests of the protocol checklist, the findings."""

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


def test_every_finding_is_in_the_index_and_says_what_was_expected_and_seen() -> None:
    """And in the order of the names; what a row names of ours exists."""
    scripts = sorted((ROOT / 'findings').glob('*.sh'))
    text = (ROOT / 'findings' / 'README.md').read_text('utf-8')
    assert re.findall(r'^\| \[(\w+)\]\(\1\.sh\)', text, re.MULTILINE) == [
        script.stem for script in scripts
    ]
    for script in scripts:
        head, _, _ = script.read_text('utf-8').partition('\nset -eu\n')
        assert re.search(
            r'\n# \S.*\d+\.\d+.*: .*\n(# .*\n)*# Expected: .*\n(# .*\n)*# Seen: ', head
        )
        assert script.stat().st_mode & 0o111
    for path in re.findall(r'`([\w/]+/\w+\.py)`', text):
        assert (ROOT / path).is_file()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Suggestions: near names first, far ones never."""

from __future__ import annotations

import pytest

from ros2_frontend.cli.errors import hint


@pytest.mark.parametrize(
    ('name', 'known', 'expected'),
    [
        ('/chater', ['/chatter', '/rosout', '/tf'], "\nDid you mean '/chatter'?"),
        ('fake_slave', ['fake_slaves', 'master', 'candump'], "\nDid you mean 'fake_slaves'?"),
        ('ab', ['abc', 'abd'], "\nDid you mean 'abd' or 'abc'?"),
        ('zzz', ['/chatter', '/rosout'], ''),
        ('anything', [], ''),
    ],
)
def test_slips_that_people_make(name: str, known: list[str], expected: str) -> None:
    """The intended name is found, and nothing far-fetched beside it."""
    assert hint(name, known) == expected

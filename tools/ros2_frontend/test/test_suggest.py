# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Suggestions: near names first, far ones never."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from ros2_frontend.cli.suggest import hint, likeness, nearest

pytestmark = pytest.mark.slow

NAMES = st.lists(st.from_regex(r'/[a-z_]{1,8}(/[a-z_]{1,8})?', fullmatch=True), max_size=6)


@given(NAMES, st.text(max_size=8))
def test_only_known_names_come_once_and_few(known: list[str], name: str) -> None:
    """For any name, the answers are a few of the known names."""
    found = nearest(name, known)
    assert len(found) <= 3
    assert len(set(found)) == len(found)
    assert set(found) <= set(known)


@given(st.from_regex(r'/[a-z_]{1,8}', fullmatch=True), NAMES)
def test_the_name_itself_is_nearest(name: str, known: list[str]) -> None:
    """A name that exists is the best answer to itself, in any case of letters."""
    assert likeness(name.upper(), name) == 1.0
    assert nearest(name, [*known, name])[0].strip('/') == name.strip('/')


@pytest.mark.parametrize(
    ('name', 'known', 'expected'),
    [
        ('/chater', ['/chatter', '/rosout', '/tf'], ['/chatter']),
        ('chatter', ['/chatter'], ['/chatter']),
        ('init', ['/panda_joint1/init', '/rosout'], ['/panda_joint1/init']),
        (
            '/joint_state',
            ['/arm/joint_states', '/joint_states', '/tf'],
            ['/joint_states', '/arm/joint_states'],
        ),
        ('fake_slave', ['fake_slaves', 'master', 'candump'], ['fake_slaves']),
        ('/fake_slaves/fault', ['/fake_slaves/panda_joint1/sto', '/fake_slaves/sto'], []),
        ('zzz', ['/chatter', '/rosout'], []),
        ('anything', [], []),
    ],
)
def test_slips_that_people_make(name: str, known: list[str], expected: list[str]) -> None:
    """The intended name is found, and nothing far-fetched beside it."""
    assert nearest(name, known) == expected


def test_hint_is_a_sentence() -> None:
    """One, two or no names."""
    assert hint('ab', ['abc']) == "\nDid you mean 'abc'?"
    assert hint('ab', ['abc', 'abd']) == "\nDid you mean 'abc' or 'abd'?"
    assert hint('ab', ['xyz']) == ''

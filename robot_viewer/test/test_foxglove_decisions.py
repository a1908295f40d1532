# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who may connect to the bridge to Foxglove."""

from __future__ import annotations

import pytest

from robot_viewer.nodes.foxglove_bridge import Admission, FOXGLOVE_ORIGINS

ANYWHERE = frozenset({'*'})
FOXGLOVE = frozenset(FOXGLOVE_ORIGINS)


@pytest.mark.parametrize(
    ('origin', 'admitted'),
    [
        ('https://app.foxglove.dev', True),
        ('file://', True),
        ('http://localhost:8080', True),
        ('http://[::1]:8080', True),
        ('https://app.foxglove.dev.evil.example', False),
        ('http://localhost.evil.example', False),
        ('https://evil.example', False),
        ('null', False),
        ('', False),
    ],
)
def test_sites_on_loopback(origin: str, admitted: bool) -> None:
    """A page cannot change its Origin; a program sends none."""
    admission = Admission(FOXGLOVE, '')
    assert not admission.refusal('/', [])
    assert bool(admission.refusal('/', [origin])) != admitted
    assert not Admission(ANYWHERE, '').refusal('/', [origin])


def test_from_elsewhere_the_token_counts() -> None:
    """Whatever the site is."""
    admission = Admission(FOXGLOVE, 'secret')
    assert not admission.refusal('/?token=secret', [])
    for path in ('/', '/?token=', '/?token=secretx', '/secret', '/?token=s\u00e9cret'):
        assert 'token' in admission.refusal(path, [])
    assert 'allowed_origins' in admission.refusal('/?token=secret', ['https://evil.example'])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions to a target, what joints did, and what a drive reports."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest

from robot_viewer.page.jog_panel import (
    GREATEST_ACCELERATION,
    History,
    KEPT,
    motion_time,
    SHORTEST,
    STEP,
)
from robot_viewer.page.style import drive_html


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.1, 3.0), st.floats(0.05, 1.0))
def test_a_motion_keeps_within_its_share(
    start: float, target: float, greatest: float, share: float
) -> None:
    """The quintic from rest to rest that a controller makes of one point, by its samples."""
    duration = motion_time({'a': start}, {'a': target}, {'a': greatest}, share)
    assert duration >= SHORTEST
    s = np.linspace(0.0, 1.0, 501)
    way = abs(target - start)
    velocity = way * (30 * s**2 - 60 * s**3 + 30 * s**4) / duration
    acceleration = way * (60 * s - 180 * s**2 + 120 * s**3) / duration**2
    assert velocity.max() <= share * greatest + 1e-9
    assert acceleration.max() <= share * GREATEST_ACCELERATION + 1e-9


def test_the_slowest_joint_says_how_long() -> None:
    """And one whose place is not known says nothing."""
    velocities = {'a': 1.0, 'b': 0.5}
    alone = motion_time({'b': 0.0}, {'b': 2.0}, velocities, 1.0)
    both = motion_time({'a': 0.0, 'b': 0.0}, {'a': 2.0, 'b': 2.0}, velocities, 1.0)
    assert both == alone > motion_time({'a': 0.0}, {'a': 2.0}, velocities, 1.0)
    assert motion_time({}, {'a': 9.0}, velocities, 1.0) == SHORTEST


def test_the_past_is_kept_for_half_a_minute() -> None:
    """With samples that are not nearer than needed, and of joints that have both."""
    history = History()
    for number in range(5000):
        now = 0.02 * number
        history.add({'a': now, 'b': 0.0}, {'a': now - 0.1, 'c': 0.0}, now)
    assert history.joints == ('a',)
    samples = history.of('a')
    times = [sample.time for sample in samples]
    assert times[-1] - times[0] == pytest.approx(KEPT, abs=2 * STEP)
    assert min(np.diff(times)) >= STEP - 1e-9
    assert samples[-1].target - samples[-1].position == pytest.approx(0.1)
    assert history.of('b') == ()


def test_a_drive_is_shown_with_what_it_reports() -> None:
    """What is empty has no row; what a device names itself is text and no markup."""
    values = {'state': 'Fault', 'emergency': '', 'emergencies': '<b>0x2310</b>', 'mode': 'CSP'}
    html = drive_html('over current', values, {'bus_load': '27.1'})
    for words in ('over current', '<td>Fault</td>', '<td>CSP</td>', '<td>27.1</td>'):
        assert words in html
    assert '&lt;b&gt;0x2310' in html
    assert '<td>EMCY</td>' not in html.replace(' style="vertical-align:top;padding-right:1em"', '')

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Refusals of the servo: in the status while they are fresh, in the log once."""

from __future__ import annotations

from arm_servo.ros.refusals import Refusals, REPEAT_PERIOD, STATUS_PERIOD


def test_a_stream_with_old_stamps_is_one_line_of_the_log() -> None:
    """What differs from message to message is a number; another reason is another line."""
    refusals = Refusals()
    lines = []
    for number in range(100):
        now = 0.03 * number
        refusals.note(f'stale: {0.1 + now:.2f} s old when it was read', now)
        assert refusals.fresh(now).startswith('stale')
        lines.append(refusals.to_log(now))
    assert [line for line in lines if line] == ['stale: 0.10 s old when it was read']
    refusals.note('there is no joint elbow', 3.0)
    assert refusals.to_log(3.0) == 'there is no joint elbow'


def test_the_same_mistake_made_later_is_logged_again() -> None:
    """A person who tries again after a while sees it again."""
    refusals = Refusals()
    refusals.note('paused', 1.0)
    assert refusals.to_log(1.0) == 'paused'
    later = 1.1 + REPEAT_PERIOD
    refusals.note('paused', later)
    assert refusals.to_log(later) == 'paused'


def test_the_status_forgets_a_refusal() -> None:
    """A while after it, or when a command is taken."""
    refusals = Refusals()
    refusals.note('paused', 1.0)
    assert refusals.fresh(1.1 + STATUS_PERIOD) == ''
    assert refusals.to_log(1.1 + STATUS_PERIOD) == ''
    refusals.note('paused', 3.0)
    refusals.clear(3.0)
    assert refusals.fresh(3.0) == ''

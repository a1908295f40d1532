# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a pause and its end say, and what the state of the controller has meanwhile."""

from __future__ import annotations

from dataclasses import replace

import pytest
from servo_drives import Drives

from arm_servo import PauseRequest, Source, SpeedRequest
from arm_servo.core.snapshot import Snapshot
from arm_servo.ros.trajectory.controller import words_of_pause, words_of_resume

IDLE = Snapshot(1.0, None, None, '')


@pytest.mark.parametrize(
    ('snapshot', 'pause', 'resume'),
    [
        (IDLE, 'nothing is under way', 'was not paused'),
        (replace(IDLE, paused=True), 'already', 'nothing is under way'),
        (replace(IDLE, source=Source.JOG), 'the jog ends', 'was not paused'),
        (replace(IDLE, source=Source.TARGET, paused=True), 'already', 'the single target goes on'),
        (replace(IDLE, paused=True, speed=0.0), 'already', 'the speed override is 0'),
    ],
)
def test_a_pause_says_what_it_does(snapshot: Snapshot, pause: str, resume: str) -> None:
    """Also when nothing is under way, and when there is no pause to end."""
    assert pause in words_of_pause(snapshot)
    assert resume in words_of_resume(snapshot)


def test_a_pause_counts_as_speed_0() -> None:
    """And the speed override is there again behind it."""
    drives = Drives()
    drives.attach()
    drives.run(2)
    drives.gateway.command(SpeedRequest(0.5))
    drives.gateway.command(PauseRequest())
    drives.run()
    assert drives.gateway.snapshot.speed_scaling == 0.0
    drives.gateway.command(PauseRequest(is_paused=False))
    drives.run()
    assert drives.gateway.snapshot.speed_scaling == 0.5

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The servo's status: a code for tools, and words for people."""

from __future__ import annotations

import pytest
from servo_drives import Drives

from arm_canopen import Refusal, RefusalCause
from arm_servo.nodes.servo_status import code_of, status_of, StatusCode
from arm_servo.otg import MotionState
from arm_servo.report import Cause, Limiter, MotionReport
from arm_servo.set_point import SetPoint, Source
from arm_servo.snapshot import Snapshot


def snapshot(report: MotionReport, source: Source = Source.JOG) -> Snapshot:
    """Return a snapshot of an arm that follows."""
    point = SetPoint(MotionState.at_rest([0.0]), source, report)
    return Snapshot(1.0, point, None, '', source)


@pytest.mark.parametrize(
    ('cause', 'factor', 'code'),
    [
        (Cause.COLLISION, 0.5, StatusCode.DECELERATE_FOR_COLLISION),
        (Cause.COLLISION, 0.0, StatusCode.HALT_FOR_COLLISION),
        (Cause.SINGULARITY, 0.3, StatusCode.DECELERATE_FOR_APPROACHING_SINGULARITY),
        (Cause.SINGULARITY, 0.0, StatusCode.HALT_FOR_SINGULARITY),
        (Cause.JOINT_POSITION, 0.4, StatusCode.JOINT_BOUND),
        (Cause.JOINT_VELOCITY, 0.4, StatusCode.NO_WARNING),
    ],
)
def test_each_cause_has_the_code_of_moveit_servo(
    cause: Cause, factor: float, code: StatusCode
) -> None:
    """And the message names what limits, with the factor."""
    report = MotionReport(factor, (Limiter(cause, 'elbow', 0.018, factor),))
    assert code_of(report) is code
    told, words = status_of(snapshot(report), '', '', '')
    assert told == code
    assert 'elbow' in words
    assert f'{factor:.2f}x' in words


def test_a_refusal_comes_before_everything_else() -> None:
    """A person whose command was refused sees why, whatever else goes on."""
    code, words = status_of(snapshot(MotionReport()), 'stale', 'paused', 'cut')
    assert (code, words) == (StatusCode.INVALID, 'stale')


def test_a_cycle_that_stands_still_is_told() -> None:
    """What the last cycle said is not repeated for ever."""
    code, words = status_of(snapshot(MotionReport()), '', '', '', 3.0)
    assert code == StatusCode.INVALID
    assert 'does not run (the last was 3.0 s ago)' in words


def test_a_blocked_arm_says_so() -> None:
    """Without drives the status is invalid, and names the remedy."""
    drives = Drives()
    drives.attach()
    drives.source.released('panda_joint1', Refusal(RefusalCause.SINGLE_TARGET))
    drives.run()
    code, words = status_of(drives.gateway.snapshot, '', '', '')
    assert code == StatusCode.INVALID
    assert 'panda_joint1' in words


@pytest.mark.parametrize(
    ('source', 'words'),
    [(Source.NONE, 'ready'), (Source.TRAJECTORY, 'trajectory'), (Source.TARGET, 'target')],
)
def test_it_tells_what_moves_the_arm(source: Source, words: str) -> None:
    """Also while nobody jogs."""
    code, text = status_of(snapshot(MotionReport(), source), '', '', '')
    assert code == StatusCode.NO_WARNING
    assert words in text


def test_what_was_cut_off_is_told() -> None:
    """A command beyond its range is carried out in part, and says so."""
    assert 'cut to 1' in status_of(snapshot(MotionReport()), '', '', 'cut to 1')[1]

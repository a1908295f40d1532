# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A drive that is lost is warned of; a robot that starts slowly, or ends, is not."""

from __future__ import annotations

from arm_canopen.joints import SilenceWatch, START_TIMEOUT

PERIOD = 2.0  # [s] between two looks
JOINTS = ['base', 'elbow']


def all_there() -> SilenceWatch:
    """Return the watch of a robot that has started."""
    watch = SilenceWatch(JOINTS, 0.0)
    for joint in JOINTS:
        watch.note(joint)
    return watch


def test_a_slow_start_is_no_loss() -> None:
    """Neither before the master is there, nor while its drives boot."""
    watch = SilenceWatch(JOINTS, 0.0)
    assert watch.look(JOINTS, [], 2.0) == []
    assert watch.look(JOINTS, JOINTS, 15.0) == []
    assert watch.look(['elbow'], JOINTS, START_TIMEOUT) == []
    watch.note('elbow')
    assert watch.look([], [], START_TIMEOUT + PERIOD) == []


def test_a_joint_that_never_comes_is_missing() -> None:
    """Such as one that bus.yml calls otherwise."""
    watch = SilenceWatch(JOINTS, 0.0)
    watch.note('base')
    watch.look(['elbow'], [], PERIOD)
    assert watch.look(['elbow'], [], START_TIMEOUT + PERIOD) == ['elbow']


def test_a_drive_that_is_lost_is_missing_until_it_is_back() -> None:
    """Its publisher is there, and silent in two looks."""
    watch = all_there()
    watch.look([], [], PERIOD)
    assert watch.look(['elbow'], ['elbow'], 2 * PERIOD) == []
    assert watch.look(['elbow'], ['elbow'], 3 * PERIOD) == ['elbow']
    assert watch.look(['elbow'], ['elbow'], 4 * PERIOD) == ['elbow']
    assert watch.look([], [], 5 * PERIOD) == []
    assert watch.look(['elbow'], ['elbow'], 6 * PERIOD) == []
    assert watch.look(['elbow'], ['elbow'], 7 * PERIOD) == ['elbow']


def test_a_master_that_ends_takes_its_publishers_along() -> None:
    """Its states end a moment before; another one may start later, as slowly as the first."""
    watch = all_there()
    watch.look([], [], PERIOD)
    assert watch.look(JOINTS, JOINTS, 2 * PERIOD) == []
    assert watch.look(JOINTS, [], 3 * PERIOD) == []
    assert watch.look(JOINTS, JOINTS, 3 * PERIOD + START_TIMEOUT) == []
    assert watch.look(JOINTS, JOINTS, 4 * PERIOD + START_TIMEOUT) == JOINTS

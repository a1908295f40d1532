# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Displacements are checked beside the cycle, in their order, and dropped by what comes after."""

from __future__ import annotations

from collections.abc import Callable
import time

import numpy as np
import pytest
from servo_drives import Drives, PERIOD

from arm_servo.exceptions import CommandError, NotReadyError
from arm_servo.nodes.aimer import Aimer, MOST
from arm_servo.set_point import Source

JOINT = 'panda_joint1'


def ready() -> tuple[Drives, Aimer]:
    """Return drives that follow, and what moves them on."""
    drives = Drives()
    drives.attach()
    drives.run(2)
    return drives, Aimer(drives.desk)


def run_until(drives: Drives, done: Callable[[], bool]) -> None:
    """Run cycles at their pace."""
    deadline = time.monotonic() + 20.0
    while not done():
        drives.run()
        time.sleep(PERIOD / 10)
        assert time.monotonic() < deadline


def test_displacements_add_up_and_are_reached() -> None:
    """Ten at once, of which each waits for the one before."""
    drives, aimer = ready()
    begin = drives.path[-1]
    orders = [aimer.nudge({JOINT: 0.02}) for _ in range(10)]
    run_until(drives, lambda: all(order.done() for order in orders))
    run_until(drives, lambda: drives.desk.snapshot.source is Source.NONE)
    assert [order.exception() for order in orders] == [None] * 10
    assert drives.path[-1][0] - begin[0] == pytest.approx(0.2, abs=1e-6)
    assert np.array(drives.path)[-1, 1:] == pytest.approx(begin[1:], abs=1e-6)


def test_a_displacement_into_contact_is_refused_and_nothing_moves() -> None:
    """The wrist of Panda, turned and folded until its hand would be in the forearm."""
    drives, aimer = ready()
    before = drives.path[-1]
    order = aimer.nudge({'panda_joint6': -1.4})
    run_until(drives, order.done)
    drives.run(20)
    with pytest.raises(CommandError, match='panda_link5 and panda_hand would collide'):
        order.result(0.0)
    assert drives.path[-1].tolist() == before.tolist()


def test_what_waits_is_dropped() -> None:
    """Behind a stop nothing begins to move."""
    drives, aimer = ready()
    before = drives.path[-1]
    orders = [aimer.nudge({JOINT: 0.1}) for _ in range(4)]
    aimer.cancel()
    drives.desk.submit(lambda core, _now: core.stop(), moves=False)
    run_until(drives, lambda: all(order.done() for order in orders))
    drives.run(20)
    assert drives.desk.snapshot.source is Source.NONE
    assert drives.path[-1].tolist() == before.tolist()


def test_a_flood_is_refused() -> None:
    """What cannot be carried out in time is not kept for later."""
    drives, aimer = ready()
    orders = [aimer.nudge({JOINT: 0.0001}) for _ in range(MOST + 10)]
    with pytest.raises(NotReadyError, match='more slowly'):
        orders[-1].result(0.0)
    run_until(drives, lambda: all(order.done() for order in orders))

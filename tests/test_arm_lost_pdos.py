# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A joint that loses its PDOs under a trajectory, with the real master, core and drives."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from drive_samples import PERIOD
import numpy as np
import pytest
from servo_commands import InlineWorker, outcome
from virtual_arm import VirtualArm

from arm_canopen import DriveState, OperationMode
from arm_trajectory import GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

LOST = 'panda_joint3'
TPDOS, RPDOS = (0x180, 0x280), (0x200, 0x300, 0x400)
TIME_OUT = 0.5  # [s] of silence of a drive, or of a position that stays behind
STOP_TIME = 0.7  # [s] of the core for a stop on the path
SWING = 0.35  # [rad] of the trajectory, with the fourth joint the other way
TIME = 3.0  # [s] of the trajectory


class Arm(VirtualArm):
    """The Panda, led by the motion core along a line."""

    def __init__(self, mode: OperationMode) -> None:
        super().__init__(mode, InlineWorker())
        self._way = np.full(len(self.joints), SWING)
        self._way[3] = -SWING
        goal = TrajectoryGoal(self.joints, [GoalPoint(TIME, (self.begin + self._way).tolist())])
        self.command = self.gateway.request(goal)
        self.net.run(TIME / 3)

    def lose(self, bases: Sequence[int], *names: str) -> None:
        """Lose PDOs of joints."""
        lost = {base + 2 + self.joints.index(name) for base in bases for name in names}
        self.net.wire.loses = lambda sender, frame: frame.can_id in lost

    def progress(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return how far each motor has come on the line, from 0 to 1."""
        shares: np.ndarray[tuple[int], np.dtype[np.float64]] = self.moved / self._way
        return shares


@pytest.mark.parametrize(
    ('mode', 'every'),
    [(OperationMode.CYCLIC_POSITION, False), (OperationMode.INTERPOLATED_POSITION, True)],
    ids=['one', 'all'],
)
def test_a_silent_joint_stops_the_arm_on_its_path(mode: OperationMode, every: bool) -> None:
    """All seven stop in step within the time-out and the stop; the result names the drive."""
    arm = Arm(mode)
    before = arm.progress()
    assert before.min() > 0.1
    names = arm.joints if every else [LOST]
    arm.lose(TPDOS, *names)
    arm.net.run(TIME_OUT + STOP_TIME)
    rest = arm.progress()
    assert np.ptp(rest) < 5e-3
    arm.net.run(3.0)
    assert arm.progress() == pytest.approx(rest, abs=2e-3)
    assert rest.max() < 0.9
    ending = outcome(arm.command)
    for name in names:
        assert name in ending.reason
    assert 'TPDO' in ending.reason
    arm.net.wire.loses = lambda sender, frame: False
    arm.net.run(2.0)
    assert arm.progress() == pytest.approx(rest, abs=2e-3)
    for name in arm.joints:
        assert arm.net.drives[name].view.state is DriveState.OPERATION_ENABLED


def test_a_joint_without_set_points_stops_the_arm() -> None:
    """It stands at once; the others stop on the path, and nothing jumps when it receives again."""
    arm = Arm(OperationMode.CYCLIC_POSITION)
    arm.lose(RPDOS, LOST)
    arm.net.run(TIME_OUT + STOP_TIME)
    rest = arm.progress()
    arm.net.run(1.0)
    assert arm.progress() == pytest.approx(rest, abs=2e-3)
    assert LOST in outcome(arm.command).reason
    others = [number for number, name in enumerate(arm.joints) if name != LOST]
    assert np.ptp(rest[others]) < 5e-3
    arm.net.wire.loses = lambda sender, frame: False
    tracks = [arm.progress()]
    for _ in range(100):
        arm.net.run(PERIOD)
        tracks.append(arm.progress())
    steps = [np.abs(after - before).max() for before, after in pairwise(tracks)]
    assert max(steps) < 2e-3

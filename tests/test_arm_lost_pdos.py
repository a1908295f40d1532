# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A joint that loses its PDOs under a trajectory, with the real master, core and drives.

Master, motion core and simulated drives meet in virtual time, without processes.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from itertools import pairwise

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, PERIOD, SCALE, sdo_write
from model_robots import ready, robot
import numpy as np
import pytest
from servo_commands import InlineWorker, outcome

from arm_canopen import DriveState, MotionSource, OperationMode
from arm_servo import MotionCore
from arm_servo.core.gateway import CommandGateway
from arm_servo.io.drive_source import DriveSource
from arm_trajectory import GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

LOST = 'panda_joint3'
TPDOS, RPDOS = (0x180, 0x280), (0x200, 0x300, 0x400)
TIME_OUT = 0.5  # [s] of silence of a drive, or of a position that stays behind
STOP_TIME = 0.7  # [s] of the core for a stop on the path
SWING = 0.35  # [rad] of the trajectory, with the fourth joint the other way
TIME = 3.0  # [s] of the trajectory


class Arm:
    """The Panda in a virtual network, led by the motion core along a line."""

    def __init__(self, mode: OperationMode) -> None:
        core = MotionCore(robot('panda'))
        joints = core.model.joints
        self.begin = np.array(ready('panda'))
        nodes = [
            drive_config(
                name,
                2 + number,
                sdo_writes=(*MOTION_WRITES, sdo_write(0x607F, 0, int(3.0 * SCALE))),
                scales={'offset_pos_from_dev': at, 'offset_pos_to_dev': -at * SCALE},
            )
            for number, (name, at) in enumerate(zip(joints, self.begin.tolist(), strict=True))
        ]
        self.net = VirtualNetwork(bus_config(*nodes))
        self.joints = joints
        self.gateway = CommandGateway(core, InlineWorker(), lambda: self.net.now)
        self.source = DriveSource(self.gateway)
        self.net.boot()
        for name in joints:
            self.net.do(name, 'init')
            self.net.select(name, mode)
        self.source.attach(self._attach)
        self.net.run(0.1)
        self.to = self.begin + SWING
        self.to[3] -= 2 * SWING
        goal = TrajectoryGoal(joints, [GoalPoint(TIME, self.to.tolist())])
        self.command = self.gateway.request(goal)
        self.net.run(TIME / 3)

    def _attach(self, source: MotionSource) -> Future[None]:
        self.net.master.attach(source)
        future = Future[None]()
        future.set_result(None)
        return future

    def lose(self, bases: Sequence[int], *names: str) -> None:
        """Lose PDOs of joints."""
        lost = {base + 2 + self.joints.index(name) for base in bases for name in names}
        self.net.wire.loses = lambda sender, frame: frame.can_id in lost

    def progress(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Return how far each motor has come on the line, from 0 to 1."""
        drives = [self.net.devices[name].drive for name in self.joints]
        moved = np.array([drive.position / SCALE for drive in drives if drive is not None])
        return moved / (self.to - self.begin)


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

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A halt counts against what was requested before it, also where the arm had no drives yet.

Master, motion core and simulated drives meet in virtual time; the test decides when the worker
that checks a motion takes its next step.
"""

from __future__ import annotations

from concurrent.futures import Future

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, PERIOD, SCALE, sdo_write
from model_robots import ready, robot
import numpy as np
import pytest
from servo_commands import SteppedWorker

from arm_canopen import MotionSource, OperationMode
from arm_servo import DisplacementRequest, MotionCore
from arm_servo.core.gateway import CommandGateway
from arm_servo.core.motion_queue import MotionCommand
from arm_servo.io.drive_source import DriveSource
from arm_trajectory import GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

FIRST, OTHER = 'panda_joint1', 'panda_joint5'
SWING = 0.1  # [rad]
KINDS = ('trajectory', 'displacement')
STEPS = [
    [],
    ['work'],
    ['work', 'work'],
    ['work', 'cycle'],
    ['work', 'cycle', 'work'],
    ['work', 'cycle', 'work', 'work'],
]
"""Of the worker and the cycle, between the request and the halt; then the motion would begin."""


class Arm:
    """The Panda in a virtual network, whose first joint was halted: it has to be attached again.

    Attributes:
        net: The network.
        gateway: Commands to the arm.
    """

    def __init__(self) -> None:
        """Boot, enable, attach, halt."""
        core = MotionCore(robot('panda'))
        self._joints, self._worker = core.model.joints, SteppedWorker()
        places = zip(self._joints, ready('panda').tolist(), strict=True)
        nodes = [
            drive_config(
                name,
                2 + number,
                sdo_writes=(*MOTION_WRITES, sdo_write(0x607F, 0, int(3.0 * SCALE))),
                scales={'offset_pos_from_dev': at, 'offset_pos_to_dev': -at * SCALE},
            )
            for number, (name, at) in enumerate(places)
        ]
        self.net = VirtualNetwork(bus_config(*nodes))
        self.gateway = CommandGateway(core, self._worker, lambda: self.net.now)
        self._source = DriveSource(self.gateway)
        self.net.boot()
        for name in self._joints:
            self.net.do(name, 'init')
            self.net.select(name, OperationMode.CYCLIC_POSITION)
        self._get_ready()
        self.net.run(0.1)
        assert not self.gateway.snapshot.blocked
        self.halt(FIRST)
        self.net.run(0.1)
        assert FIRST in self.gateway.snapshot.blocked

    @property
    def where(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Where the motors are in [rad], from where they began."""
        drives = [self.net.devices[name].drive for name in self._joints]
        return np.array([drive.position / SCALE for drive in drives if drive is not None])

    def halt(self, joint: str) -> None:
        """Call ``~/halt`` of a drive."""
        self.net.do(joint, 'halt', preempt=True)

    def request(self, kind: str) -> MotionCommand:
        """Request a motion, as the servers of actions and topics do."""
        if kind == 'displacement':
            return self.gateway.request(DisplacementRequest({FIRST: SWING}), self._get_ready)
        there = ready('panda') + SWING * np.eye(len(self._joints))[0]
        goal = TrajectoryGoal(self._joints, [GoalPoint(1.0, there.tolist())])
        return self.gateway.request(goal, self._get_ready)

    def take(self, steps: list[str]) -> None:
        """Step the worker and the cycle."""
        for step in steps:
            if step == 'work':
                self._worker.run()
            else:
                self.net.run(PERIOD)

    def settle(self) -> None:
        """Run until everything under way has ended."""
        self.take(['work', 'cycle'] * 200)

    def _get_ready(self) -> None:
        if self._source.detached:
            self._source.attach(self._attach)

    def _attach(self, source: MotionSource) -> Future[None]:
        self.net.master.attach(source)
        future = Future[None]()
        future.set_result(None)
        return future


@pytest.mark.parametrize('kind', KINDS)
def test_a_motion_takes_the_drives_back(kind: str) -> None:
    """Without a second halt the arm moves."""
    arm = Arm()
    begin = arm.where
    arm.request(kind)
    arm.settle()
    assert np.abs(arm.where - begin).max() == pytest.approx(SWING, abs=0.01)


@pytest.mark.parametrize(('kind', 'joint'), [('trajectory', FIRST), ('displacement', OTHER)])
@pytest.mark.parametrize('steps', STEPS, ids=' '.join)
def test_a_halt_overtakes_a_motion_that_has_no_drives_yet(
    steps: list[str], kind: str, joint: str
) -> None:
    """The operator who halts again has the answer that it is halted, and it stays so."""
    arm = Arm()
    command = arm.request(kind)
    arm.take(steps)
    arm.halt(joint)
    begin = arm.where
    arm.settle()
    assert np.abs(arm.where - begin).max() < 1e-3
    assert command.future.done()
    reason = str(command.future.exception())
    assert f'stopped before it had begun: {joint}' in reason
    arm.request(kind)
    arm.settle()
    assert np.abs(arm.where - begin).max() == pytest.approx(SWING, abs=0.01)

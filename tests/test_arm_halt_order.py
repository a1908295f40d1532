# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A halt counts against what was requested before it, also where the arm had no drives yet.

The test decides when the worker that checks a motion takes its next step.
"""

from __future__ import annotations

from drive_samples import PERIOD
import numpy as np
import pytest
from servo_commands import SteppedWorker
from virtual_arm import VirtualArm

from arm_canopen import OperationMode
from arm_servo import DisplacementRequest
from arm_servo.core.motion_queue import MotionCommand
from arm_trajectory import GoalPoint, TrajectoryGoal

pytestmark = pytest.mark.slow

FIRST, OTHER = 'panda_joint1', 'panda_joint5'
SWING = 0.1  # [rad]
KINDS = ('trajectory', 'displacement')
CASES = [
    ('trajectory', ''),
    ('displacement', ''),
    ('displacement', 'work'),
    ('trajectory', 'work work'),
    ('displacement', 'work cycle'),
    ('trajectory', 'work cycle work'),
    ('displacement', 'work cycle work'),
    ('trajectory', 'work cycle work work'),
]
"""Kind of the motion, and steps of worker and cycle between its request and the halt; after
the last ones the motion would begin."""


class Arm(VirtualArm):
    """The Panda, whose first joint was halted: it has to be attached again."""

    def __init__(self) -> None:
        """Attach, halt."""
        self._worker = SteppedWorker()
        super().__init__(OperationMode.CYCLIC_POSITION, self._worker)
        assert not self.gateway.snapshot.blocked
        self.halt(FIRST)
        self.net.run(0.1)
        assert FIRST in self.gateway.snapshot.blocked

    def halt(self, joint: str) -> None:
        """Call ``~/halt`` of a drive."""
        self.net.do(joint, 'halt', preempt=True)

    def request(self, kind: str) -> MotionCommand:
        """Request a motion, as the servers of actions and topics do."""
        if kind == 'displacement':
            return self.gateway.request(DisplacementRequest({FIRST: SWING}), self.attach)
        there = self.begin + SWING * np.eye(len(self.joints))[0]
        goal = TrajectoryGoal(self.joints, [GoalPoint(1.0, there.tolist())])
        return self.gateway.request(goal, self.attach)

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


@pytest.mark.parametrize('kind', KINDS)
def test_a_motion_takes_the_drives_back(kind: str) -> None:
    """Without a second halt the arm moves."""
    arm = Arm()
    begin = arm.moved
    arm.request(kind)
    arm.settle()
    assert np.abs(arm.moved - begin).max() == pytest.approx(SWING, abs=0.01)


@pytest.mark.parametrize(('kind', 'steps'), CASES)
def test_a_halt_overtakes_a_motion_that_has_no_drives_yet(kind: str, steps: str) -> None:
    """The operator who halts again has the answer that it is halted, and it stays so."""
    arm, joint = Arm(), FIRST if kind == 'trajectory' else OTHER
    command = arm.request(kind)
    arm.take(steps.split())
    arm.halt(joint)
    begin = arm.moved
    arm.settle()
    assert np.abs(arm.moved - begin).max() < 1e-3
    assert command.future.done()
    reason = str(command.future.exception())
    assert f'stopped before it had begun: {joint}' in reason
    arm.request(kind)
    arm.settle()
    assert np.abs(arm.moved - begin).max() == pytest.approx(SWING, abs=0.01)

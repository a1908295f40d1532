# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The Panda in virtual time: the real master, motion core and simulated drives, no processes.

Joints that lose their PDOs under a trajectory, and halts that count against what was requested
before. A test decides when the worker that checks a motion takes its next step.
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
from servo_commands import InlineWorker, outcome, SteppedWorker

from arm_canopen import DriveState, MotionSource, OperationMode
from arm_servo import DisplacementRequest, MotionCore
from arm_servo.core.gateway import CommandGateway, MotionCommand
from arm_servo.drive_source import DriveSource
from arm_trajectory import GoalPoint, TrajectoryGoal


class VirtualArm:
    """The arm, enabled and attached to its motion core."""

    def __init__(self, mode: OperationMode, worker: InlineWorker | SteppedWorker) -> None:
        """Boot, enable, attach; ``worker`` checks motions."""
        core = MotionCore(robot('panda'))
        self.joints = core.model.joints  # names of its joints
        self.begin = np.array(ready('panda'))  # where they begin in [rad]
        nodes = [
            drive_config(
                name,
                2 + number,
                sdo_writes=(*MOTION_WRITES, sdo_write(0x607F, 0, int(3.0 * SCALE))),
                scales={'offset_pos_from_dev': at, 'offset_pos_to_dev': -at * SCALE},
            )
            for number, (name, at) in enumerate(zip(self.joints, self.begin.tolist(), strict=True))
        ]
        self.net = VirtualNetwork(bus_config(*nodes))  # the network
        self.gateway = CommandGateway(core, worker, lambda: self.net.now)  # commands to the arm
        DriveSource(self.gateway, self._attach)
        self.net.boot()
        for name in self.joints:
            self.net.do(name, 'init')
            self.net.select(name, mode)
        self.gateway.get_ready()
        self.net.run(0.1)

    @property
    def moved(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """How far the motors are from where they began in [rad]."""
        drives = [self.net.devices[name].drive for name in self.joints]
        return np.array([drive.position / SCALE for drive in drives if drive is not None])

    def _attach(self, source: MotionSource) -> Future[None]:
        self.net.master.attach(source)
        future = Future[None]()
        future.set_result(None)
        return future


pytestmark = pytest.mark.slow

LOST = 'panda_joint3'
TPDOS, RPDOS = (0x180, 0x280), (0x200, 0x300, 0x400)
TIME_OUT = 0.5  # [s] of silence of a drive, or of a position that stays behind
STOP_TIME = 0.7  # [s] of the core for a stop on the path
WAY = 0.35  # [rad] of the trajectory, with the fourth joint the other way
TIME = 3.0  # [s] of the trajectory


class LedArm(VirtualArm):
    """The Panda, led by the motion core along a line."""

    def __init__(self, mode: OperationMode) -> None:
        super().__init__(mode, InlineWorker())
        self._way = np.full(len(self.joints), WAY)
        self._way[3] = -WAY
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
    arm = LedArm(mode)
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
    arm = LedArm(OperationMode.CYCLIC_POSITION)
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


FIRST, OTHER = 'panda_joint1', 'panda_joint5'
SWING = 0.1  # [rad]
CASES = [
    ('trajectory', ''),
    ('displacement', 'work'),
    ('trajectory', 'work work'),
    ('displacement', 'work cycle work'),
]
"""Kind of the motion, and steps of worker and cycle between its request and the halt."""


class HaltedArm(VirtualArm):
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
            return self.gateway.request(DisplacementRequest({FIRST: SWING}))
        there = self.begin + SWING * np.eye(len(self.joints))[0]
        goal = TrajectoryGoal(self.joints, [GoalPoint(1.0, there.tolist())])
        return self.gateway.request(goal)

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


@pytest.mark.parametrize(('kind', 'steps'), CASES)
def test_a_halt_overtakes_a_motion_that_has_no_drives_yet(kind: str, steps: str) -> None:
    """The operator who halts again has the answer that it is halted, and it stays so."""
    arm, joint = HaltedArm(), FIRST if kind == 'trajectory' else OTHER
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

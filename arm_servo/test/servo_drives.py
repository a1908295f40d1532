# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Ideal drives under a drive source, cycle by cycle, without a bus."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor, Future
from dataclasses import replace

from model_robots import ready, robot
import numpy as np
from servo_commands import InlineWorker

from arm_canopen import AxisFeedback, DriveState, MotionSource, Setpoint
from arm_model import Array, RobotModel
from arm_servo import CoreSettings, MotionCore
from arm_servo.core.gateway import CommandGateway
from arm_servo.io.drive_source import DriveSource

PERIOD = 0.01


class Drives:
    """Drives that go to their set-points at once.

    Attributes:
        gateway: Commands to the core that moves them.
        source: The source under test.
        axes: State of each drive; to be changed by tests.
        path: Positions commanded so far, a row for each cycle.
    """

    def __init__(
        self,
        name: str = 'panda',
        worker: Executor | None = None,
        model: RobotModel | None = None,
        begin: Sequence[float] | None = None,
        settings: CoreSettings | None = None,
    ) -> None:
        self.now = 100.0
        core = MotionCore(model or robot(name), settings)
        self.gateway = CommandGateway(core, worker or InlineWorker(), lambda: self.now)
        self.source = DriveSource(self.gateway)
        self.axes = [
            AxisFeedback(joint, True, DriveState.OPERATION_ENABLED, 8, at, 0.0, at, True)
            for joint, at in zip(
                self.gateway.model.joints, begin or ready(name).tolist(), strict=True
            )
        ]
        self.path: list[Array] = []
        self.attachments: list[MotionSource] = []

    def place(self, positions: Sequence[float]) -> None:
        """Move the drives to another place."""
        self.axes = [
            replace(axis, position=at, setpoint=at)
            for axis, at in zip(self.axes, positions, strict=True)
        ]

    def attach(self) -> None:
        """Give the source its drives."""
        self.source.attach(self._attached)

    def _attached(self, source: MotionSource) -> Future[None]:
        self.attachments.append(source)
        future = Future[None]()
        future.set_result(None)
        return future

    def run(self, cycles: int = 1) -> Sequence[Setpoint | None]:
        """Run some cycles; return the set-points of the last."""
        answer: Sequence[Setpoint | None] = []
        for _ in range(cycles):
            self.now += PERIOD
            answer = self.source.update(self.now, PERIOD, self.axes)
            for number, point in enumerate(answer):
                if point is not None:
                    self.axes[number] = replace(
                        self.axes[number],
                        position=point.position,
                        setpoint=point.position,
                        velocity=point.velocity,
                    )
            self.path.append(np.array([axis.setpoint for axis in self.axes]))
        return answer

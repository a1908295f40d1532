# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The Panda in virtual time: the real master, motion core and simulated drives, no processes."""

from __future__ import annotations

from concurrent.futures import Future

from bus_rig import VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, SCALE, sdo_write
from model_robots import ready, robot
import numpy as np
from servo_commands import InlineWorker, SteppedWorker

from arm_canopen import MotionSource, OperationMode
from arm_servo import MotionCore
from arm_servo.core.gateway import CommandGateway
from arm_servo.io.drive_source import DriveSource


class VirtualArm:
    """The arm, enabled and attached to its motion core.

    Attributes:
        net: The network.
        joints: Names of its joints.
        begin: Where they begin in [rad].
        gateway: Commands to the arm.
    """

    def __init__(self, mode: OperationMode, worker: InlineWorker | SteppedWorker) -> None:
        """Boot, enable, attach; ``worker`` checks motions."""
        core = MotionCore(robot('panda'))
        self.joints = core.model.joints
        self.begin = np.array(ready('panda'))
        nodes = [
            drive_config(
                name,
                2 + number,
                sdo_writes=(*MOTION_WRITES, sdo_write(0x607F, 0, int(3.0 * SCALE))),
                scales={'offset_pos_from_dev': at, 'offset_pos_to_dev': -at * SCALE},
            )
            for number, (name, at) in enumerate(zip(self.joints, self.begin.tolist(), strict=True))
        ]
        self.net = VirtualNetwork(bus_config(*nodes))
        self.gateway = CommandGateway(core, worker, lambda: self.net.now)
        self._source = DriveSource(self.gateway)
        self.net.boot()
        for name in self.joints:
            self.net.do(name, 'init')
            self.net.select(name, mode)
        self.attach()
        self.net.run(0.1)

    @property
    def moved(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """How far the motors are from where they began in [rad]."""
        drives = [self.net.devices[name].drive for name in self.joints]
        return np.array([drive.position / SCALE for drive in drives if drive is not None])

    def attach(self) -> None:
        """Attach the core where it is not."""
        if self._source.detached:
            self._source.attach(self._attach)

    def _attach(self, source: MotionSource) -> Future[None]:
        self.net.master.attach(source)
        future = Future[None]()
        future.set_result(None)
        return future

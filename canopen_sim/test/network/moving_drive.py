# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A drive of a simulated network in motion, watched for losing its power before it stands."""

from __future__ import annotations

from dataclasses import replace
import struct

from bus_rig import JOINT, VirtualNetwork
from drive_samples import bus_config, drive_config, MOTION_WRITES, PERIOD, SCALE, sdo_write
import pytest

from arm_canopen import DriveState, OperationMode, Severity
from arm_canopen.config import RecoveryPolicy
from canopen_sim import Drive as SimulatedDrive

NODE_ID = 2
RAMP = 1.0  # [s] of a quick stop from full speed to rest
STANDING = 0.03  # [rad/s]


class MovingDrive:
    """A drive at 1 rad/s with a slow quick stop ramp.

    Attributes:
        net: The network.
        states: States of the simulated drive since it began to move, without repetitions.
        fastest: Greatest speed at which it was without power since then in [rad/s].
        began: Steady time at which that began in [s].
    """

    def __init__(
        self,
        option: int = 2,
        *writes: tuple[int, int, int],
        kept_alive: bool = False,
        mode: OperationMode = OperationMode.CYCLIC_POSITION,
        recovery: RecoveryPolicy = RecoveryPolicy.MANUAL,
    ) -> None:
        """Set it in motion.

        Args:
            option: Quick stop option code (0x605A).
            writes: Index, sub-index and value of objects that differ.
            kept_alive: It passes from one master to the next.
            mode: Mode of operation.
            recovery: What becomes of it when its device comes back.
        """
        slow = [(0x6085, 0, round(SCALE / RAMP)), (0x605A, 0, option), *writes]
        changed = [sdo_write(*write) for write in slow]
        config = drive_config(JOINT, NODE_ID, sdo_writes=(*MOTION_WRITES, *changed))
        config = replace(config, axes=(replace(config.axes[0], recovery=recovery),))
        if kept_alive:
            config = replace(config, reset_communication=False)
        self.net = VirtualNetwork(bus_config(config))
        self.net.allows_defects = True
        self.net.boot()
        self.net.enable(mode)
        velocity = mode is OperationMode.PROFILE_VELOCITY
        self.net.target(1.0 if velocity else 50.0)
        self.net.run(0.6)
        assert self.device.velocity / SCALE == pytest.approx(1.0, rel=0.05)
        self.states = [DriveState.OPERATION_ENABLED]
        self.fastest = 0.0
        self.began = self.net.now

    @property
    def device(self) -> SimulatedDrive:
        """The simulated drive."""
        return self.net.simulated()

    def run(self, duration: float) -> None:
        """Advance the time by a duration in [s], and observe the drive in each cycle."""
        for _ in range(round(duration / PERIOD)):
            self.net.run(PERIOD)
            if self.device.state is not self.states[-1]:
                self.states.append(self.device.state)
            if self.device.state not in {DriveState.OPERATION_ENABLED, *STOPPING}:
                self.fastest = max(self.fastest, abs(self.device.velocity) / SCALE)

    @property
    def errors(self) -> list[str]:
        """What was reported as an error."""
        return self.net.reported(Severity.ERROR)

    @property
    def controlwords_by_sdo(self) -> list[int]:
        """Controlwords that were written by SDO since it moved."""
        found: list[int] = []
        for data in self.net.frames(0x600 + NODE_ID, since=self.began):
            if data[:4] == b'\x2b\x40\x60\x00':
                found += struct.unpack_from('<H', data, 4)
        return found


STOPPING = (DriveState.QUICK_STOP_ACTIVE, DriveState.FAULT_REACTION_ACTIVE)

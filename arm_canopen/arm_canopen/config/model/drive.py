# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The typed model of one axis of a drive: its units and sequences."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from ...standard.drive import DriveState


class RecoveryPolicy(Enum):
    """What becomes of a drive that was enabled when its device was lost and booted again."""

    MANUAL = 'manual'
    """It stays disabled until somebody calls ~/recover or ~/enable."""
    AUTO = 'auto'
    """It is enabled again in the mode that it had, holding where it is; it moves nowhere."""


@dataclass(frozen=True, slots=True)
class DriveConfig:
    """Units and sequences of one axis of a CiA 402 drive."""

    # name of the axis: that of the device, of its channel for one with several axes
    name: str = ''
    # number of the axis from 0; its objects lie 0x800 * channel above those of the first (CiA
    # 402-2, 7.2)
    channel: int = 0
    # positions are in rad and velocities in rad/s by the drive's factor group (0x608F, 0x6091,
    # 0x6092, 0x6096, 0x60A8, 0x60A9); the scales are read from the drive
    scale_from_factor_group: bool = False
    scale_pos_to_dev: float = 1000.0  # device increments per user unit (usually rad)
    scale_vel_to_dev: float = 1000.0  # device velocity units per user unit per second
    scale_pos_from_dev: float = 0.001  # user units per device increment
    scale_vel_from_dev: float = 0.001  # user units per second per device velocity unit
    # device acceleration units per user unit per second squared; None where bus.yml does not say
    # it: then by the drive (0x60A9 with 0x60AA, or 0x6097), else its velocity units per second
    scale_acc_to_dev: float | None = None
    # user units per second squared per device acceleration unit; likewise
    scale_acc_from_dev: float | None = None
    scale_eff_to_dev: float = 1.0  # device units of torque per user unit of effort
    scale_eff_from_dev: float = 1.0  # user units of effort per device unit of torque
    offset_pos_to_dev: float = 0.0  # added to a target after scaling, in [inc]
    offset_pos_from_dev: float = 0.0  # added to a position after scaling, in user units
    switching_state: DriveState = DriveState.OPERATION_ENABLED  # state in which 0x6060 is written
    homing_timeout: float = 10.0  # longest time for homing in [s]
    # mode number for position commands, None when bus.yml names none
    position_mode: int | None = None
    # mode number for velocity commands, None when bus.yml names none
    velocity_mode: int | None = None
    effort_mode: int | None = None  # mode number for effort commands, None when bus.yml names none
    # how long a stream of targets on ~/target may pause before it counts as ended in [s]
    target_timeout: float = 0.2
    # what becomes of the axis when its device comes back
    recovery: RecoveryPolicy = RecoveryPolicy.MANUAL
    quirks: str = ''  # name of the drive's entry in the table of quirks, empty for none

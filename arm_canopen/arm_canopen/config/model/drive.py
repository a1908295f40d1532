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
    """Units and sequences of one axis of a CiA 402 drive.

    Attributes:
        name: Name of the axis: that of the device, of its channel for one with several axes.
        channel: Number of the axis from 0; its objects lie 0x800 * channel above those of the
            first (CiA 402-2, 7.2).
        scale_from_factor_group: Positions are in rad and velocities in rad/s by the drive's factor
            group (0x608F, 0x6091, 0x6092, 0x6096, 0x60A8, 0x60A9); the scales are read from the
            drive.
        scale_pos_to_dev: Device increments per user unit (usually rad).
        scale_vel_to_dev: Device velocity units per user unit per second.
        scale_pos_from_dev: User units per device increment.
        scale_vel_from_dev: User units per second per device velocity unit.
        scale_acc_to_dev: Device acceleration units per user unit per second squared; None where
            bus.yml does not say it: then by the drive (0x60A9 with 0x60AA, or 0x6097), else its
            velocity units per second.
        scale_acc_from_dev: User units per second squared per device acceleration unit; likewise.
        scale_eff_to_dev: Device units of torque per user unit of effort.
        scale_eff_from_dev: User units of effort per device unit of torque.
        offset_pos_to_dev: Added to a target after scaling, in [inc].
        offset_pos_from_dev: Added to a position after scaling, in user units.
        switching_state: State in which 0x6060 is written.
        homing_timeout: Longest time for homing in [s].
        position_mode: Mode number for position commands, None when bus.yml names none.
        velocity_mode: Mode number for velocity commands, None when bus.yml names none.
        effort_mode: Mode number for effort commands, None when bus.yml names none.
        target_timeout: How long a stream of targets on ~/target may pause before it counts as
            ended in [s].
        recovery: What becomes of the axis when its device comes back.
        quirks: Name of the drive's entry in the table of quirks, empty for none.
    """

    name: str = ''
    channel: int = 0
    scale_from_factor_group: bool = False
    scale_pos_to_dev: float = 1000.0
    scale_vel_to_dev: float = 1000.0
    scale_pos_from_dev: float = 0.001
    scale_vel_from_dev: float = 0.001
    scale_acc_to_dev: float | None = None
    scale_acc_from_dev: float | None = None
    scale_eff_to_dev: float = 1.0
    scale_eff_from_dev: float = 1.0
    offset_pos_to_dev: float = 0.0
    offset_pos_from_dev: float = 0.0
    switching_state: DriveState = DriveState.OPERATION_ENABLED
    homing_timeout: float = 10.0
    position_mode: int | None = None
    velocity_mode: int | None = None
    effort_mode: int | None = None
    target_timeout: float = 0.2
    recovery: RecoveryPolicy = RecoveryPolicy.MANUAL
    quirks: str = ''

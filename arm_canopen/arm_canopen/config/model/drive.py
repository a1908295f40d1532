# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The typed model of one axis of a drive: its units and sequences."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from canopen_core.standard import DriveState, OperationMode

from ..keys import key, Kind
from ..units import MILLISECONDS

SWITCHING_STATES = {state.value: state.title for state in DriveState if 2 <= state <= 5}
FAULT_STATE = {DriveState.FAULT.value: 'Fault, taken as 5'}
"""What the multichannel sample of ros2_canopen writes, and means Operation enabled."""
POSITION_MODES = {
    mode.value: mode.title
    for mode in (
        OperationMode.PROFILE_POSITION,
        OperationMode.INTERPOLATED_POSITION,
        OperationMode.CYCLIC_POSITION,
    )
}
VELOCITY_MODES = {
    mode.value: mode.title
    for mode in (
        OperationMode.VELOCITY,
        OperationMode.PROFILE_VELOCITY,
        OperationMode.CYCLIC_VELOCITY,
    )
}
EFFORT_MODES = {
    mode.value: mode.title for mode in (OperationMode.PROFILE_TORQUE, OperationMode.CYCLIC_TORQUE)
}


class RecoveryPolicy(Enum):
    """What becomes of a drive that was enabled when its device was lost and booted again."""

    MANUAL = 'manual'
    """It stays disabled until somebody calls ~/recover or ~/enable."""
    AUTO = 'auto'
    """It is enabled again in the mode that it had, holding where it is; it moves nowhere."""


@dataclass(frozen=True, slots=True)
class DriveConfig:
    """Units and sequences of one axis of a CiA 402 drive; each key of bus.yml fills its field."""

    # name of the axis: that of the device, of its channel for one with several axes
    name: str = ''
    # number of the axis from 0; its objects lie 0x800 * channel above those of the first (CiA
    # 402-2, 7.2)
    channel: int = 0
    scale_pos_to_dev: float = key(1000.0, 'increments per user unit', zero=False)
    scale_vel_to_dev: float = key(1000.0, 'device velocity per user velocity', zero=False)
    scale_pos_from_dev: float = key(0.001, 'user units per increment', zero=False)
    scale_vel_from_dev: float = key(0.001, 'user velocity per device velocity', zero=False)
    scale_acc_to_dev: float | None = key(
        None,
        'device acceleration per user acceleration; without: by the drive (0x60A9 with '
        '0x60AA, or 0x6097), else its velocity units per second (our own key)',
        zero=False,
    )
    scale_acc_from_dev: float | None = key(
        None,
        'user acceleration per device acceleration; without: the inverse of the other '
        '(our own key)',
        zero=False,
    )
    scale_from_factor_group: bool = key(
        False,
        'positions in rad by the factor group of the drive (0x608F, 0x6091, 0x6092, '
        '0x6096, 0x60A8, 0x60A9), in the place of the scales (our own key)',
    )
    scale_eff_to_dev: float = key(1.0, 'device torque per user effort (our own key)', zero=False)
    scale_eff_from_dev: float = key(
        1.0, 'user effort per device torque; without: the inverse of the other', zero=False
    )
    offset_pos_to_dev: float = key(0.0, 'added to a target in increments')
    offset_pos_from_dev: float = key(
        0.0, 'added to a position in user units; `offset_pos_to_dev` takes it back'
    )
    switching_state: DriveState = key(  # noqa: RUF009
        DriveState.OPERATION_ENABLED,
        'state in which the mode is switched: 2 to 5 of CiA 402',
        kind=Kind.INTEGER,
        choices=SWITCHING_STATES | FAULT_STATE,
    )
    homing_timeout: float = key(
        10.0, 'longest time for homing [s]', (0.1, 3600), name='homing_timeout_seconds'
    )
    position_mode: int | None = key(
        None,
        'mode for positions: 1, 7 or 8; its objects are checked, services select it',
        choices=POSITION_MODES,
    )
    velocity_mode: int | None = key(
        None, 'as position_mode, for velocities: 2, 3 or 9', choices=VELOCITY_MODES
    )
    effort_mode: int | None = key(
        None, 'as position_mode, for efforts: 4 or 10', choices=EFFORT_MODES
    )
    target_timeout: float = key(
        0.2,
        'pause that ends a stream on `~/target` (our own key)',
        (10, 60_000),
        unit=MILLISECONDS,
        name='target_timeout_ms',
    )
    recovery: RecoveryPolicy = key(  # noqa: RUF009
        RecoveryPolicy.MANUAL, '`manual` or `auto`: after a loss (our own key)', kind=Kind.TEXT
    )
    quirks: str = key('', 'where the drive deviates from CiA 402 (our own key)')

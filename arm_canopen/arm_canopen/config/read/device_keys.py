# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The keys of a device that ros2_canopen and Lely's dcfgen know.

Names, units and defaults are theirs, so that their files can be read unchanged. Where a default
differs, ``why`` says the reason. Our own are ``scale_acc_to_dev``, ``scale_acc_from_dev``,
``scale_eff_to_dev``, ``scale_from_factor_group``, ``target_timeout_ms``, ``recovery``, ``quirks``,
and ``timeout_ms`` of an entry of ``sdo``; of the master ``time_period_ms``.
"""

from __future__ import annotations

from ...standard.drive import DriveState, OperationMode
from ..units import HUNDRED_MICROSECONDS, MILLISECONDS
from .schema import Key, Kind, Use
from .shared_keys import (
    DRIVER,
    MULTIPLIER,
    NAMESPACE,
    NODE_ID,
    PACKAGE,
    REMAPPINGS,
    RETRY_FACTOR,
    U8_MAX,
    U16_MAX,
    U32_MAX,
)

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

DEVICE_KEYS: tuple[Key, ...] = (
    NODE_ID,
    DRIVER,
    PACKAGE,
    NAMESPACE,
    REMAPPINGS,
    Key('dcf', Kind.TEXT, 'dcf'),
    Key('dcf_path', Kind.TEXT, 'dcf_path'),
    Key('polling', Kind.BOOLEAN, use=Use.IGNORED),
    Key('period', Kind.NUMBER, 'poll_period', per_unit=MILLISECONDS, low=1, high=60_000),
    Key('non_transmit_timeout', Kind.NUMBER, use=Use.IGNORED),
    Key(
        'sdo_timeout_ms',
        Kind.NUMBER,
        'sdo_timeout',
        per_unit=MILLISECONDS,
        low=1,
        high=60_000,
    ),
    Key(
        'boot_timeout_ms', Kind.NUMBER, 'boot_timeout', per_unit=MILLISECONDS, low=1, high=600_000
    ),
    Key('diagnostics', Kind.BLOCK, use=Use.IGNORED),
    Key('enable_lazy_load', Kind.BOOLEAN, use=Use.IGNORED),
    Key('num_channels', Kind.INTEGER, 'num_channels', low=1, high=8, why='CiA 402 has 8 axes'),
    Key('channel_names', Kind.BLOCK),
    Key('channels', Kind.BLOCK),
    Key('channel', Kind.INTEGER, use=Use.IGNORED),
    Key('revision_number', Kind.INTEGER, 'revision_number', low=0, high=U32_MAX),
    Key('serial_number', Kind.INTEGER, 'serial_number', low=0, high=U32_MAX),
    Key(
        'heartbeat_producer',
        Kind.NUMBER,
        'heartbeat_producer',
        per_unit=MILLISECONDS,
        low=0,
        high=U16_MAX,
    ),
    Key('heartbeat_consumer', Kind.BOOLEAN, 'heartbeat_consumer'),
    MULTIPLIER,
    Key('guard_time', Kind.INTEGER, 'guard_time', per_unit=MILLISECONDS, low=0, high=U16_MAX),
    Key('life_time_factor', Kind.INTEGER, 'life_time_factor', low=0, high=U8_MAX),
    RETRY_FACTOR,
    Key('time_cob_id', Kind.BLOCK),
    Key('error_behavior', Kind.BLOCK),
    Key('boot', Kind.BOOLEAN, 'boot'),
    Key('mandatory', Kind.BOOLEAN, 'mandatory'),
    Key('reset_communication', Kind.BOOLEAN, 'reset_communication'),
    Key('restore_configuration', Kind.INTEGER, 'restore_configuration', low=0, high=127),
    Key(
        'software_file',
        Kind.TEXT,
        neutral='',
        use=Use.REFUSED,
        why='programs are not downloaded in this version; use the tool of the vendor',
    ),
    Key(
        'software_version',
        Kind.INTEGER,
        neutral=0,
        use=Use.REFUSED,
        why='the program version is not checked in this version',
    ),
    Key(
        'configuration_file',
        Kind.TEXT,
        neutral='',
        use=Use.REFUSED,
        why='there are no .bin files; write the objects to the sdo list',
    ),
    Key('sdo', Kind.BLOCK),
    Key('tpdo', Kind.BLOCK),
    Key('rpdo', Kind.BLOCK),
)

DRIVE_KEYS: tuple[Key, ...] = (
    Key('scale_pos_to_dev', Kind.NUMBER, 'scale_pos_to_dev', zero=False),
    Key('scale_vel_to_dev', Kind.NUMBER, 'scale_vel_to_dev', zero=False),
    Key('scale_pos_from_dev', Kind.NUMBER, 'scale_pos_from_dev', zero=False),
    Key('scale_vel_from_dev', Kind.NUMBER, 'scale_vel_from_dev', zero=False),
    Key('scale_acc_to_dev', Kind.NUMBER, 'scale_acc_to_dev', zero=False),
    Key('scale_acc_from_dev', Kind.NUMBER, 'scale_acc_from_dev', zero=False),
    Key('scale_from_factor_group', Kind.BOOLEAN, 'scale_from_factor_group'),
    Key('scale_eff_to_dev', Kind.NUMBER, 'scale_eff_to_dev', zero=False),
    Key('scale_eff_from_dev', Kind.NUMBER, 'scale_eff_from_dev', zero=False),
    Key('offset_pos_to_dev', Kind.NUMBER, 'offset_pos_to_dev'),
    Key('offset_pos_from_dev', Kind.NUMBER, 'offset_pos_from_dev'),
    Key(
        'switching_state', Kind.INTEGER, 'switching_state', choices=SWITCHING_STATES | FAULT_STATE
    ),
    Key('homing_timeout_seconds', Kind.NUMBER, 'homing_timeout', low=0.1, high=3600),
    Key('position_mode', Kind.INTEGER, 'position_mode', choices=POSITION_MODES),
    Key('velocity_mode', Kind.INTEGER, 'velocity_mode', choices=VELOCITY_MODES),
    Key('effort_mode', Kind.INTEGER, 'effort_mode', choices=EFFORT_MODES),
    Key(
        'target_timeout_ms',
        Kind.NUMBER,
        'target_timeout',
        per_unit=MILLISECONDS,
        low=10,
        high=60_000,
    ),
    Key('recovery', Kind.TEXT, 'recovery'),
    Key('quirks', Kind.TEXT, 'quirks'),
)

SCALE_KEYS = ('scale_pos_to_dev', 'scale_pos_from_dev', 'scale_vel_to_dev', 'scale_vel_from_dev')
"""What ``scale_from_factor_group`` takes the place of."""

CHANNEL_KEYS: tuple[Key, ...] = tuple(
    key for key in DRIVE_KEYS if key.name.startswith(('scale_', 'offset_'))
)
"""What an entry of ``channels`` may say of one axis."""

SDO_KEYS: tuple[Key, ...] = (
    Key('index', Kind.INTEGER, 'index', low=1, high=U16_MAX, why='an object index has 16 bits'),
    Key('sub_index', Kind.INTEGER, 'subindex', low=0, high=U8_MAX, default=0),
    Key('value', Kind.BLOCK),
    Key('timeout_ms', Kind.NUMBER, 'timeout', per_unit=MILLISECONDS, low=1, high=600_000),
)

MAPPING_KEYS: tuple[Key, ...] = SDO_KEYS[:2]

PDO_KEYS: tuple[Key, ...] = (
    Key('enabled', Kind.BOOLEAN, 'enabled', default=True),
    Key('cob_id', Kind.BLOCK),
    Key('transmission', Kind.INTEGER, 'transmission', low=0, high=U8_MAX),
    Key('mapping', Kind.BLOCK),
)

TPDO_KEYS: tuple[Key, ...] = (
    *PDO_KEYS,
    Key('sync_start', Kind.INTEGER, 'sync_start', low=0, high=240),
    Key(
        'inhibit_time',
        Kind.INTEGER,
        'inhibit_time',
        per_unit=HUNDRED_MICROSECONDS,
        low=0,
        high=U16_MAX,
        why='the unit is 100 microseconds',
    ),
    Key('event_timer', Kind.INTEGER, 'event_time', per_unit=MILLISECONDS, low=0, high=U16_MAX),
)

RPDO_KEYS: tuple[Key, ...] = (
    *PDO_KEYS,
    Key('event_deadline', Kind.INTEGER, 'event_time', per_unit=MILLISECONDS, low=0, high=U16_MAX),
)

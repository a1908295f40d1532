# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""All keys of bus.yml that ros2_canopen and Lely's dcfgen know, and what is made of each.

Names, units and defaults are theirs, so that their files can be read unchanged. Where a default
differs, ``why`` says the reason.
"""

from __future__ import annotations

from ..standard.cob_id import NODE_ID_MAX, NODE_ID_MIN
from ..standard.drive import DriveState, OperationMode
from .schema import Key, Kind, Use

MILLISECONDS = 1e3  # per second
MICROSECONDS = 1e6
HUNDRED_MICROSECONDS = 1e4
KILOBIT = 1e-3  # kbit/s per bit/s

U8_MAX = 0xFF
U16_MAX = 0xFFFF
U32_MAX = 0xFFFF_FFFF

BITRATES = dict.fromkeys((10, 20, 50, 100, 125, 250, 500, 800, 1000), 'kbit/s')
"""Bit rates of CiA 301, table 1."""

SWITCHING_STATES = {state.value: state.title for state in DriveState if 2 <= state <= 5}
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

NODE_ID_WHY = 'CANopen node ids are 1 to 127'
MULTIPLIER_WHY = 'below 1 every heartbeat would count as lost'


def _identity(name: str, use: Use, field: str = '', why: str = '') -> Key:
    return Key(
        name,
        Kind.INTEGER,
        field,
        low=0,
        high=U32_MAX,
        default=None if field else 0,
        use=use,
        why=why,
    )


_MULTIPLIER = Key(
    'heartbeat_multiplier',
    Kind.NUMBER,
    'heartbeat_multiplier',
    low=1,
    high=1000,
    why=MULTIPLIER_WHY,
)
_RETRY_FACTOR = Key(
    'retry_factor', Kind.INTEGER, default=3, use=Use.LATER, why='there is no node guarding'
)
_TIME_COB_ID = Key(
    'time_cob_id', Kind.INTEGER, default=0x100, use=Use.LATER, why='no TIME is sent or read'
)
_NAMESPACE = Key('namespace', Kind.TEXT, 'namespace')
_REMAPPINGS = Key('remappings', Kind.BLOCK)
_PACKAGE = Key('package', Kind.TEXT, use=Use.NEEDLESS)

OPTION_KEYS: tuple[Key, ...] = (
    Key('dcf_path', Kind.TEXT, 'dcf_path'),
    _MULTIPLIER,
    _RETRY_FACTOR,
)

MASTER_KEYS: tuple[Key, ...] = (
    Key('node_id', Kind.INTEGER, 'node_id', low=NODE_ID_MIN, high=NODE_ID_MAX, why=NODE_ID_WHY),
    Key('driver', Kind.TEXT, 'driver'),
    _PACKAGE,
    _NAMESPACE,
    _REMAPPINGS,
    Key('baudrate', Kind.INTEGER, 'bitrate', per_unit=KILOBIT, choices=BITRATES),
    _identity('vendor_id', Use.LATER, why='the master has no object dictionary of its own'),
    _identity('product_code', Use.LATER, why='the master has no object dictionary of its own'),
    _identity('revision_number', Use.LATER, why='the master has no object dictionary of its own'),
    _identity('serial_number', Use.LATER, why='the master has no object dictionary of its own'),
    Key('heartbeat_consumer', Kind.BOOLEAN, 'watch_devices', default=True),
    Key(
        'heartbeat_producer',
        Kind.NUMBER,
        'heartbeat_producer',
        per_unit=MILLISECONDS,
        low=0,
        high=U16_MAX,
        default=200,
        why='not 0, as only this lets drives stop when the master dies; write 0 to have none',
    ),
    _MULTIPLIER,
    Key(
        'sync_period',
        Kind.NUMBER,
        'sync_period',
        per_unit=MICROSECONDS,
        low=500,
        high=60_000_000,
        zero=True,
        why='the unit is microseconds, 10 ms is 10000',
    ),
    Key('sync_window', Kind.INTEGER, default=0, use=Use.LATER, why='its length is not supervised'),
    Key('sync_overflow', Kind.INTEGER, 'sync_overflow', low=2, high=240, zero=True),
    _TIME_COB_ID,
    Key(
        'emcy_inhibit_time', Kind.INTEGER, default=0, use=Use.LATER, why='the master sends no EMCY'
    ),
    Key('nmt_inhibit_time', Kind.INTEGER, default=0, use=Use.LATER, why='NMT is sent at once'),
    Key('error_behavior', Kind.BLOCK, use=Use.LATER, why='the master has no NMT state'),
    Key(
        'start',
        Kind.BOOLEAN,
        default=True,
        use=Use.REFUSED,
        why='the master always runs its cycle; set start_nodes: false to keep devices stopped',
    ),
    Key('start_nodes', Kind.BOOLEAN, 'start_nodes'),
    Key(
        'start_all_nodes',
        Kind.BOOLEAN,
        default=False,
        use=Use.LATER,
        why='each device is started when it is ready',
    ),
    Key(
        'reset_all_nodes',
        Kind.BOOLEAN,
        default=False,
        use=Use.REFUSED,
        why='an error of a mandatory device does not reset the others in this version',
    ),
    Key(
        'stop_all_nodes',
        Kind.BOOLEAN,
        default=False,
        use=Use.REFUSED,
        why='an error of a mandatory device does not stop the others in this version',
    ),
    Key(
        'boot_time', Kind.INTEGER, default=0, use=Use.LATER, why='devices are waited for for ever'
    ),
    Key('boot_timeout', Kind.NUMBER, 'boot_timeout', per_unit=MILLISECONDS, low=1, high=60_000),
)

DEVICE_KEYS: tuple[Key, ...] = (
    Key('node_id', Kind.INTEGER, 'node_id', low=NODE_ID_MIN, high=NODE_ID_MAX, why=NODE_ID_WHY),
    Key('driver', Kind.TEXT, 'driver'),
    _PACKAGE,
    _NAMESPACE,
    _REMAPPINGS,
    Key('dcf', Kind.TEXT, 'dcf'),
    Key('dcf_path', Kind.TEXT, 'dcf_path'),
    Key('polling', Kind.BOOLEAN, use=Use.NEEDLESS),
    Key('period', Kind.NUMBER, 'period', per_unit=MILLISECONDS, low=1, high=60_000),
    Key('non_transmit_timeout', Kind.NUMBER, use=Use.NEEDLESS),
    Key(
        'sdo_timeout_ms',
        Kind.NUMBER,
        'sdo_timeout',
        per_unit=MILLISECONDS,
        low=1,
        high=60_000,
        default=200,
        why='not 20, which many devices exceed',
    ),
    Key(
        'boot_timeout_ms', Kind.NUMBER, 'boot_timeout', per_unit=MILLISECONDS, low=1, high=600_000
    ),
    Key('diagnostics', Kind.BLOCK, use=Use.NEEDLESS),
    Key('enable_lazy_load', Kind.BOOLEAN, use=Use.NEEDLESS),
    Key(
        'num_channels',
        Kind.INTEGER,
        default=1,
        use=Use.REFUSED,
        why='drives with several axes are not supported in this version',
    ),
    Key('channel_names', Kind.BLOCK, use=Use.REFUSED, why='drives have one axis in this version'),
    Key('channels', Kind.BLOCK, use=Use.REFUSED, why='drives have one axis in this version'),
    Key(
        'channel',
        Kind.INTEGER,
        default=0,
        use=Use.REFUSED,
        why='drives have one axis in this version',
    ),
    Key(
        'effort_mode',
        Kind.INTEGER,
        use=Use.LATER,
        why='torque modes are not offered in this version',
    ),
    _identity('revision_number', Use.READ, 'revision_number'),
    _identity('serial_number', Use.READ, 'serial_number'),
    Key(
        'heartbeat_producer',
        Kind.NUMBER,
        'heartbeat_producer',
        per_unit=MILLISECONDS,
        low=0,
        high=U16_MAX,
    ),
    Key('heartbeat_consumer', Kind.BOOLEAN, 'heartbeat_consumer'),
    _MULTIPLIER,
    Key(
        'guard_time',
        Kind.INTEGER,
        default=0,
        use=Use.REFUSED,
        why='there is no node guarding; set heartbeat_producer instead',
    ),
    Key(
        'life_time_factor', Kind.INTEGER, default=0, use=Use.LATER, why='there is no node guarding'
    ),
    _RETRY_FACTOR,
    _TIME_COB_ID,
    Key('error_behavior', Kind.BLOCK),
    Key(
        'boot',
        Kind.BOOLEAN,
        default=True,
        use=Use.REFUSED,
        why='the master configures every device that is named; leave the device out instead',
    ),
    Key('mandatory', Kind.BOOLEAN, 'mandatory'),
    Key('reset_communication', Kind.BOOLEAN, 'reset_communication'),
    Key(
        'restore_configuration',
        Kind.INTEGER,
        default=0,
        use=Use.REFUSED,
        why='defaults are not restored in this version; restore them once by hand (0x1011)',
    ),
    Key(
        'software_file',
        Kind.TEXT,
        default='',
        use=Use.REFUSED,
        why='programs are not downloaded in this version; use the tool of the vendor',
    ),
    Key(
        'software_version',
        Kind.INTEGER,
        default=0,
        use=Use.REFUSED,
        why='the program version is not checked in this version',
    ),
    Key(
        'configuration_file',
        Kind.TEXT,
        default='',
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
    Key('scale_eff_from_dev', Kind.NUMBER, 'scale_eff_from_dev', zero=False),
    Key('offset_pos_to_dev', Kind.NUMBER, 'offset_pos_to_dev'),
    Key('offset_pos_from_dev', Kind.NUMBER, 'offset_pos_from_dev'),
    Key('switching_state', Kind.INTEGER, 'switching_state', choices=SWITCHING_STATES),
    Key('homing_timeout_seconds', Kind.NUMBER, 'homing_timeout', low=0.1, high=3600),
    Key('position_mode', Kind.INTEGER, 'position_mode', choices=POSITION_MODES),
    Key('velocity_mode', Kind.INTEGER, 'velocity_mode', choices=VELOCITY_MODES),
)

SDO_KEYS: tuple[Key, ...] = (
    Key('index', Kind.INTEGER, 'index', low=1, high=U16_MAX, why='an object index has 16 bits'),
    Key('sub_index', Kind.INTEGER, 'subindex', low=0, high=U8_MAX, default=0),
    Key('value', Kind.BLOCK),
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

SECTIONS: dict[str, tuple[Key, ...]] = {
    'options': OPTION_KEYS,
    'master': MASTER_KEYS,
    'a device or defaults': DEVICE_KEYS + DRIVE_KEYS,
    'a PDO number': TPDO_KEYS + RPDO_KEYS,
    'an entry of sdo': SDO_KEYS,
}
"""Where each key belongs, for remedies."""

TOP_LEVEL = ('options', 'master', 'defaults', 'nodes')

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Write docs/bus_yml.md, the table of all keys of bus.yml, from the tables that read them.

Run it after a change of the keys, with the package on the path:
``python3 tools/make_key_table.py``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, MISSING
from enum import Enum
from pathlib import Path
from typing import Any

from arm_canopen.config.model.drive import DriveConfig
from arm_canopen.config.read.device_keys import (
    DEVICE_KEYS,
    DRIVE_KEYS,
    RPDO_KEYS,
    SDO_KEYS,
    TPDO_KEYS,
)
from arm_canopen.config.read.master_keys import MASTER_KEYS, OPTION_KEYS
from arm_canopen.config.read.schema import Key, Use
from arm_canopen.config.resolve.settings import DeviceSettings, MasterSettings, Options

TARGET = Path(__file__).parents[1] / 'docs' / 'bus_yml.md'
UNITS = {1000.0: 'ms', 1_000_000.0: 'µs', 10_000.0: '100 µs', 0.001: 'kbit/s'}

HEAD = """# The keys of bus.yml

Made by `tools/make_key_table.py` from the tables by which bus.yml is read. Names, units and
defaults are those of ros2_canopen and of Lely's dcfgen; both formats of the file are read, with
`options`, `master`, `defaults` and `nodes`, or with the devices at the top level. A device's own
value beats that of `defaults`. An unknown key is refused with its line and the key that was
probably meant; `canopen check` reports all that is wrong at once.
"""

TEXTS: dict[str, str] = {
    'dcf_path': 'folder of the EDS files; `@BUS_CONFIG_PATH@` is that of the bus.yml',
    'heartbeat_multiplier': 'heartbeats that may be missing before the sender counts as lost',
    'retry_factor': 'answers to node guarding that may be missing',
    'node_id': 'CANopen node id',
    'driver': 'class of the driver, e.g. `ros2_canopen::Cia402Driver`',
    'package': 'ROS package of the driver; not needed',
    'namespace': 'ROS namespace of the node',
    'remappings': 'ROS remappings, from name to name',
    'baudrate': 'bit rate, for the bus load; the interface is set up outside',
    'vendor_id': '0x1018:01 of the master; for `canopen dcf` only',
    'product_code': '0x1018:02 of the master; for `canopen dcf` only',
    'master.revision_number': '0x1018:03 of the master; for `canopen dcf` only',
    'master.serial_number': '0x1018:04 of the master; for `canopen dcf` only',
    'master.heartbeat_consumer': 'the master watches the heartbeats of the devices',
    'master.heartbeat_producer': "period of the master's heartbeat, 0 for none",
    'sync_period': 'period of SYNC, which is the cycle; 0 for none',
    'sync_window': 'time after SYNC in which TPDOs should answer; later ones are counted',
    'sync_overflow': 'highest counter in SYNC, 0 for none',
    'master.time_cob_id': 'COB-ID of TIME; bit 30 has the master send it, each second by default',
    'time_period_ms': 'period of TIME, 0 for none',
    'emcy_inhibit_time': 'for `canopen dcf` only: the master sends no EMCY',
    'nmt_inhibit_time': 'shortest time between two NMT commands',
    'master.error_behavior': 'for `canopen dcf` only',
    'start': 'false: SYNC and RPDOs wait for NMT start to the id of the master',
    'start_nodes': 'the master starts each device when it is configured',
    'start_all_nodes': 'the first start is one frame to all, when all are configured',
    'reset_all_nodes': 'the loss of a mandatory device resets all devices',
    'stop_all_nodes': 'the loss of a mandatory device stops all devices',
    'boot_time': 'time after which missing mandatory devices are reported, 0 for never',
    'boot_timeout': 'time-out of each SDO of the boot',
    'dcf': 'EDS or DCF of the device; ParameterValues of a DCF that are not its defaults are '
    'written at boot, before all else; a drive without a file is taken as CiA 402 has it',
    'device.dcf_path': 'folder of that file, instead of that of `options`',
    'polling': 'accepted; the cycle is that of SYNC',
    'period': 'how often objects that no PDO carries are read; without SYNC the cycle, too',
    'non_transmit_timeout': 'accepted, not needed',
    'sdo_timeout_ms': 'time-out of each SDO after the boot',
    'boot_timeout_ms': 'how long one attempt to find the device takes',
    'diagnostics': 'accepted; diagnostics are always on',
    'enable_lazy_load': 'accepted, not needed',
    'num_channels': 'number of axes, objects 0x800 apart',
    'channel_names': 'their names; without: `<device>_0`, `<device>_1`',
    'channels': 'scales of single axes',
    'channel': 'accepted, not needed',
    'device.revision_number': 'expected 0x1018:03, 0 is not checked',
    'device.serial_number': 'expected 0x1018:04, 0 is not checked',
    'device.heartbeat_producer': 'period of its heartbeat (0x1017); without: that of the EDS',
    'device.heartbeat_consumer': 'it watches the master (0x1016); without: if it can',
    'guard_time': 'period of node guarding, without a heartbeat; without: that of the EDS',
    'life_time_factor': 'guard times after which the device misses the master (0x100D)',
    'device.time_cob_id': '0x1012, bit 31 has the device take TIME',
    'device.error_behavior': '0x1029 by sub-index',
    'boot': 'false: the device is taken as it is, neither reset nor configured nor started',
    'mandatory': 'no device is started before this one is configured',
    'reset_communication': 'false: a device that is in operation is taken over without a reset; '
    'it must not watch the master, so write `heartbeat_consumer: false`, too: else it stops by '
    'itself while no master is there',
    'restore_configuration': 'sub-index of 0x1011 by which defaults are restored before the boot',
    'software_file': 'refused: programs are loaded with the tool of the vendor',
    'software_version': 'refused, as above',
    'configuration_file': 'refused: what is written stands in `sdo`',
    'sdo': 'objects that are written at boot, after the PDOs',
    'tpdo': 'what the device sends, by number',
    'rpdo': 'what the device receives, by number',
    'scale_pos_to_dev': 'increments per user unit',
    'scale_vel_to_dev': 'device velocity per user velocity',
    'scale_pos_from_dev': 'user units per increment',
    'scale_vel_from_dev': 'user velocity per device velocity',
    'scale_acc_to_dev': 'device acceleration per user acceleration; without: by the drive (0x60A9 '
    'with 0x60AA, or 0x6097), else its velocity units per second (our own key)',
    'scale_acc_from_dev': 'user acceleration per device acceleration; without: the inverse of the '
    'other (our own key)',
    'scale_from_factor_group': 'positions in rad by the factor group of the drive (0x608F, '
    '0x6091, 0x6092, 0x6096, 0x60A8, 0x60A9), in the place of the scales (our own key)',
    'scale_eff_to_dev': 'device torque per user effort (our own key)',
    'scale_eff_from_dev': 'user effort per device torque; without: the inverse of the other',
    'offset_pos_to_dev': 'added to a target in increments',
    'offset_pos_from_dev': 'added to a position in user units; `offset_pos_to_dev` takes it back',
    'switching_state': 'state in which the mode is switched: 2 to 5 of CiA 402',
    'homing_timeout_seconds': 'longest time for homing [s]',
    'position_mode': 'mode for positions: 1, 7 or 8; its objects are checked, services select it',
    'velocity_mode': 'as position_mode, for velocities: 2, 3 or 9',
    'effort_mode': 'as position_mode, for efforts: 4 or 10',
    'target_timeout_ms': 'pause that ends a stream on `~/target` (our own key)',
    'recovery': '`manual` or `auto`: after a loss (our own key)',
    'quirks': 'where the drive deviates from CiA 402 (our own key)',
    'enabled': 'the PDO exists',
    'cob_id': 'its identifier, or `auto`; without: that of the EDS',
    'transmission': 'transmission type; without: that of the EDS',
    'mapping': 'mapped objects, each with `index` and `sub_index`; without: that of the EDS',
    'sync_start': 'SYNC counter at which it begins',
    'inhibit_time': 'shortest time between two',
    'event_timer': 'longest time between two; its end is reported after three times as long; '
    "100 for a drive's state on change",
    'event_deadline': 'longest time that the device waits for one',
    'index': 'object',
    'sub_index': 'its sub-index',
    'value': 'what is written, by the type of the EDS',
    'timeout_ms': 'time-out of each SDO for this object, which is then not sent twice; without: '
    '`boot_timeout` at boot and `sdo_timeout_ms` after it, for 0x1010 and 0x1011 10 s at least '
    '(our own key)',
}

SECTIONS: tuple[tuple[str, str, tuple[Key, ...], type], ...] = (
    ('options', 'options', OPTION_KEYS, Options),
    ('master', 'master', MASTER_KEYS, MasterSettings),
    ('device', 'A device, or `defaults`', DEVICE_KEYS, DeviceSettings),
    ('drive', 'A drive, or `defaults`', DRIVE_KEYS, DriveConfig),
    ('tpdo', 'A number below `tpdo`', TPDO_KEYS, object),
    ('rpdo', 'A number below `rpdo`', RPDO_KEYS, object),
    ('sdo', 'An entry of `sdo`', SDO_KEYS, object),
)


def page() -> str:
    """Return docs/bus_yml.md: a table of keys for each part of bus.yml."""
    return '\n'.join([HEAD, *(line for section in SECTIONS for line in _table(*section))])


def _table(name: str, title: str, keys: tuple[Key, ...], model: type) -> Iterator[str]:
    yield f'## {title}\n'
    yield '| key | unit | default | meaning |'
    yield '|---|---|---|---|'
    defaults = _defaults(model)
    for key in keys:
        text = TEXTS.get(f'{name}.{key.name}') or TEXTS[key.name]
        unit = UNITS.get(key.per_unit, '') if key.per_unit else ''
        yield f'| `{key.name}` | {unit} | {_default(key, defaults)} | {text} |'
    yield ''


def _defaults(model: type) -> dict[str, Any]:
    if model is object:
        return {}
    return {field.name: field.default for field in fields(model) if field.default is not MISSING}


def _default(key: Key, defaults: Mapping[str, Any]) -> str:
    value = key.neutral if key.default is None else key.default
    if value is None and key.use is Use.READ and key.field in defaults:
        value = defaults[key.field]
        if isinstance(value, (int, float)) and not isinstance(value, bool) and key.per_unit:
            value *= key.per_unit
    if value is None or value == '':
        return ''
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Enum):
        return str(value.value)
    return f'{value:g}' if isinstance(value, float) else str(value)


if __name__ == '__main__':
    TARGET.parent.mkdir(exist_ok=True)
    TARGET.write_text(page(), encoding='utf-8')

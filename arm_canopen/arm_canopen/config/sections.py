# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The sections of a bus.yml: each key once, with type, unit, range, default and description.

Names, units and defaults are those of ros2_canopen and of Lely's dcfgen, so that their files can
be read unchanged. If a default differs, ``why`` gives the reason. Keys not in either are
``scale_acc_to_dev``, ``scale_acc_from_dev``, ``scale_eff_to_dev``, ``scale_from_factor_group``,
``target_timeout_ms``, ``recovery``, ``quirks``, ``timeout_ms`` of an entry of ``sdo`` and
``time_period_ms`` of the master.

``MasterConfig``, ``NodeConfig`` and ``DriveConfig`` declare the keys that fill their fields. The
sections here declare the keys whose value also depends on other sections or the EDS.

The field of an absent key is the default of the model if the model has that field, and None if
other sections or the EDS decide.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
import re
from typing import Any

from canopen_core.standard import NODE_ID_MAX, NODE_ID_MIN

from .keys import HUNDRED_MICROSECONDS, Key, key, keys_of, Kind, MILLISECONDS, Use
from .model.bus import MasterConfig, NodeConfig, RETRY_FACTOR, U16_MAX, U32_MAX
from .model.drive import DriveConfig

U8_MAX = 0xFF
NAMESPACE = re.compile(r'/?([A-Za-z_][A-Za-z0-9_]*(/[A-Za-z_][A-Za-z0-9_]*)*)?')
NO_DICTIONARY = 'the master has no object dictionary of its own'


_multiplier = partial(
    key,
    text='heartbeats that may be missing before the sender counts as lost',
    span=(1, 1000),
    why='below 1 every heartbeat would count as lost',
)
_retry_factor = partial(
    key,
    text='answers to node guarding that may be missing',
    span=(1, U8_MAX),
    why='a device is lost after so many missing answers to node guarding',
)


def _own_identity(subindex: int) -> Any:  # noqa: ANN401
    return key(
        0,
        f'0x1018:{subindex:02} of the master; for `canopen dcf` only',
        (0, U32_MAX),
        use=Use.UNUSED,
        why=NO_DICTIONARY,
    )


@dataclass(frozen=True, slots=True)
class Options:
    """Section ``options``."""

    dcf_path: str = key('', 'folder of the EDS files; `@BUS_CONFIG_PATH@` is that of the bus.yml')
    heartbeat_multiplier: float = _multiplier(3.0)
    retry_factor: int = _retry_factor(RETRY_FACTOR)


@dataclass(frozen=True, slots=True)
class _NodeSettings:
    node_id: int | None = key(
        None, 'CANopen node id', (NODE_ID_MIN, NODE_ID_MAX), why='CANopen node ids are 1 to 127'
    )
    driver: str = key('', 'class of the driver, e.g. `ros2_canopen::Cia402Driver`')
    package: str | None = key(None, 'ROS package of the driver; not needed', use=Use.IGNORED)
    namespace: str = key(
        '', 'ROS namespace of the node', form=NAMESPACE, why="write it like '/left/arm'"
    )
    remappings: None = key(None, 'ROS remappings, from name to name')


@dataclass(frozen=True, slots=True)
class MasterSettings(_NodeSettings):
    """Section ``master``, except the keys that :class:`.model.MasterConfig` declares."""

    vendor_id: int = _own_identity(1)
    product_code: int = _own_identity(2)
    revision_number: int = _own_identity(3)
    serial_number: int = _own_identity(4)
    watch_devices: bool = key(
        True, 'the master watches the heartbeats of the devices', name='heartbeat_consumer'
    )
    heartbeat_multiplier: float | None = _multiplier(None)
    time_period: float | None = key(
        None,
        'period of TIME, 0 for none',
        (1, 86_400_000),
        unit=MILLISECONDS,
        name='time_period_ms',
        zero=True,
    )
    error_behavior: None = key(
        None, 'for `canopen dcf` only', use=Use.UNUSED, why='the master has no NMT state'
    )


@dataclass(frozen=True, slots=True)
class DeviceSettings(_NodeSettings):
    """Section of a device, except the keys that :class:`.model.NodeConfig` declares."""

    dcf: str = key(
        '',
        'EDS or DCF of the device; ParameterValues of a DCF that are not its defaults are'
        ' written at boot, before all else; a drive without a file is taken as CiA 402 '
        'has it',
    )
    dcf_path: str | None = key(None, 'folder of that file, instead of that of `options`')
    polling: bool | None = key(None, 'accepted; the cycle is that of SYNC', use=Use.IGNORED)
    non_transmit_timeout: float | None = key(None, 'accepted, not needed', use=Use.IGNORED)
    diagnostics: None = key(None, 'accepted; diagnostics are always on', use=Use.IGNORED)
    enable_lazy_load: bool | None = key(None, 'accepted, not needed', use=Use.IGNORED)
    num_channels: int = key(
        1, 'number of axes, objects 0x800 apart', (1, 8), why='CiA 402 has 8 axes'
    )
    channel_names: None = key(None, 'their names; without: `<device>_0`, `<device>_1`')
    channels: None = key(None, 'scales of single axes')
    channel: int | None = key(None, 'accepted, not needed', use=Use.IGNORED)
    revision_number: int = key(0, 'expected 0x1018:03, 0 is not checked', (0, U32_MAX))
    serial_number: int = key(0, 'expected 0x1018:04, 0 is not checked', (0, U32_MAX))
    heartbeat_producer: float | None = key(
        None,
        'period of its heartbeat (0x1017); without: that of the EDS',
        (0, U16_MAX),
        unit=MILLISECONDS,
    )
    heartbeat_consumer: bool | None = key(
        None, 'it watches the master (0x1016); without: if it can'
    )
    heartbeat_multiplier: float | None = _multiplier(None)
    guard_time: float | None = key(
        None,
        'period of node guarding, without a heartbeat; without: that of the EDS',
        (0, U16_MAX),
        unit=MILLISECONDS,
        kind=Kind.INTEGER,
    )
    life_time_factor: int | None = key(
        None, 'guard times after which the device misses the master (0x100D)', (0, U8_MAX)
    )
    retry_factor: int | None = _retry_factor(None)
    time_cob_id: None = key(None, '0x1012, bit 31 has the device take TIME')
    error_behavior: None = key(None, '0x1029 by sub-index')
    software_file: str = key(
        '',
        'refused: programs are loaded with the tool of the vendor',
        use=Use.REFUSED,
        why='programs are not downloaded in this version; use the tool of the vendor',
    )
    software_version: int = key(
        0,
        'refused, as above',
        use=Use.REFUSED,
        why='the program version is not checked in this version',
    )
    configuration_file: str = key(
        '',
        'refused: what is written stands in `sdo`',
        use=Use.REFUSED,
        why='there are no .bin files; write the objects to the sdo list',
    )
    sdo: None = key(None, 'objects that are written at boot, after the PDOs')
    tpdo: None = key(None, 'what the device sends, by number')
    rpdo: None = key(None, 'what the device receives, by number')


@dataclass(frozen=True, slots=True)
class _PdoKeys:
    enabled: bool | None = key(True, 'the PDO exists')
    cob_id: None = key(None, 'its identifier, or `auto`; without: that of the EDS')
    transmission: int | None = key(
        None, 'transmission type; without: that of the EDS', (0, U8_MAX)
    )
    mapping: None = key(
        None, 'mapped objects, each with `index` and `sub_index`; without: that of the EDS'
    )


@dataclass(frozen=True, slots=True)
class _TpdoKeys(_PdoKeys):
    sync_start: int | None = key(None, 'SYNC counter at which it begins', (0, 240))
    inhibit_time: int | None = key(
        None,
        'shortest time between two',
        (0, U16_MAX),
        unit=HUNDRED_MICROSECONDS,
        why='the unit is 100 microseconds',
    )
    event_time: int | None = key(
        None,
        'longest time between two; its end is reported after three times as long; '
        "100 for a drive's state on change",
        (0, U16_MAX),
        unit=MILLISECONDS,
        name='event_timer',
    )


@dataclass(frozen=True, slots=True)
class _RpdoKeys(_PdoKeys):
    event_time: int | None = key(
        None,
        'longest time that the device waits for one',
        (0, U16_MAX),
        unit=MILLISECONDS,
        name='event_deadline',
    )


@dataclass(frozen=True, slots=True)
class _MappingKeys:
    index: int | None = key(None, 'object', (1, U16_MAX), why='an object index has 16 bits')
    subindex: int | None = key(0, 'its sub-index', (0, U8_MAX), name='sub_index')


@dataclass(frozen=True, slots=True)
class _SdoKeys(_MappingKeys):
    value: None = key(None, 'what is written, by the type of the EDS')
    timeout: float | None = key(
        None,
        'time-out of each SDO for this object, which is then not sent twice; without: '
        '`boot_timeout` at boot and `sdo_timeout_ms` after it, for 0x1010 and 0x1011 10 s'
        ' at least (our own key)',
        (1, 600_000),
        unit=MILLISECONDS,
        name='timeout_ms',
    )


OPTION_KEYS = keys_of(Options)
MASTER_KEYS = keys_of(MasterSettings) + keys_of(MasterConfig)
DEVICE_KEYS = keys_of(DeviceSettings) + keys_of(NodeConfig)
TPDO_KEYS, RPDO_KEYS = keys_of(_TpdoKeys), keys_of(_RpdoKeys)
MAPPING_KEYS, SDO_KEYS = keys_of(_MappingKeys), keys_of(_SdoKeys)
DRIVE_KEYS = keys_of(DriveConfig)
CHANNEL_KEYS = tuple(each for each in DRIVE_KEYS if each.name.startswith(('scale_', 'offset_')))
"""What an entry of ``channels`` may say of one axis."""
SCALE_KEYS = ('scale_pos_to_dev', 'scale_pos_from_dev', 'scale_vel_to_dev', 'scale_vel_from_dev')
"""What ``scale_from_factor_group`` takes the place of."""

TOP_LEVEL = ('options', 'master', 'defaults', 'nodes')
SECTIONS: dict[str, tuple[Key, ...]] = {
    'options': OPTION_KEYS,
    'master': MASTER_KEYS,
    'a device or defaults': DEVICE_KEYS + DRIVE_KEYS,
    'a number below tpdo': TPDO_KEYS,
    'a number below rpdo': RPDO_KEYS,
    'an entry of sdo': SDO_KEYS,
}
"""Where each key belongs, for remedies."""

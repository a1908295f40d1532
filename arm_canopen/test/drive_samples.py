# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Configurations of drives and buses as bus.yml would give them, made in Python."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from arm_canopen import BusConfig, NodeConfig
from arm_canopen.config import MasterConfig, PdoConfig, RPDO, SdoWrite, TPDO
from canopen_core.eds import load_eds
from canopen_core.standard import MappedObject, ObjectDictionary, rpdo_default, tpdo_default

DRIVE_EDS = Path(__file__).parents[1] / 'eds' / 'cia402_drive.eds'
PERIOD = 0.01  # [s]
SCALE = 10_000.0  # [inc/rad]


@cache
def drive_dictionary() -> ObjectDictionary:
    """Read the EDS of the simulated drive, once."""
    return load_eds(DRIVE_EDS).dictionary


def with_defaults(
    dictionary: ObjectDictionary, defaults: Mapping[tuple[int, int], int]
) -> ObjectDictionary:
    """Return a dictionary in which some objects have other defaults."""
    return ObjectDictionary(
        replace(entry, default=defaults[entry.address], node_relative=False)
        if entry.address in defaults
        else entry
        for entry in dictionary
    )


def pdo(number: int, cob_id: int, *objects: tuple[int, int], transmission: int = 1) -> PdoConfig:
    """Return a PDO of the simulated drive with objects by index and sub-index."""
    dictionary = drive_dictionary()
    mapping = []
    for index, subindex in objects:
        entry = dictionary.get(index, subindex)
        assert entry is not None
        mapping.append(MappedObject(index, subindex, entry.data_type))
    direction = TPDO if cob_id & 0x80 else RPDO
    return PdoConfig(
        direction, number, True, cob_id, transmission, mapping=tuple(mapping), configured=True
    )


def sdo_write(index: int, subindex: int, value: int) -> SdoWrite:
    """Return the write of a number to an object of the simulated drive."""
    entry = drive_dictionary().get(index, subindex)
    assert entry is not None
    size = MappedObject(index, subindex, entry.data_type).bits // 8
    return SdoWrite(index, subindex, (value % (1 << 8 * size)).to_bytes(size, 'little'))


MOTION_WRITES: tuple[SdoWrite, ...] = (
    sdo_write(0x6081, 0, 10_000),  # profile velocity: 1 rad/s
    sdo_write(0x6083, 0, 50_000),  # profile acceleration: 5 rad/s^2
    sdo_write(0x6084, 0, 50_000),  # profile deceleration
    sdo_write(0x6085, 0, 100_000),  # quick stop deceleration
    sdo_write(0x60C2, 1, 10),  # interpolation period: 10 ms
)


def drive_config(name: str, node_id: int, **changes: Any) -> NodeConfig:
    """Return a drive with all that the master commands in its PDOs.

    Args:
        name: Name in bus.yml.
        node_id: CANopen node id.
        **changes: Other values for fields of NodeConfig; ``scales`` for those of its drive.
    """
    scales: dict[str, Any] = {
        'scale_pos_to_dev': SCALE,
        'scale_vel_to_dev': SCALE,
        'scale_pos_from_dev': 1 / SCALE,
        'scale_vel_from_dev': 1 / SCALE,
    } | changes.pop('scales', {})
    config = NodeConfig(
        name=name,
        node_id=node_id,
        driver='ros2_canopen::Cia402Driver',
        eds=DRIVE_EDS,
        dictionary=drive_dictionary().for_node(node_id),
        heartbeat_producer=0.1,
        heartbeat_timeout=0.3,
        sdo_writes=MOTION_WRITES,
        tpdos=(
            pdo(1, tpdo_default(1, node_id), (0x6041, 0), (0x6061, 0)),
            pdo(2, tpdo_default(2, node_id), (0x6064, 0), (0x606C, 0)),
        ),
        rpdos=(
            pdo(1, rpdo_default(1, node_id), (0x6040, 0), (0x6060, 0)),
            pdo(2, rpdo_default(2, node_id), (0x607A, 0), (0x60FF, 0)),
            pdo(3, rpdo_default(3, node_id), (0x60C1, 1)),
        ),
    )
    axis = replace(config.drive, name=name, **scales)
    return replace(config, **{'axes': (axis,)} | changes)


def every_mode(config: NodeConfig) -> NodeConfig:
    """Return a drive of :func:`drive_config` whose PDOs carry what all modes need."""
    node_id = config.node_id
    torque = pdo(3, tpdo_default(3, node_id), (0x6077, 0))
    targets = pdo(3, rpdo_default(3, node_id), (0x60C1, 1), (0x6071, 0), (0x6042, 0))
    return replace(config, tpdos=(*config.tpdos, torque), rpdos=(*config.rpdos[:2], targets))


def bus_config(*nodes: NodeConfig, **master: Any) -> BusConfig:
    """Return a bus with devices and, as keywords, other values for fields of MasterConfig."""
    settings: dict[str, Any] = {'node_id': 1, 'sync_period': PERIOD, 'cycle_period': PERIOD}
    settings['heartbeat_producer'] = 0.0
    return BusConfig(Path('bus.yml'), MasterConfig(**settings | master), nodes)

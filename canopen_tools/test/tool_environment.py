# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment of a tool that is a process of its own, and a small bus for the monitor."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TypeAlias

import pytest

from arm_canopen import BusConfig, NodeConfig
from arm_canopen.config import MasterConfig, PdoConfig, RPDO, TPDO
from canopen_core.standard import DataType, MappedObject, ObjectDictionary, ObjectEntry

REPOSITORY = Path(__file__).parents[2]
ENVIRONMENT = os.environ | {
    'PYTHONPATH': os.pathsep.join(
        str(REPOSITORY / package)
        for package in (
            'arm_canopen',
            'canopen_core',
            'canopen_tools',
            'libraries/recording',
            'libraries/robot_primitives',
            'libraries/ros_runtime',
        )
    )
}

Output: TypeAlias = pytest.CaptureFixture[str]
"""What a tool has printed, in a test that runs it in its own process."""


DRIVE_OBJECTS = ObjectDictionary(
    [
        ObjectEntry(0x1008, 0, 'Name', DataType.VISIBLE_STRING),
        ObjectEntry(0x1014, 0, 'COB-ID EMCY', DataType.UNSIGNED32, default=0x82),
        ObjectEntry(0x1800, 1, 'COB-ID used by TPDO', DataType.UNSIGNED32),
        ObjectEntry(0x1A00, 1, '1st object', DataType.UNSIGNED32),
        ObjectEntry(0x6040, 0, 'Control', DataType.UNSIGNED16),
        ObjectEntry(0x6041, 0, 'Status', DataType.UNSIGNED16),
        ObjectEntry(0x6060, 0, 'Mode', DataType.INTEGER8),
        ObjectEntry(0x6061, 0, 'Mode shown', DataType.INTEGER8),
        ObjectEntry(0x6064, 0, 'Position', DataType.INTEGER32),
        ObjectEntry(0x6075, 0, 'Motor rated current', DataType.REAL32),
    ],
    source='drive.eds',
)


def _mapped(*objects: tuple[int, DataType]) -> tuple[MappedObject, ...]:
    return tuple(MappedObject(index, 0, data_type) for index, data_type in objects)


def _pdo(number: int, cob_id: int, *objects: tuple[int, DataType]) -> PdoConfig:
    direction = TPDO if cob_id & 0x80 else RPDO
    return PdoConfig(direction, number, True, cob_id, 1, mapping=_mapped(*objects))


DRIVE = NodeConfig(
    name='joint1',
    node_id=2,
    driver='ros2_canopen::Cia402Driver',
    eds=Path('drive.eds'),
    dictionary=DRIVE_OBJECTS,
    tpdos=(
        _pdo(1, 0x182, (0x6041, DataType.UNSIGNED16), (0x6061, DataType.INTEGER8)),
        _pdo(2, 0x2A5, (0x6064, DataType.INTEGER32), (0x5FFF, DataType.UNSIGNED8)),
        PdoConfig(TPDO, 3, enabled=False, cob_id=0x382, transmission=1),
    ),
    rpdos=(_pdo(1, 0x202, (0x6040, DataType.UNSIGNED16), (0x6060, DataType.INTEGER8)),),
)
DEVICE = NodeConfig(
    name='gripper',
    node_id=9,
    driver='ros2_canopen::ProxyDriver',
    eds=Path('gripper.eds'),
    dictionary=ObjectDictionary(
        [
            ObjectEntry(0x1005, 0, 'COB-ID SYNC', DataType.UNSIGNED32, default=0x4000_0091),
            ObjectEntry(0x1014, 0, 'COB-ID EMCY', DataType.UNSIGNED32, default=0x0C1),
        ]
    ),
)
BUS = BusConfig(
    file=Path('bus.yml'), master=MasterConfig(node_id=1, name='master'), nodes=(DRIVE, DEVICE)
)

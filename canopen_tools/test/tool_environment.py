# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The environment of a tool that is a process of its own, and a small bus for the monitor."""

from __future__ import annotations

from dataclasses import replace
import os
from pathlib import Path
from typing import TypeAlias

from drive_samples import bus_config, drive_config, pdo
import pytest

from arm_canopen import NodeConfig
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


UNKNOWN = MappedObject(0x5FFF, 0, DataType.UNSIGNED8)
DRIVE = drive_config(
    'joint1',
    2,
    dictionary=DRIVE_OBJECTS,
    tpdos=(
        pdo(1, 0x182, (0x6041, 0), (0x6061, 0)),
        replace(position := pdo(2, 0x2A5, (0x6064, 0)), mapping=(*position.mapping, UNKNOWN)),
        replace(pdo(3, 0x382), enabled=False),
    ),
    rpdos=(pdo(1, 0x202, (0x6040, 0), (0x6060, 0)),),
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
BUS = bus_config(DRIVE, DEVICE)

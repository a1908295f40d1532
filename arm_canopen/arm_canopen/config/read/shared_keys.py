# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys that stand in more than one section of bus.yml."""

from __future__ import annotations

from ...standard.cob_id import NODE_ID_MAX, NODE_ID_MIN
from .schema import Key, Kind, Use

U8_MAX = 0xFF
U16_MAX = 0xFFFF
U32_MAX = 0xFFFF_FFFF

NODE_ID = Key(
    'node_id',
    Kind.INTEGER,
    'node_id',
    low=NODE_ID_MIN,
    high=NODE_ID_MAX,
    why='CANopen node ids are 1 to 127',
)
DRIVER = Key('driver', Kind.TEXT, 'driver')
PACKAGE = Key('package', Kind.TEXT, use=Use.IGNORED)
NAMESPACE = Key('namespace', Kind.TEXT, 'namespace')
REMAPPINGS = Key('remappings', Kind.BLOCK)
MULTIPLIER = Key(
    'heartbeat_multiplier',
    Kind.NUMBER,
    'heartbeat_multiplier',
    low=1,
    high=1000,
    why='below 1 every heartbeat would count as lost',
)
RETRY_FACTOR = Key(
    'retry_factor',
    Kind.INTEGER,
    'retry_factor',
    low=1,
    high=U8_MAX,
    why='a device is lost after so many missing answers to node guarding',
)

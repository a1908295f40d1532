# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads objects of drives by SDO, beside their master or without one."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from arm_canopen import DriveState
from canopen_core.can import Frame
from canopen_core.standard import CobId, drive_state

if TYPE_CHECKING:
    from canopen_core.can import Bus

STATUSWORD, POSITION = 0x6041, 0x6064
TIMEOUT = 2.0
"""Longest time in [s] for an answer."""


def read(bus: Bus, node_id: int, index: int) -> int:
    """Read a signed number.

    Raises:
        AssertionError: There is no answer.
    """
    request = bytes([0x40, index & 0xFF, index >> 8, 0, 0, 0, 0, 0])
    bus.send(Frame(CobId.SDO_REQUEST + node_id, request))
    answer = CobId.SDO_RESPONSE + node_id
    deadline = time.monotonic() + TIMEOUT
    while time.monotonic() < deadline:
        for frame in bus.receive(0.1):
            if frame.can_id == answer and frame.data[1:3] == index.to_bytes(2, 'little'):
                size = 4 - ((frame.data[0] >> 2) & 3)
                return int.from_bytes(frame.data[4 : 4 + size], 'little', signed=True)
    raise AssertionError(f'node {node_id} does not answer')


def read_position(bus: Bus, node_id: int) -> int:
    """Return where a drive is, in its increments."""
    return read(bus, node_id, POSITION)


def is_enabled(bus: Bus, node_id: int) -> bool:
    """Return whether a drive is in Operation enabled."""
    return drive_state(read(bus, node_id, STATUSWORD)) is DriveState.OPERATION_ENABLED

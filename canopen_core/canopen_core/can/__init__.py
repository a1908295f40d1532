# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CAN buses by name, with time stamps, counters and logs.

Log readers and writers are imported on first use, because they import python-can.
"""

from importlib import import_module
from typing import Any, TYPE_CHECKING

from .bus import Bus, BusCounters, VirtualBus, VirtualWire, wall_clock_offset
from .bus_thread import BusThread
from .candump_format import format_line, log_channel
from .frame import (
    BusLoad,
    controller_state,
    ControllerState,
    error_counters,
    error_text,
    EXTENDED_ID_MAX,
    Frame,
    frame_bits,
    FrameRing,
    is_unacknowledged,
    LoadFigures,
    PAYLOAD_MAX,
    RecordedFrame,
    STANDARD_ID_MAX,
    stuff_bits_mean,
    stuff_bits_worst,
)
from .opening import AUTO, auto_names, open_bus, resolve_name
from .socketcan import can_interfaces, CanInterface, missing_interface_text

if TYPE_CHECKING:
    from .frame_log import LogWriter, read_buses, read_log

__all__ = [
    'AUTO',
    'EXTENDED_ID_MAX',
    'PAYLOAD_MAX',
    'STANDARD_ID_MAX',
    'Bus',
    'BusCounters',
    'BusLoad',
    'BusThread',
    'CanInterface',
    'ControllerState',
    'Frame',
    'FrameRing',
    'LoadFigures',
    'LogWriter',
    'RecordedFrame',
    'VirtualBus',
    'VirtualWire',
    'auto_names',
    'can_interfaces',
    'controller_state',
    'error_counters',
    'error_text',
    'format_line',
    'frame_bits',
    'is_unacknowledged',
    'log_channel',
    'missing_interface_text',
    'open_bus',
    'read_buses',
    'read_log',
    'resolve_name',
    'stuff_bits_mean',
    'stuff_bits_worst',
    'wall_clock_offset',
]

_OF_LOGS = ('LogWriter', 'read_buses', 'read_log')


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name not in _OF_LOGS:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module('.frame_log', __name__), name)

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CAN buses by name, with time stamps, counters and logs.

What reads and writes logs is loaded when it is used: it brings python-can.
"""

from importlib import import_module
from typing import Any, TYPE_CHECKING

from .bus import Bus, BusCounters, wall_clock_offset
from .bus_thread import BusThread
from .error_frames import error_text
from .frame import EXTENDED_ID_MAX, Frame, STANDARD_ID_MAX
from .interfaces import can_interfaces, CanInterface, missing_interface_text
from .opening import AUTO, auto_names, open_bus, resolve_name
from .virtual import VirtualBus, VirtualWire

if TYPE_CHECKING:
    from .frame_log import LogWriter, read_buses, read_log

__all__ = [
    'AUTO',
    'EXTENDED_ID_MAX',
    'STANDARD_ID_MAX',
    'Bus',
    'BusCounters',
    'BusThread',
    'CanInterface',
    'Frame',
    'LogWriter',
    'VirtualBus',
    'VirtualWire',
    'auto_names',
    'can_interfaces',
    'error_text',
    'missing_interface_text',
    'open_bus',
    'read_buses',
    'read_log',
    'resolve_name',
    'wall_clock_offset',
]

_OF_LOGS = ('LogWriter', 'read_buses', 'read_log')


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name not in _OF_LOGS:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    return getattr(import_module('.frame_log', __name__), name)

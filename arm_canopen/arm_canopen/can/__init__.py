# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CAN buses by name, with time stamps, counters and logs."""

from .bus import Bus, BusCounters
from .frame import Frame
from .opening import AUTO, auto_names, open_bus, resolve_name

__all__ = ['AUTO', 'Bus', 'BusCounters', 'Frame', 'auto_names', 'open_bus', 'resolve_name']

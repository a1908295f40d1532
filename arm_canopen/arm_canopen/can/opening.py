# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Opens a bus by its name.

============================================  ====================================================
``virtual:NAME``                              inside this process
``udp_multicast[:239.x.y.z[:PORT]]``          between the processes of this host
``auto``                                      vcan0 when it is there and up, else the default group
============================================  ====================================================
"""

from __future__ import annotations

import logging

from ..exceptions import BusError
from .bus import Bus
from .multicast import check_group, DEFAULT_GROUP, DEFAULT_PORT, MulticastBus
from .virtual import open_virtual

AUTO = 'auto'
_log = logging.getLogger(__name__)


def open_bus(name: str) -> Bus:
    """Open a bus.

    Args:
        name: See the table above; ``auto`` picks one and logs which.

    Raises:
        BusError: No such interface, or it is down; the message says what to do.
    """
    resolved = resolve_name(name)
    if resolved != name:
        _log.info('bus %s is %s', name, resolved)
    kind, _, channel = resolved.partition(':')
    if kind == 'virtual':
        return open_virtual(resolved, channel)
    if kind == 'udp_multicast':
        return _open_multicast(resolved, channel)
    raise BusError(f'no bus is called {name!r}')


def resolve_name(name: str) -> str:
    """Return the name of the bus that :func:`open_bus` would open; it is ``name`` but for auto."""
    if name != AUTO:
        return name
    return f'udp_multicast:{DEFAULT_GROUP}'


def _open_multicast(name: str, channel: str) -> Bus:
    group, colon, digits = (channel or DEFAULT_GROUP).partition(':')
    check_group(group)
    if not colon:
        return MulticastBus(name, group, DEFAULT_PORT)
    if not digits.isdecimal() or not 0 < int(digits) < 0x10000:
        raise BusError(f'{name}: {digits!r} is no UDP port; take 1 to 65535')
    return MulticastBus(name, group, int(digits))

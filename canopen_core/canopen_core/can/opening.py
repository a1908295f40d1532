# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Opens a bus by its name.

=====================================  ===========================================================
``can0``, ``vcan0``                    a CAN interface of the kernel (SocketCAN)
``udp_multicast[:239.x.y.z[:PORT]]``   between the processes of this host
``virtual:NAME``                       inside this process
``INTERFACE:CHANNEL[@BITRATE]``        any other adapter, by python-can, e.g.
                                       ``pcan:PCAN_USBBUS1@500000``
``auto``                               vcan0 when it exists and is up, else the multicast bus of
                                       this user and ROS domain
=====================================  ===========================================================
"""

from __future__ import annotations

from collections.abc import Iterator
import logging
import os
import socket

from ..exceptions import BusError
from .bus import Bus, open_virtual
from .multicast import check_group, DEFAULT_GROUP, DEFAULT_PORT, MulticastBus
from .socketcan import can_interfaces, SocketCanBus

AUTO = 'auto'
_AUTO_INTERFACE = 'vcan0'
_BUSES = 250  # as many as fit into the last byte of the group
_USERS = 10_000  # whose ports differ
_log = logging.getLogger(__name__)


def open_bus(name: str) -> Bus:
    """Open a bus by a name of the table; ``auto`` picks one, logs which, and takes its name.

    Raises:
        BusError: The interface does not exist or is down; the message names the remedy.
    """
    resolved = resolve_name(name)
    if resolved != name:
        _log.info('bus %s is %s', name, resolved)
    kind, colon, channel = resolved.partition(':')
    if kind == 'udp_multicast':
        return _open_multicast(resolved, channel)
    if not kind or (colon and not channel):
        raise BusError(f'no bus is called {name!r}; take can0, vcan0, udp_multicast or auto')
    if not colon:
        return SocketCanBus(resolved)
    if kind == 'virtual':
        return open_virtual(resolved, channel)
    return _open_adapter(resolved, kind, channel)


def resolve_name(name: str) -> str:
    """Return the name of the bus that :func:`open_bus` would open: ``name``, unless it is auto."""
    return next(auto_names()) if name == AUTO else name


def auto_names() -> Iterator[str]:
    """Yield the buses that ``auto`` may select: the first, then others for further robots."""
    interface = can_interfaces().get(_AUTO_INTERFACE)
    if interface is not None and interface.is_up and hasattr(socket, 'AF_CAN'):
        yield interface.name
    domain = os.environ.get('ROS_DOMAIN_ID', '')
    group = f'239.74.{int(domain) % 256 if domain.isdecimal() else 0}'
    # by its port each user of this host has buses of his own
    port = DEFAULT_PORT + os.getuid() % _USERS
    for number in range(2, 2 + _BUSES):
        yield f'udp_multicast:{group}.{number}:{port}'


def _open_multicast(name: str, channel: str) -> Bus:
    group, colon, digits = (channel or DEFAULT_GROUP).partition(':')
    if ':' in digits:
        group, colon = channel, ''  # an IPv6 address, to be refused as one
    check_group(name, group)
    if not colon:
        return MulticastBus(name, group, DEFAULT_PORT)
    if not digits.isdecimal() or not 0 < int(digits) < 0x10000:
        raise BusError(f'{name}: {digits!r} is no UDP port; take 1 to 65535')
    return MulticastBus(name, group, int(digits))


def _open_adapter(name: str, interface: str, channel: str) -> Bus:
    try:
        from .adapter import AdapterBus  # only here, python-can takes long to import
    except ImportError as error:
        raise BusError(f'{name} needs python-can ({error}); `pip install python-can`') from error
    channel, at, digits = channel.rpartition('@')
    if not at:
        return AdapterBus(name, interface, digits, None)
    if not digits.isdecimal() or not int(digits):
        raise BusError(f'{name}: {digits!r} is no bit rate in bit/s; e.g. 500000 or 1000000')
    return AdapterBus(name, interface, channel, int(digits))

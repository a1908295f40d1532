# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which CAN network interfaces this host has, and what to do when one is missing."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
import difflib
import fcntl
import re
import socket
import struct

# linux/sockios.h, net/if.h and net/if_arp.h
_SIOCGIFFLAGS = 0x8913
_SIOCGIFHWADDR = 0x8927
_SIOCGIFTXQLEN = 0x8942
_IFF_UP = 0x1
_ARPHRD_CAN = 280
_REQUEST = struct.Struct('16s24x')  # struct ifreq: name and a union
_USUAL_NAME = re.compile(r'[a-z]*can\d+')
_OTHER_BUSES = ('udp_multicast', 'auto')


@dataclass(frozen=True, slots=True)
class CanInterface:
    """A CAN network interface."""

    name: str  # e.g. ``can0``
    is_up: bool
    queue_length: int  # frames that its transmit queue holds


def can_interfaces() -> dict[str, CanInterface]:
    """Return the CAN interfaces of this network namespace by name."""
    found = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # it went away meanwhile
                if _request(probe, _SIOCGIFHWADDR, name, '=H') == _ARPHRD_CAN:
                    is_up = bool(_request(probe, _SIOCGIFFLAGS, name, '=H') & _IFF_UP)
                    queue_length = _request(probe, _SIOCGIFTXQLEN, name, '=i')
                    found[name] = CanInterface(name, is_up, queue_length)
    return found


def _request(probe: socket.socket, request: int, name: str, layout: str) -> int:
    answer = fcntl.ioctl(probe.fileno(), request, _REQUEST.pack(name.encode()))
    return int(struct.unpack_from(layout, answer, 16)[0])


def missing_interface_text(name: str, existing: dict[str, CanInterface]) -> str:
    """Explain that an interface does not exist: which do, how to make it, or a similar name."""
    have = ', '.join(sorted(existing)) or 'none'
    if not is_interface_name(name):
        close = difflib.get_close_matches(name, (*existing, 'can0', 'vcan0', *_OTHER_BUSES), n=1)
        meant = f' (is {close[0]!r} meant?)' if close else ''
        return (
            f'no bus is called {name!r}{meant}; CAN interfaces of this host: {have}; other buses: '
            f'{", ".join(_OTHER_BUSES)}, INTERFACE:CHANNEL of python-can'
        )
    if name.startswith('vcan'):
        remedy = f'`ip link add dev {name} type vcan && ip link set up {name}`'
    else:
        remedy = f'plug the adapter in, then {bring_up_text(name)}'
    return f'there is no CAN interface {name} (this host has: {have}); {remedy}'


def is_interface_name(name: str) -> bool:
    """Whether a name is one that CAN interfaces usually have: can0, vcan1, slcan0."""
    return bool(_USUAL_NAME.fullmatch(name))


def bring_up_text(name: str) -> str:
    """Return the command that switches an interface on."""
    if name.startswith('vcan'):
        return f'`ip link set up {name}`'
    return f'`ip link set up {name} type can bitrate 1000000` (with the bit rate of your bus)'

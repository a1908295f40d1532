# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network interfaces of this host, as the kernel reports them."""

from __future__ import annotations

import errno
import fcntl
import socket
import struct

_SIOCGIFFLAGS = 0x8913
_SIOCGIFADDR = 0x8915  # linux/sockios.h: the first IPv4 address of an interface
_IFREQ_SIZE = 40  # [byte] struct ifreq
_NAME_SIZE = 16  # [byte] IFNAMSIZ
_RUNNING = 0x40  # linux/if.h: IFF_RUNNING, what Fast DDS asks for
_ANY_PORT = 7400  # connecting a UDP socket sends nothing; the port does not matter


def read_interfaces() -> dict[str, str]:
    """Return the IPv4 address of each interface by its name; empty where it has none."""
    found = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for _, name in socket.if_nameindex():
            try:
                answer = fcntl.ioctl(probe, _SIOCGIFADDR, _request(name))
            except OSError as error:
                if error.errno not in {errno.EADDRNOTAVAIL, errno.ENODEV}:
                    raise
                found[name] = ''
                continue
            # struct sockaddr_in behind the name: family, port, address
            found[name] = socket.inet_ntoa(struct.unpack_from('4s', answer, _NAME_SIZE + 4)[0])
    return found


def has_link(name: str) -> bool:
    """Return whether an interface is operational: no cable is missing, no access point."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            answer = fcntl.ioctl(probe, _SIOCGIFFLAGS, _request(name))
        except OSError:  # it went meanwhile
            return False
    (flags,) = struct.unpack_from('H', answer, _NAME_SIZE)
    return bool(flags & _RUNNING)


def _request(name: str) -> bytes:
    return name.encode()[: _NAME_SIZE - 1].ljust(_IFREQ_SIZE, b'\0')


def resolve_host(name: str) -> str:
    """Return the IPv4 address of a host.

    Raises:
        OSError: Its name cannot be resolved.
    """
    return socket.gethostbyname(name)


def source_address(peer: str) -> str:
    """Return the address of this host from which packets to a peer leave.

    Raises:
        OSError: No route leads there.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect((peer, _ANY_PORT))
        return str(probe.getsockname()[0])

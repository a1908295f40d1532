# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Resolves the names that the user gives to interfaces and peers of DDS."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import errno
import fcntl
from pathlib import Path
import re
import socket
import struct

LOCALHOST_PROFILE = Path(__file__).with_name('dds_network_localhost.xml')
"""The profile with loopback only; all others are derived from it."""
PREFIX = 'dds_network_'  # how the file of every profile of this package begins

_SIOCGIFFLAGS = 0x8913
_SIOCGIFADDR = 0x8915  # linux/sockios.h: the first IPv4 address of an interface
_IFREQ_SIZE = 40  # [byte] struct ifreq
_NAME_SIZE = 16  # [byte] IFNAMSIZ
_RUNNING = 0x40  # linux/if.h: IFF_RUNNING, what Fast DDS asks for
_DOMAIN_PORT = 7400  # DDSI-RTPS 9.6.2.3: PB, DG and, in pairs of ports, d1
_PORTS = 250
_FIRST_PARTICIPANT = 5
_ANY_PORT = 7400  # connecting a UDP socket sends nothing; the port does not matter
_LOOPBACK = '127.'


class NetworkChoiceError(ValueError):
    """An interface or a peer does not exist, or its profile cannot be written."""


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


def participants_on_this_host(domain: int) -> int:
    """Return the number of DDS participants of a domain on this host, ROS or not.

    Counts the default ports for unicast discovery (DDSI-RTPS 9.6.2.3).
    """
    ports = range(_DOMAIN_PORT + domain * _PORTS, _DOMAIN_PORT + (domain + 1) * _PORTS, 2)
    lines = Path('/proc/net/udp').read_text().splitlines()[1:]
    bound = {int(line.split()[1].partition(':')[2], 16) for line in lines}
    return len(bound.intersection(ports[_FIRST_PARTICIPANT:]))


def has_link(name: str) -> bool:
    """Return whether an interface is operational: its cable or access point is connected."""
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


@dataclass(frozen=True, slots=True)
class Interface:
    """A network interface."""

    name: str  # its name, e.g. ``eth0``
    address: str  # its IPv4 address


@dataclass(frozen=True, slots=True)
class Reach:
    """Interfaces and peers that DDS uses besides loopback."""

    interfaces: tuple[Interface, ...] = ()  # interfaces on which its sockets receive
    # IPv4 addresses that it announces itself to, for networks without multicast
    peers: tuple[str, ...] = ()
    # names of interfaces that are left out, as they have no link or no address: Fast DDS does not
    # open them later, either
    without_link: tuple[str, ...] = ()
    # by what a person configures the transports himself; empty when he does not
    own_transports: str = ''

    @property
    def is_this_host(self) -> bool:
        """Whether only loopback is used."""
        return not self.interfaces and not self.own_transports

    def describe(self) -> str:
        """Describe what is open and the consequence."""
        if own := self.own_transports:
            return f'{own} decides which networks DDS uses; it may be open to all of them'
        left_out = ''.join(
            f'; {name} has no link or no address and is left out: connect it, and start again'
            for name in self.without_link
        )
        if self.is_this_host:
            return f'DDS stays on this host{left_out}'
        names = ', '.join(f'{each.name} ({each.address})' for each in self.interfaces)
        peers = f', announced to {", ".join(self.peers)}' if self.peers else ''
        return (
            f'DDS is open on {names}{peers}; it has no authentication: any client on this '
            f'network can command the robot{left_out}'
        )


def resolve_reach(
    text: str,
    interfaces: Mapping[str, str],
    resolve_host: Callable[[str], str] = resolve_host,
    source_address: Callable[[str], str] = source_address,
    has_link: Callable[[str], bool] = has_link,
) -> Reach:
    """Find the interfaces and peers that a text names.

    Args:
        text: Names of interfaces, and addresses or names of peers, separated by commas or blanks;
            empty or ``localhost`` for none.
        interfaces: IPv4 address of each interface of this host by name; empty if it has none.
        resolve_host: Returns the IPv4 address of a host name.
        source_address: Returns the address of this host on the route to a peer.
        has_link: Returns whether an interface is operational.

    Raises:
        NetworkChoiceError: There is no such interface or host, or no route to it.
    """
    opened: dict[str, Interface] = {}
    without_link: dict[str, None] = {}
    peers: dict[str, None] = {}
    names = {address: name for name, address in interfaces.items() if address}
    for word in filter(None, re.split(r'[,\s]+', text)):
        peer, address = '', interfaces.get(word)
        if address is None:
            address = _peer_address(word, interfaces, resolve_host)
            if address not in names and not address.startswith(_LOOPBACK):
                peer, address = address, _facing(word, address, source_address)
        if address.startswith(_LOOPBACK):
            continue
        name = word if word in interfaces else names.get(address)
        if name is None:
            raise NetworkChoiceError(
                f'packets to {word} leave from {address}, which is the address of no interface; '
                f'name the interface instead: {_available(interfaces)}'
            )
        if not address or not has_link(name):
            without_link[name] = None
            continue
        opened[name] = Interface(name, address)
        if peer:
            peers[peer] = None
    return Reach(tuple(opened.values()), tuple(peers), tuple(without_link))


def _peer_address(
    word: str, interfaces: Mapping[str, str], resolve_host: Callable[[str], str]
) -> str:
    try:
        return resolve_host(word)
    except (OSError, UnicodeError) as error:
        raise NetworkChoiceError(
            f'{word!r} is neither an interface with an IPv4 address nor a known host; '
            f'interfaces: {_available(interfaces)}'
        ) from error


def _facing(word: str, address: str, source_address: Callable[[str], str]) -> str:
    try:
        return source_address(address)
    except OSError as error:
        raise NetworkChoiceError(
            f'no route leads to {word} ({address}): {error.strerror or error}'
        ) from error


def _available(interfaces: Mapping[str, str]) -> str:
    outside = [
        name
        for name, address in interfaces.items()
        if address and not address.startswith(_LOOPBACK)
    ]
    return ', '.join(outside) or 'only loopback'

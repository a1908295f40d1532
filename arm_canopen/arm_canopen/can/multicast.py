# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A CAN bus between the processes of one host, in python-can's ``udp_multicast`` format.

Datagrams stay on the loopback interface. Each bus sends from a loopback address of its own, which
its own receiver blocks in the kernel, so an echo costs nothing and own frames are never received.
"""

from __future__ import annotations

from functools import lru_cache
import ipaddress
import random
import socket

from ..exceptions import BusError, CodecError
from .frame import Frame
from .multicast_format import decode, encode
from .socket_bus import ANCILLARY_SIZE, prepare_receiver, SocketBus

DEFAULT_GROUP = '239.74.163.2'
"""IPv4 group that python-can calls its default."""
DEFAULT_PORT = 43113
"""UDP port that python-can takes by default."""

_LOOPBACK = '127.0.0.1'
_IP_BLOCK_SOURCE = 38  # linux/in.h; Python's socket module does not name it
_DATAGRAM_MAX = 384  # [byte] classic frames have up to 164, and a channel's name
_SOURCE_PORT = 4313  # any fixed port: binding it fails when another bus has the address
_SOURCE_TRIES = 16


class MulticastBus(SocketBus):
    """A bus on a multicast group of the loopback interface."""

    def __init__(self, name: str, group: str, port: int) -> None:
        """Join the IPv4 multicast group at a UDP port.

        Raises:
            BusError: The sockets cannot be opened.
        """
        sender = _open_sender(name, group, port)
        try:
            receiver = _open_receiver(group, port, sender.getsockname()[0])
        except OSError as error:
            sender.close()
            raise _not_opened(name, error) from error
        super().__init__(name, receiver, sender)
        self._own_address = sender.getsockname()

    def _encode(self, frame: Frame) -> bytes:
        return encode(frame)

    def _read_one(self) -> Frame | None:
        datagram, ancillary, _, source = self._receiver.recvmsg(_DATAGRAM_MAX, ANCILLARY_SIZE)
        stamp = self._stamps.read(ancillary)
        if source == self._own_address or not _is_local(source[0]):
            return None
        try:
            return decode(datagram, stamp)
        except CodecError:
            self.counters.malformed += 1
            return None

    def _explain(self, error: OSError) -> BusError:
        return BusError(f'{self.name}: {error.strerror or error}')

    def close(self) -> None:
        """Leave the group."""
        super().close()
        self._sender.close()


def check_group(name: str, group: str) -> None:
    """Check the address of a multicast group.

    Args:
        name: Of the bus, as it was given.
        group: Its address.

    Raises:
        BusError: It is no IPv4 multicast address.
    """
    try:
        address = ipaddress.ip_address(group)
    except ValueError as error:
        raise BusError(
            f'{name}: {group!r} is no IP address; take one such as {DEFAULT_GROUP}'
        ) from error
    if address.version != 4:
        raise BusError(
            f'{name}: {group} is an IPv6 group; only IPv4 groups are kept on the loopback'
            f' interface, take one such as {DEFAULT_GROUP}'
        )
    if not address.is_multicast:
        raise BusError(
            f'{name}: {group} is no multicast address; those are 224.0.0.0 to 239.255.255.255'
        )


def _open_sender(name: str, group: str, port: int) -> socket.socket:
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        _bind_own_address(sender)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(_LOOPBACK))
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        # a member that blocks nobody: without one the kernel drops for the whole interface what
        # our receiver blocks, also for python-can, which is a member on another interface
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, _membership(group))
        sender.setblocking(False)
        sender.connect((group, port))
    except OSError as error:
        sender.close()
        raise _not_opened(name, error) from error
    return sender


def _bind_own_address(sender: socket.socket) -> None:
    """Bind to a loopback address that no other bus of this host has."""
    chosen = random.SystemRandom()
    for attempt in range(_SOURCE_TRIES + 1):
        # 127.1.0.0 to 127.254.255.255, so neither the usual addresses nor the broadcast
        address = ipaddress.IPv4Address(0x7F01_0000 + chosen.randrange(0xFE_0000))
        last = attempt == _SOURCE_TRIES  # somebody holds the port on all addresses
        try:
            sender.bind((str(address), 0 if last else _SOURCE_PORT))
        except OSError:
            if last:
                raise
        else:
            return


def _open_receiver(group: str, port: int, own_address: str) -> socket.socket:
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        prepare_receiver(receiver)
        # the group's own address, so that other groups on the same port do not arrive
        receiver.bind((group, port))
        receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, _membership(group))
        blocked = _membership(group) + socket.inet_aton(own_address)
        receiver.setsockopt(socket.IPPROTO_IP, _IP_BLOCK_SOURCE, blocked)
    except OSError:
        receiver.close()
        raise
    return receiver


def _membership(group: str) -> bytes:
    """Return the kernel's struct ip_mreq: the group on the loopback interface."""
    return socket.inet_aton(group) + socket.inet_aton(_LOOPBACK)


def _not_opened(name: str, error: OSError) -> BusError:
    return BusError(
        f'cannot open {name}: {error.strerror or error}; '
        'is the loopback interface up (`ip link set up lo`)?'
    )


@lru_cache(maxsize=256)
def _is_local(host: str) -> bool:
    """Return whether an address is one of this host's.

    python-can sends to the group through the default route, so its frames carry another address
    of this host, and those of other hosts may arrive with them.
    """
    if host.startswith('127.'):
        return True
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((host, 0))
        except OSError:
            return False
    return True

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A CAN bus between the processes of one host, in python-can's ``udp_multicast`` format.

Datagrams stay on the loopback interface. Each bus sends from a loopback address of its own, and
its receiver blocks that address in the kernel: a bus never receives its own frames, at no cost.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
import ipaddress
import random
import socket

import msgpack

from ..exceptions import BusError, CodecError
from .frame import checked, Frame, PAYLOAD_MAX, STANDARD_ID_MAX
from .socket_bus import datagram_reader, prepare_receiver, SocketBus, Source

_ENTRIES = 11
_MAP_HEADER = bytes((0x80 | _ENTRIES,))  # msgpack's of a map with fewer than 16 entries
_BINARY_HEADER = 2  # [byte] of msgpack before a short binary: kind and length


def _pack(value: object) -> bytes:
    return bytes(msgpack.packb(value))


def _entries(**entries: object) -> bytes:
    """Return the entries of a map without its header."""
    return _pack(entries)[len(_MAP_HEADER) :]


def _flags(is_extended: bool, is_remote: bool, is_error: bool) -> bytes:
    return _entries(
        is_extended_id=is_extended,
        is_remote_frame=is_remote,
        is_error_frame=is_error,
        channel=None,
    ) + _pack('dlc')


# the time is 0.0, because receivers stamp for themselves
_HEAD = _MAP_HEADER + _entries(timestamp=0.0) + _pack('arbitration_id')
_LENGTHS = tuple(
    _pack(size) + _pack('data') + _pack(bytes(size))[:_BINARY_HEADER]
    for size in range(PAYLOAD_MAX + 1)
)
"""Length code, key and header of the payload, by its length in [byte]."""
_TAIL = _entries(is_fd=False, bitrate_switch=False, error_state_indicator=False)
_PLAIN_FLAGS = _flags(is_extended=False, is_remote=False, is_error=False)
_LAYOUT = (_HEAD, _PLAIN_FLAGS, _LENGTHS[0][1:-1], _TAIL)  # for the compiled reader
_PLAIN_HEADS = tuple(_HEAD + _pack(can_id) + _PLAIN_FLAGS for can_id in range(STANDARD_ID_MAX + 1))
"""All bytes before the length of a data frame, by its 11-bit identifier."""


def encode(frame: Frame) -> bytes:
    """Return the datagram of a frame."""
    can_id, data, _, is_extended, is_remote, is_error, remote_length = checked(frame)
    if is_extended or is_remote or is_error:
        head = _HEAD + _pack(can_id) + _flags(is_extended, is_remote, is_error)
    else:
        head = _PLAIN_HEADS[can_id]
    length = _LENGTHS[len(data)]
    if remote_length:
        length = _pack(remote_length) + length[1:]
    return b''.join((head, length, data, _TAIL))


def decode(datagram: bytes, timestamp: float) -> Frame:
    """Decode a datagram received at a steady time in [s]; the time inside is the sender's."""
    try:
        fields = msgpack.unpackb(datagram, raw=False)
    except (ValueError, TypeError) as error:
        raise CodecError(f'datagram of {len(datagram)} bytes is no msgpack: {error}') from error
    if not isinstance(fields, dict):
        raise CodecError(f'datagram holds a {type(fields).__name__}, not the map of a CAN frame')
    if _flag(fields, 'is_fd', default=False):
        raise CodecError('CAN FD frames are not supported')
    is_extended = _flag(fields, 'is_extended_id', default=True)
    is_remote = _flag(fields, 'is_remote_frame', default=False)
    can_id = fields.get('arbitration_id', 0)
    data = fields.get('data') or b''
    if type(can_id) is not int or not isinstance(data, bytes):
        raise CodecError(f'CAN frame with identifier {can_id!r} and payload {data!r}')
    is_error = _flag(fields, 'is_error_frame', default=False)
    data = b'' if is_remote else data
    length = (fields.get('dlc') or 0) if is_remote else 0
    if type(length) is not int:
        raise CodecError(f'remote request of {length!r} bytes')
    try:
        return checked(Frame(can_id, data, timestamp, is_extended, is_remote, is_error, length))
    except ValueError as error:
        raise CodecError(str(error)) from error


def _flag(fields: Mapping[object, object], name: str, *, default: bool) -> bool:
    """Return a flag of the map; the defaults are those of python-can's message."""
    value = fields.get(name, default)
    if not isinstance(value, bool):
        raise CodecError(f'{name} of a CAN frame is {value!r}, not true or false')
    return value


DEFAULT_GROUP = '239.74.163.2'
"""Default IPv4 group of python-can."""
DEFAULT_PORT = 43113
"""Default UDP port of python-can."""

_LOOPBACK = '127.0.0.1'
_IP_BLOCK_SOURCE = 38  # linux/in.h; Python's socket module does not name it
_SOURCE_PORT = 4313  # any fixed port: binding it fails when another bus has the address
_SOURCE_TRIES = 16


class MulticastBus(SocketBus):
    """A bus on a multicast group of the loopback interface."""

    def __init__(self, name: str, group: str, port: int) -> None:
        """Join the IPv4 multicast group at a UDP port."""
        sender = _open_sender(name, group, port)
        try:
            receiver = _open_receiver(group, port, sender.getsockname()[0])
        except OSError as error:
            sender.close()
            raise _not_opened(name, error) from error
        self._own_address: Source = sender.getsockname()
        super().__init__(name, receiver, sender, datagram_reader(_LAYOUT, self._own_address))

    def _encode(self, frame: Frame) -> bytes:
        return encode(frame)

    def _decode(self, datagram: bytes, stamp: float, source: Source) -> Frame | None:
        if source == self._own_address or not _is_local(source[0]):
            return None
        try:
            return decode(datagram, stamp)
        except CodecError:
            self.counters.malformed += 1
            return None

    def _explain(self, error: OSError) -> BusError:
        return BusError(f'{self.name}: {error.strerror or error}')


def check_group(name: str, group: str) -> None:
    """Check that the group of a bus is an IPv4 multicast address; else raise BusError."""
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
        # a member that blocks no source: without one the kernel drops for the whole interface what
        # our receiver blocks, also for python-can, which is a member on another interface
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, _membership(group))
        sender.setblocking(False)
        sender.connect((group, port))
    except OSError as error:
        sender.close()
        raise _not_opened(name, error) from error
    return sender


def _bind_own_address(sender: socket.socket) -> None:
    """Bind to a loopback address that no other bus of this host uses."""
    chosen = random.SystemRandom()
    for attempt in range(_SOURCE_TRIES + 1):
        # 127.1.0.0 to 127.254.255.255, so neither the usual addresses nor the broadcast
        address = ipaddress.IPv4Address(0x7F01_0000 + chosen.randrange(0xFE_0000))
        last = attempt == _SOURCE_TRIES  # another program holds the port on all addresses
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

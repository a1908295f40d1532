# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CAN interfaces of the Linux kernel (SocketCAN): a list of them, and a bus on a raw socket.

Other sockets of this host receive the sent frames; the sending bus itself does not.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
import difflib
import errno
import fcntl
import logging
import re
import socket
import struct

from ..exceptions import BusError
from .frame import checked, EXTENDED_ID_MAX, Frame, STANDARD_ID_MAX
from .socket_bus import datagram_reader, prepare_receiver, SocketBus, Source

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
    """Explain that an interface is missing: which exist, how to create it, or a similar name."""
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
    """Whether a name looks like a CAN interface: can0, vcan1, slcan0."""
    return bool(_USUAL_NAME.fullmatch(name))


def bring_up_text(name: str) -> str:
    """Return the command that brings an interface up."""
    if name.startswith('vcan'):
        return f'`ip link set up {name}`'
    return f'`ip link set up {name} type can bitrate 1000000` (with the bit rate of your bus)'


# linux/can.h and linux/can/raw.h
_SOL_CAN_RAW = 101
_CAN_RAW_ERR_FILTER = 2
_EXTENDED_FLAG = 0x8000_0000
_REMOTE_FLAG = 0x4000_0000
_ERROR_FLAG = 0x2000_0000
_ANY_FLAG = _EXTENDED_FLAG | _REMOTE_FLAG | _ERROR_FLAG
_ERROR_CLASSES = 0x1FFF_FFFF
_FRAME = struct.Struct('=IB3x8s')  # struct can_frame: identifier with flags, length, payload

_QUEUE_LENGTH_MIN = 100  # frames; the kernel's default of 10 is less than one cycle of an arm
_QUEUED_FRAME = 1024  # [byte] that the kernel counts for one, 768 to 960 by its version
_log = logging.getLogger(__name__)


class SocketCanBus(SocketBus):
    """A bus on a CAN network interface."""

    def __init__(self, name: str) -> None:
        """Open a raw socket on the interface."""
        receiver = _open_socket(name)
        super().__init__(name, receiver, receiver, datagram_reader())
        self._queue_limit = 0
        self._gone = False

    def _receive(self, timeout: float) -> list[Frame]:
        """Wait for frames; reopen a removed interface when it is back."""
        if self._gone:
            self._reopen()
        return super()._receive(timeout)

    def _encode(self, frame: Frame) -> bytes:
        return pack(frame)

    def limit_queue(self, frames: int) -> None:
        """Limit the transmit queue; see :meth:`Bus.limit_queue`."""
        with self._send_lock:
            self._queue_limit = frames
            _limit_sending(self._receiver, frames)

    def _decode(self, datagram: bytes, stamp: float, source: Source) -> Frame | None:
        if len(datagram) != _FRAME.size:
            self.counters.malformed += 1
            return None
        return unpack(datagram, stamp)

    def _reopen(self) -> None:
        receiver = _open_socket(self.name)
        with self._send_lock:
            if self._queue_limit:
                _limit_sending(receiver, self._queue_limit)
            old, self._receiver, self._sender = self._receiver, receiver, receiver
            self._gone = False
        old.close()
        (self._reader or self._stamps).reopened()
        _log.warning('%s is back', self.name)  # as loud as its going was

    def _explain(self, error: OSError) -> BusError:
        # the socket of an interface that was removed stays deaf when another of its name comes
        self._gone = self._gone or error.errno in {errno.ENODEV, errno.ENXIO}
        return BusError(failure_text(self.name, error))


def pack(frame: Frame) -> bytes:
    """Return the kernel's struct can_frame."""
    if frame.is_error:
        raise ValueError('an error frame is made by the controller and cannot be sent')
    can_id, data = checked(frame)[:2]
    if frame.is_extended:
        can_id |= _EXTENDED_FLAG
    if frame.is_remote:
        can_id |= _REMOTE_FLAG
    return _FRAME.pack(can_id, frame.remote_length or len(data), data)


def unpack(packed: bytes, timestamp: float) -> Frame:
    """Read the kernel's struct can_frame of 16 bytes, received at a steady time in [s]."""
    can_id, length, data = _FRAME.unpack(packed)
    data = data[:length]
    if not can_id & _ANY_FLAG:
        return Frame(can_id, data, timestamp)
    if can_id & _ERROR_FLAG:
        return Frame(can_id & _ERROR_CLASSES, data, timestamp, is_error=True)
    is_extended, is_remote = bool(can_id & _EXTENDED_FLAG), bool(can_id & _REMOTE_FLAG)
    can_id &= EXTENDED_ID_MAX if is_extended else STANDARD_ID_MAX
    if is_remote:
        return Frame(can_id, b'', timestamp, is_extended, is_remote, remote_length=len(data))
    return Frame(can_id, data, timestamp, is_extended)


def _open_socket(name: str) -> socket.socket:
    if not hasattr(socket, 'AF_CAN'):
        raise BusError(f'this Python was built without CAN, so {name} cannot be opened')
    try:
        raw = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    except OSError as error:
        if not is_interface_name(name):  # a slip, and no kernel would help
            raise BusError(missing_interface_text(name, can_interfaces())) from error
        raise BusError(no_can_text(name, error)) from error
    try:
        _check_interface(name)
        prepare_receiver(raw)
        raw.setsockopt(_SOL_CAN_RAW, _CAN_RAW_ERR_FILTER, _ERROR_CLASSES)
        raw.bind((name,))
    except BusError:
        raw.close()
        raise
    except OSError as error:
        raw.close()
        raise BusError(failure_text(name, error)) from error
    return raw


def _limit_sending(sock: socket.socket, frames: int) -> None:
    # the kernel doubles the size for its own bookkeeping
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, frames * _QUEUED_FRAME // 2)


def _check_interface(name: str) -> None:
    existing = can_interfaces()
    interface = existing.get(name)
    if interface is None:
        raise BusError(missing_interface_text(name, existing))
    if not interface.is_up:
        raise BusError(f'CAN interface {name} is down; {bring_up_text(name)}')
    if interface.queue_length < _QUEUE_LENGTH_MIN:
        _log.warning(
            '%s queues only %d frames, fewer than an arm sends in a cycle; '
            '`ip link set %s txqueuelen 1000`',
            name,
            interface.queue_length,
            name,
        )


def no_can_text(name: str, error: OSError) -> str:
    """Explain that the kernel has no CAN support, and which buses work without it."""
    return (
        f'this kernel has no CAN, so {name} cannot be opened ({error.strerror or error}); '
        'try `modprobe can_raw`, or take the bus udp_multicast, which needs no kernel support'
    )


def failure_text(name: str, error: OSError) -> str:
    """Explain what a failed system call on an open interface means, and the remedy."""
    if error.errno == errno.ENETDOWN:
        return f'CAN interface {name} is down; {bring_up_text(name)}'
    if error.errno in (errno.ENODEV, errno.ENXIO):
        return f'CAN interface {name} is gone; plug the adapter in again and reopen the bus'
    if error.errno in (errno.ENOBUFS, errno.EAGAIN):
        return (
            f'the transmit queue of {name} is full; either frames are sent faster than the bus '
            f'carries them (`ip link set {name} txqueuelen 1000` absorbs bursts), or no device '
            'acknowledges them (cable, bit rate, termination, device switched off)'
        )
    return f'{name}: {error.strerror or error}'

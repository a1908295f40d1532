# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Asking the DDS participants of this host to announce themselves again, at once.

A participant that starts announces itself, and the others answer within half a millisecond. Fast
DDS 2.14 drops these answers, because it registers its receivers only after its announcement; the
others speak again by themselves up to 3 s later. (Seen in 7 of 10 starts on two cores; the same
delay makes `ros2 node list` come out empty now and then.)

The cure is in the protocol: a new participant is answered by those that discover it. So once ours
listens, a message from a short-lived participant that exists only in these bytes, and that has our
address, makes all of them answer to us. It is taken back as soon as discovery is complete, and
its lease ends after a second in any case. DDSI-RTPS 2.2: SPDP 8.5.3, message 8.3, parameters
9.6.2.2, encapsulation 10.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
import os
import socket
import struct

from .participants import DiscoveryPorts

_LOOPBACK = '127.0.0.1'
_LEASE = 1  # [s]
_PREFIX_SIZE = 12  # [byte]

_HEADER = b'RTPS' + bytes((2, 2)) + bytes((0, 0))  # protocol 2.2, vendor unknown
_PARTICIPANT = bytes.fromhex('000001c1')  # ENTITYID_PARTICIPANT
_WRITER = bytes.fromhex('000100c2')  # ENTITYID_SPDP_BUILTIN_PARTICIPANT_WRITER
_READER = bytes.fromhex('000100c7')  # ENTITYID_SPDP_BUILTIN_PARTICIPANT_READER

_DATA = 0x15
_LITTLE_ENDIAN, _INLINE_QOS, _WITH_DATA, _WITH_KEY = 0x01, 0x02, 0x04, 0x08
_TO_INLINE_QOS = 16  # [byte] behind octetsToInlineQos itself
_PL_CDR_LE = bytes((0, 3, 0, 0))
_LOCATOR_KIND_UDPV4 = 1

_PID_SENTINEL = 0x0001
_PID_LEASE_DURATION = 0x0002
_PID_PROTOCOL_VERSION = 0x0015
_PID_VENDOR_ID = 0x0016
_PID_DEFAULT_UNICAST_LOCATOR = 0x0031
_PID_METATRAFFIC_UNICAST_LOCATOR = 0x0032
_PID_PARTICIPANT_GUID = 0x0050
_PID_BUILTIN_ENDPOINT_SET = 0x0058
_PID_KEY_HASH = 0x0070
_PID_STATUS_INFO = 0x0071

_ANNOUNCER_AND_DETECTOR = 0x0003  # of participants; no other builtin endpoint
_DISPOSED_AND_UNREGISTERED = bytes((0, 0, 0, 3))


@dataclass(frozen=True, slots=True)
class ProbeParticipant:
    """A participant that exists only in its messages.

    Attributes:
        prefix: Its GUID prefix, 12 bytes.
        port: The discovery port where answers to it are wanted.
    """

    prefix: bytes
    port: int

    @property
    def guid(self) -> bytes:
        """Its GUID, 16 bytes."""
        return self.prefix + _PARTICIPANT

    def announcement(self) -> bytes:
        """The RTPS message that announces it."""
        locator = struct.pack('<iI', _LOCATOR_KIND_UDPV4, self.port) + _ipv4(_LOOPBACK)
        parameters = (
            _parameter(_PID_PROTOCOL_VERSION, bytes((2, 2, 0, 0))),
            _parameter(_PID_VENDOR_ID, bytes(4)),
            _parameter(_PID_PARTICIPANT_GUID, self.guid),
            _parameter(_PID_BUILTIN_ENDPOINT_SET, struct.pack('<I', _ANNOUNCER_AND_DETECTOR)),
            _parameter(_PID_METATRAFFIC_UNICAST_LOCATOR, locator),
            _parameter(_PID_DEFAULT_UNICAST_LOCATOR, locator),
            _parameter(_PID_LEASE_DURATION, struct.pack('<iI', _LEASE, 0)),
        )
        return self._message(1, _WITH_DATA, b'', _PL_CDR_LE + _list(parameters))

    def disposal(self) -> bytes:
        """The RTPS message that disposes it."""
        inline = _list(
            (
                _parameter(_PID_KEY_HASH, self.guid),
                _parameter(_PID_STATUS_INFO, _DISPOSED_AND_UNREGISTERED),
            )
        )
        key = _PL_CDR_LE + _list((_parameter(_PID_PARTICIPANT_GUID, self.guid),))
        return self._message(2, _INLINE_QOS | _WITH_KEY, inline, key)

    def _message(self, number: int, flags: int, inline: bytes, payload: bytes) -> bytes:
        data = (
            struct.pack('<HH', 0, _TO_INLINE_QOS)
            + _READER
            + _WRITER
            + struct.pack('<iI', 0, number)
            + inline
            + payload
        )
        head = struct.pack('<BBH', _DATA, _LITTLE_ENDIAN | flags, len(data))
        return _HEADER + self.prefix + head + data


def _parameter(identifier: int, value: bytes) -> bytes:
    return struct.pack('<HH', identifier, len(value)) + value


def _list(parameters: tuple[bytes, ...]) -> bytes:
    return b''.join(parameters) + struct.pack('<HH', _PID_SENTINEL, 0)


def _ipv4(address: str) -> bytes:
    """An IPv4 address in the 16 bytes of a locator."""
    return bytes(12) + socket.inet_aton(address)


class Inquiry:
    """Makes participants announce themselves, and takes its announcement back in the end."""

    def __init__(self) -> None:
        """Send nothing yet."""
        self._sent: list[tuple[ProbeParticipant, frozenset[int]]] = []

    def send(self, ports: DiscoveryPorts) -> None:
        """Announce a participant on this host; the answers go to our own participant.

        Args:
            ports: Where all of them listen.
        """
        for own in sorted(ports.own)[:1]:
            probe = ProbeParticipant(os.urandom(_PREFIX_SIZE), own)
            self._sent.append((probe, ports.others))
            _send(probe.announcement(), ports.others)

    def close(self) -> None:
        """Let everybody forget the participant."""
        for probe, ports in self._sent:
            _send(probe.disposal(), ports)
        self._sent.clear()


def _send(message: bytes, ports: frozenset[int]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for port in ports:
            with contextlib.suppress(OSError):  # who is gone needs not answer
                sender.sendto(message, (_LOOPBACK, port))

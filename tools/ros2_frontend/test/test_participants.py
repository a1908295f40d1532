# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Counting participants: the kernel's table, and a question to them."""

from __future__ import annotations

import os
import socket
import struct

from hypothesis import given
from hypothesis import strategies as st

from ros2_frontend.ros.participants import DiscoveryPorts, parse_ports, read_ports
from ros2_frontend.ros.spdp import Inquiry, ProbeParticipant

HEAD = (
    '   sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout'
)
LINE = '  1: 00000000:{port:04X} 00000000:0000 07 00000000:00000000 00:00000000 0 0 0 {inode} 2'


def table(ports: dict[int, int]) -> list[str]:
    """Write the kernel's table for sockets: port to inode."""
    return [HEAD, *(LINE.format(port=p, inode=i) for p, i in ports.items())]


@given(st.integers(0, 231), st.sets(st.integers(0, 119), max_size=5))
def test_every_participant_has_one_port(domain: int, participants: set[int]) -> None:
    """Port 7410 + 250 domain + 2 participant; all others are of something else."""
    start = 7400 + 250 * domain
    discovery = {start + 10 + 2 * index for index in participants}
    noise = {start, start + 1, *(port + 1 for port in discovery), 53}
    lines = table({port: 1000 + port for port in sorted(discovery | noise)})
    own = frozenset(str(1000 + port) for port in sorted(discovery)[:1])
    found = parse_ports(lines, domain, own)
    assert found.own | found.others == discovery
    assert len(found.own) == len(own)
    assert found.count == len(found.own) + len(found.others)


def test_own_sockets_are_distinguished() -> None:
    """A port that this process binds counts as its own."""
    domain = 101  # the last one that nobody's test reserves
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bound:
        for index in range(60, 120):
            try:
                bound.bind(('127.0.0.1', 7410 + 250 * domain + 2 * index))
            except OSError:
                continue
            break
        assert bound.getsockname()[1] in read_ports(domain).own


def parameters(data: bytes) -> dict[int, bytes]:
    """Read a parameter list (DDSI-RTPS 2.2, 9.4.2.11) by identifier."""
    found: dict[int, bytes] = {}
    position = 0
    while True:
        identifier, length = struct.unpack_from('<HH', data, position)
        if identifier == 1:
            return found
        found[identifier] = data[position + 4 : position + 4 + length]
        position += 4 + length


@given(st.binary(min_size=12, max_size=12), st.integers(1, 2**16 - 1))
def test_announcement_is_well_formed(prefix: bytes, port: int) -> None:
    """Header, one DATA of the right length, GUID, and the address where answers go."""
    probe = ProbeParticipant(prefix, port)
    message = probe.announcement()
    assert message[:6] == b'RTPS\x02\x02'
    assert message[8:20] == prefix
    kind, flags, length = struct.unpack_from('<BBH', message, 20)
    assert (kind, flags, length) == (0x15, 0x05, len(message) - 24)
    payload = message[24 + 20 :]
    assert payload[:4] == b'\x00\x03\x00\x00'
    fields = parameters(payload[4:])
    assert fields[0x50] == probe.guid
    kind_, port_ = struct.unpack_from('<iI', fields[0x32])
    assert (kind_, port_, fields[0x32][-4:]) == (1, port, bytes((127, 0, 0, 1)))
    assert all(len(value) % 4 == 0 for value in fields.values())


def test_disposal_names_the_same_participant() -> None:
    """Status disposed and unregistered, with the key of the announcement."""
    probe = ProbeParticipant(bytes(range(12)), 7410)
    message = probe.disposal()
    inline = parameters(message[24 + 20 :])
    assert inline[0x70] == probe.guid
    assert inline[0x71] == bytes((0, 0, 0, 3))


def test_an_inquiry_reaches_all_others_and_is_taken_back() -> None:
    """Each other port gets an announcement, and in the end the disposal of the same GUID."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as two,
    ):
        for receiver in (one, two):
            receiver.bind(('127.0.0.1', 0))
            receiver.settimeout(5.0)
        others = frozenset(receiver.getsockname()[1] for receiver in (one, two))
        inquiry = Inquiry()
        inquiry.send(DiscoveryPorts(frozenset({7410}), others))
        announced = [receiver.recv(1000) for receiver in (one, two)]
        inquiry.close()
        closed = [receiver.recv(1000) for receiver in (one, two)]
    assert announced[0] == announced[1]
    assert closed[0][8:20] == announced[0][8:20]
    assert closed[0][21] & 0x08  # with the key, not with data


def test_nothing_is_sent_without_a_port_of_our_own() -> None:
    """Without procfs there is nowhere to answer to."""
    inquiry = Inquiry()
    inquiry.send(DiscoveryPorts(frozenset(), frozenset({os.getpid() % 1000 + 1})))
    inquiry.close()

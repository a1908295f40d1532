# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A program on a simulated bus, and one that attacks it from elsewhere.

``listen NAME ADDRESS`` prints each frame of a bus, and sends one now and then; a socket beside it
is a member of the group on the interface with this address, as python-can's own tools are.
``attack GROUP PORT ADDRESS TARGET`` sends frames of 0x666 to the group from an address, and to the
target.
"""

from __future__ import annotations

import socket
import sys
import time

from canopen_core.can import Frame, open_bus
from canopen_core.can.multicast import encode

PERIOD = 0.05  # [s]


def listen(name: str, address: str) -> None:
    """Print what is received, until it is ended."""
    _, group, port = name.split(':')
    member = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    member.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    member.bind(('', int(port)))
    membership = socket.inet_aton(group) + socket.inet_aton(address)
    member.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    with open_bus(name) as bus:
        print('open', flush=True)  # noqa: T201
        while True:
            bus.send(Frame(0x080, b''))
            for frame in bus.receive(PERIOD):
                print(f'{frame.can_id:03X}', flush=True)  # noqa: T201


def attack(group: str, port: str, address: str, target: str) -> None:
    """Send frames until it is ended."""
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 8)
    datagram = encode(Frame(0x666, b'\1'))
    for number in range(1_000_000):
        for host in (group, target):
            sender.sendto(datagram, (host, int(port)))
        if number == 20:
            print('sent', flush=True)  # noqa: T201
        time.sleep(PERIOD / 5)


if __name__ == '__main__':
    if sys.argv[1] == 'listen':
        listen(*sys.argv[2:])
    else:
        attack(*sys.argv[2:])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Datagrams across a link, one program at each end.

``echo ADDRESS`` sends back what it receives, also by the group; ``ask ADDRESS TARGET COUNT WAIT``
asks so many times, from an address, and prints how many answers came until there was none for WAIT
seconds, and the time of the quickest one.
"""

from __future__ import annotations

import json
import math
import socket
import sys
import time

PORT = 7447
GROUP = '239.74.0.9'
GAP = 0.001  # [s] between two questions


def echo(address: str) -> None:
    """Answer whoever asks, until it is ended."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.bind(('', PORT))
        membership = socket.inet_aton(GROUP) + socket.inet_aton(address)
        own.setsockopt(socket.SOL_IP, socket.IP_ADD_MEMBERSHIP, membership)
        sys.stdout.write('open\n')
        sys.stdout.flush()
        while True:
            text, sender = own.recvfrom(64)
            own.sendto(text, sender)


def ask(address: str, target: str, count: int, timeout: float) -> None:
    """Ask, and print what came back."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.setsockopt(socket.SOL_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
        own.settimeout(timeout)
        for _ in range(count):
            own.sendto(repr(time.monotonic()).encode(), (target, PORT))
            time.sleep(GAP)
        times: list[float] = []
        try:
            while len(times) < count:
                sent = float(own.recv(64))
                times.append(time.monotonic() - sent)
        except TimeoutError:
            pass
        quickest = min(times, default=math.nan)
        sys.stdout.write(json.dumps({'answers': len(times), 'quickest': quickest}) + '\n')


def main() -> None:
    """Do what the command line says."""
    kind, address, *rest = sys.argv[1:]
    if kind == 'echo':
        echo(address)
    else:
        ask(address, rest[0], int(rest[1]), float(rest[2]))


if __name__ == '__main__':
    main()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bus names for tests that nobody else on this host uses."""

from __future__ import annotations

import itertools
import os
import socket

_counter = itertools.count()


def free_multicast() -> str:
    """Return the name of a multicast bus of one's own, from the process id and a bind probe."""
    while True:
        number = next(_counter)
        group = f'239.{64 + (os.getpid() >> 8) % 64}.{os.getpid() & 0xFF}.{number % 250 + 1}'
        port = 20000 + (os.getpid() * 7 + number) % 8000
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind((group, port))  # without SO_REUSEADDR, so only when nobody has it
            except OSError:
                continue
        return f'udp_multicast:{group}:{port}'


def free_virtual() -> str:
    """Return the name of an in-process bus of one's own."""
    return f'virtual:test-{next(_counter)}'

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Buses that nobody else on this host uses, and frames that are waited for with a deadline."""

from __future__ import annotations

import itertools
import os
import socket
from time import monotonic

from canopen_core.can import Bus, Frame

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


DEADLINE = 20.0  # [s] longer than any machine is ever late


def receive_count(bus: Bus, count: int, deadline: float = DEADLINE) -> list[Frame]:
    """Receive until there are so many frames, or the deadline in [s] is over."""
    frames: list[Frame] = []
    end = monotonic() + deadline
    while len(frames) < count and (left := end - monotonic()) > 0.0:
        frames += bus.receive(left)
    return frames


def unstamped(frames: list[Frame]) -> list[Frame]:
    """Return the frames without their time stamps, to be compared with those sent."""
    return [frame._replace(timestamp=0.0) for frame in frames]

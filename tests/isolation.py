# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps tests and benchmarks of one machine out of each other's way."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import os
import socket


@dataclass(frozen=True)
class Isolation:
    """What keeps a test's processes to themselves.

    Attributes:
        domain_id: A ROS domain that no other test of this machine uses at the moment.
        bus: Name of a CAN bus of the same kind.
    """

    domain_id: int
    bus: str

    @property
    def env(self) -> dict[str, str]:
        """Environment for the test's processes."""
        return os.environ | {
            'ROS_DOMAIN_ID': str(self.domain_id),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST',
            'PYTHONUNBUFFERED': '1',
        }


@contextmanager
def reserve() -> Iterator[Isolation]:
    """Reserve a ROS domain and a CAN bus, also against a suite side by side."""
    with socket.socket() as reservation:
        for domain_id in range(1, 101):  # above, DDS ports run into the ephemeral ones
            try:
                reservation.bind(('127.0.0.1', 24500 + domain_id))
            except OSError:
                continue
            yield Isolation(domain_id, f'udp_multicast:239.74.{domain_id}.2:{43200 + domain_id}')
            return
    raise RuntimeError('all ROS domains are taken; do tests of this machine hang?')

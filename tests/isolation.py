# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps tests and benchmarks of one machine out of each other's way."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import gc
import itertools
import os
import socket
from tempfile import TemporaryDirectory

import psutil

from dds_network import restrict_dds

DOMAINS = 100  # above, DDS ports run into the ephemeral ones
RESERVATIONS = 24500  # a TCP port for each domain; who holds it has the domain

_turn = itertools.count(37 * os.getpid())  # far from other workers, whose ids are next to it
_logs = TemporaryDirectory(prefix='ros_logs_')  # and what black boxes write


@dataclass(frozen=True)
class Isolation:
    """What keeps a test's processes to themselves."""

    domain_id: int  # a ROS domain that no other test of this machine uses at the moment

    @property
    def bus(self) -> str:
        """Name of a CAN bus of the same kind."""
        return f'udp_multicast:239.74.{self.domain_id}.2:{43200 + self.domain_id}'

    @property
    def second_bus(self) -> str:
        """Name of another one."""
        return f'udp_multicast:239.74.{self.domain_id}.3:{43300 + self.domain_id}'

    @property
    def env(self) -> dict[str, str]:
        """Environment for the test's processes; bring-ups have no page in it."""
        own = {
            'ROS_DOMAIN_ID': str(self.domain_id),
            'PYTHONUNBUFFERED': '1',
            'PYTHONFAULTHANDLER': '1',  # by SIGABRT it says what its threads are doing
            'NO_VIEW': '1',
            'ROS_LOG_DIR': _logs.name,
        }
        env = os.environ | own
        restrict_dds(env)
        return env


def _is_in(domain_id: int) -> bool:
    """Return whether this process has a participant of DDS in a domain."""
    port = 7400 + 250 * domain_id  # it listens there for others (RTPS 2.5, 9.6.1.1)
    return any(each.laddr[1] == port for each in psutil.Process().net_connections('udp'))


@contextmanager
def reserve() -> Iterator[Isolation]:
    """Reserve a ROS domain and a CAN bus, against all processes of this machine that do the same.

    A domain is used again as late as possible: the nodes of a test that was killed are still
    discovered in its domain.

    Raises:
        RuntimeError: Every domain is reserved, or this process has not left the one it had.
    """
    with socket.socket() as reservation:
        for _ in range(DOMAINS):
            domain_id = 1 + next(_turn) % DOMAINS
            try:
                reservation.bind(('127.0.0.1', RESERVATIONS + domain_id))
            except OSError:
                continue
            yield Isolation(domain_id)
            if _is_in(domain_id):
                gc.collect()
                if _is_in(domain_id):
                    raise RuntimeError(
                        f'nodes of this process are left in domain {domain_id}, of an executor '
                        'that is not shut down, an action that is not destroyed, or a failed test'
                    )
            return
    raise RuntimeError('all ROS domains are taken; do tests of this machine hang?')

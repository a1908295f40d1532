# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Makes one pytest run over all packages possible.

In importlib mode pytest names a test `<folder>.test.<file>`; when nothing of the name `<folder>`
is imported yet, it registers the folder as an empty namespace. A colcon package's folder has the
name of the Python package inside it, which would then be hidden; so the real ones come first.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import importlib
import os
from pathlib import Path
import socket

import pytest

for _marker in Path(__file__).parent.glob('*/resource/*'):
    if (_marker.parents[1] / _marker.name / '__init__.py').is_file():
        importlib.import_module(_marker.name)


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


@pytest.fixture
def isolation() -> Iterator[Isolation]:
    """Give a test a ROS domain and a CAN bus of its own."""
    with reserve() as isolation:
        yield isolation

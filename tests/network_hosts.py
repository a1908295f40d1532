# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Two hosts with a cable between them, as network namespaces of this machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import ipaddress
import os
from pathlib import Path
import shutil
import subprocess
import uuid

from processes import RunningProcess
import pytest

# each host has its own shared memory, as machines have
_OWN_MEMORY = 'mount -t tmpfs tmpfs /dev/shm && exec "$@"'


@dataclass(frozen=True, slots=True)
class Host:
    """One of the two.

    Attributes:
        namespace: Its network namespace.
        interface: Its end of the cable.
        address: Its IPv4 address there.
    """

    namespace: str
    interface: str
    address: str

    def run(self, arguments: Sequence[str], env: Mapping[str, str]) -> RunningProcess:
        """Start a program on this host; it shares memory with what it starts."""
        inside = ['sh', '-c', _OWN_MEMORY, 'sh', *arguments]
        return RunningProcess(['ip', 'netns', 'exec', self.namespace, *inside], env)

    def set_link(self, state: str) -> None:
        """Set its end of the cable ``up`` or ``down``."""
        _ip('-n', self.namespace, 'link', 'set', self.interface, state)

    def udp_addresses(self) -> set[str]:
        """Return the local addresses of all UDP sockets of this host."""
        table = _ip('netns', 'exec', self.namespace, 'cat', '/proc/net/udp')
        words = (line.split()[1].partition(':')[0] for line in table.splitlines()[1:])
        return {str(ipaddress.IPv4Address(bytes.fromhex(word)[::-1])) for word in words}

    def packets(self) -> tuple[int, int]:
        """Return how many packets its end of the cable has received and sent."""
        folder = f'/sys/class/net/{self.interface}/statistics'
        files = [f'{folder}/rx_packets', f'{folder}/tx_packets']
        text = _ip('netns', 'exec', self.namespace, 'cat', *files)
        received, sent = (int(line) for line in text.split())
        return received, sent


@contextmanager
def two_hosts() -> Iterator[tuple[Host, Host]]:
    """Make the hosts and remove them; skips where that is not possible."""
    if shutil.which('ip') is None or os.geteuid() != 0:
        pytest.skip('network namespaces want root and iproute2')
    mark = uuid.uuid4().hex[:8]
    robot = Host(f'robot-{mark}', 'cable0', '10.77.0.1')
    desk = Host(f'desk-{mark}', 'cable1', '10.77.0.2')
    hosts = robot, desk
    try:
        try:
            for host in hosts:
                _ip('netns', 'add', host.namespace)
            _join(*hosts)
        except subprocess.CalledProcessError as error:
            pytest.skip(f'no network namespaces here: {error.stderr}')
        yield hosts
    finally:
        for host in hosts:
            if Path('/run/netns', host.namespace).exists():
                _ip('netns', 'del', host.namespace)


def _join(one: Host, other: Host) -> None:
    ends = ['type', 'veth', 'peer', 'name', other.interface, 'netns', other.namespace]
    _ip('-n', one.namespace, 'link', 'add', one.interface, *ends)
    for host in (one, other):
        _ip('-n', host.namespace, 'link', 'set', 'lo', 'up')
        _ip('-n', host.namespace, 'addr', 'add', f'{host.address}/24', 'dev', host.interface)
        host.set_link('up')


def _ip(*arguments: str) -> str:
    done = subprocess.run(['ip', *arguments], capture_output=True, text=True, check=True)
    return done.stdout

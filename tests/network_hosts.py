# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Two hosts with a cable between them, as network namespaces of this machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
import ipaddress
import os
from pathlib import Path
import shutil
import subprocess
import time
import uuid

from network_link import Link
from processes import RunningProcess
import pytest

# each host has its own shared memory, as machines have: programs with ROS alone use it
_OWN_MEMORY = 'mount -t tmpfs tmpfs /dev/shm && exec "$@"'
_LINK_TIME = 10.0  # [s]
_MARK = 8  # characters that make the names of a test its own


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
        return RunningProcess(self.command(arguments), env)

    def command(self, arguments: Sequence[str]) -> list[str]:
        """Return the command that runs a program on this host."""
        inside = ['sh', '-c', _OWN_MEMORY, 'sh', *arguments]
        return ['ip', 'netns', 'exec', self.namespace, *inside]

    def set_link(self, state: str) -> None:
        """Set its end of the cable ``up`` or ``down``."""
        _ip('-n', self.namespace, 'link', 'set', self.interface, state)

    def wait_for_link(self, state: str) -> None:
        """Wait until its end of the cable is ``UP`` or ``DOWN``: the kernel takes up to a second.

        Raises:
            RuntimeError: It does not become so.
        """
        deadline = time.monotonic() + _LINK_TIME
        show = '-n', self.namespace, '-br', 'link', 'show', self.interface
        while ('DOWN' in _ip(*show).split()[1]) != (state == 'DOWN'):
            if time.monotonic() > deadline:
                raise RuntimeError(f'{self.interface} is not {state}')
            time.sleep(0.02)

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
    with _two_namespaces() as (robot, desk):
        ends = ['type', 'veth', 'peer', 'name', desk.interface, 'netns', desk.namespace]
        with _possible():
            _ip('-n', robot.namespace, 'link', 'add', robot.interface, *ends)
            _configure(robot, desk)
        for host in (robot, desk):  # Fast DDS leaves out what is not up
            host.wait_for_link('UP')
        yield robot, desk


@contextmanager
def two_linked_hosts() -> Iterator[tuple[Host, Host, Link]]:
    """Make the hosts with a link that has faults on request; skips where that is not possible."""
    with _two_namespaces() as (robot, desk), ExitStack() as stack:
        with _possible():
            link = stack.enter_context(Link(robot.namespace[-_MARK:]))
            for host, name in zip((robot, desk), link.names, strict=True):
                _ip('link', 'set', name, 'netns', host.namespace, 'name', host.interface)
            _configure(robot, desk)
        yield robot, desk, link


@contextmanager
def _two_namespaces() -> Iterator[tuple[Host, Host]]:
    if shutil.which('ip') is None or os.geteuid() != 0:
        pytest.skip('network namespaces want root and iproute2')
    mark = uuid.uuid4().hex[:_MARK]
    robot = Host(f'robot-{mark}', 'cable0', '10.77.0.1')
    desk = Host(f'desk-{mark}', 'cable1', '10.77.0.2')
    hosts = robot, desk
    try:
        with _possible():
            for host in hosts:
                _ip('netns', 'add', host.namespace)
        yield hosts
    finally:
        for host in hosts:
            if Path('/run/netns', host.namespace).exists():
                _ip('netns', 'del', host.namespace)


@contextmanager
def _possible() -> Iterator[None]:
    """Skip the test where this machine does not allow what is done."""
    try:
        yield
    except subprocess.CalledProcessError as error:
        pytest.skip(f'no network namespaces here: {error.stderr}')
    except OSError as error:
        pytest.skip(f'no tap devices here: {error}')


def _configure(*hosts: Host) -> None:
    for host in hosts:
        _ip('-n', host.namespace, 'link', 'set', 'lo', 'up')
        _ip('-n', host.namespace, 'addr', 'add', f'{host.address}/24', 'dev', host.interface)
        host.set_link('up')


def _ip(*arguments: str) -> str:
    done = subprocess.run(['ip', *arguments], capture_output=True, text=True, check=True)
    return done.stdout

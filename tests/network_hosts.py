# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Two hosts with a cable between them, as network namespaces of this machine.

The cable may be a link with the faults of a radio: two tap devices, and a thread that carries
Ethernet frames from one to the other. It does what ``tc netem`` does, for kernels without it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
import fcntl
import heapq
import ipaddress
import os
from pathlib import Path
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from typing import TYPE_CHECKING
import uuid

from processes import RunningProcess
import pytest

if TYPE_CHECKING:
    from typing_extensions import Self


_DEVICE = '/dev/net/tun'
_TUNSETIFF = 0x400454CA  # linux/if_tun.h
_IFF_TAP, _IFF_NO_PI = 0x0002, 0x1000
_FRAME_SIZE = 65536  # [byte] longest frame, segmentation left to the kernel
_ARP = b'\x08\x06'  # EtherType; a link without multicast still resolves addresses
_SEED = 1


@dataclass(frozen=True, slots=True)
class Condition:
    """What a link does to frames."""

    delay: float = 0.0  # of each frame, one way, in [s]
    # greatest further delay, evenly distributed, in [s]; frames keep their order
    jitter: float = 0.0
    loss: float = 0.0  # share of the frames that are lost
    multicast: bool = True  # whether multicast gets through
    cut: bool = False  # whether nothing does


class Link:
    """The link; it carries frames within a ``with`` statement."""

    def __init__(self, mark: str) -> None:
        """Make the devices.

        Args:
            mark: Makes their names unique on this machine, up to 10 characters.

        Raises:
            OSError: This machine does not allow it.
        """
        # what it does to frames from now on; may be replaced at any time
        self.condition = Condition()
        # names of its two devices, to be moved to the hosts
        self.names = (f'tap-{mark}a', f'tap-{mark}b')
        self._random = random.Random(_SEED)  # no secrets
        with ExitStack() as stack:
            self._ends = tuple(_open_tap(stack, name) for name in self.names)
            self._wake, self._stop = os.pipe()
            stack.callback(os.close, self._wake)
            self._stack = stack.pop_all()
        self._thread = threading.Thread(target=self._carry, name='link')

    def _carry(self) -> None:
        """Take frames at either end, and give them to the other one when they are due."""
        other = dict(zip(self._ends, reversed(self._ends), strict=True))
        waiting: list[tuple[float, int, int, bytes]] = []  # [s], order, end, frame
        last = dict.fromkeys(self._ends, 0.0)  # [s] when the last frame of an end is due
        count = 0
        while True:
            timeout = max(0.0, waiting[0][0] - time.monotonic()) if waiting else None
            ready, _, _ = select.select([*self._ends, self._wake], [], [], timeout)
            if self._wake in ready:
                return
            now = time.monotonic()
            for end in ready:
                frame, condition = os.read(end, _FRAME_SIZE), self.condition
                if self._is_lost(frame, condition):
                    continue
                due = now + condition.delay + condition.jitter * self._random.random()
                last[end] = due = max(due, last[end])
                count += 1
                heapq.heappush(waiting, (due, count, other[end], frame))
            while waiting and waiting[0][0] <= now:
                _, _, end, frame = heapq.heappop(waiting)
                if not self.condition.cut:
                    _write(end, frame)

    def _is_lost(self, frame: bytes, condition: Condition) -> bool:
        if condition.cut or self._random.random() < condition.loss:
            return True
        return not condition.multicast and bool(frame[0] & 1) and frame[12:14] != _ARP

    def __enter__(self) -> Self:
        """Begin to carry frames."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End, and remove the devices."""
        os.close(self._stop)
        self._thread.join()
        self._stack.close()


def _open_tap(stack: ExitStack, name: str) -> int:
    end = os.open(_DEVICE, os.O_RDWR | os.O_NONBLOCK)
    stack.callback(os.close, end)
    request = struct.pack('16sH22x', name.encode(), _IFF_TAP | _IFF_NO_PI)
    fcntl.ioctl(end, _TUNSETIFF, request)
    return end


def _write(end: int, frame: bytes) -> None:
    try:
        os.write(end, frame)
    except OSError:  # the device is down: the frame is lost, as on a cable
        return


# each host has its own shared memory, as machines have: programs with ROS alone use it
_OWN_MEMORY = 'mount -t tmpfs tmpfs /dev/shm && exec "$@"'
_LINK_TIME = 10.0  # [s]
_MARK = 8  # characters that make the names of a test its own


@dataclass(frozen=True, slots=True)
class Host:
    """One of the two."""

    namespace: str  # its network namespace
    interface: str  # its end of the cable
    address: str  # its IPv4 address there

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

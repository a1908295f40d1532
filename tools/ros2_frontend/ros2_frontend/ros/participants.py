# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The DDS participants of a domain on this host, as the kernel knows them.

Every participant listens for discovery traffic on one UDP port whose number follows from the
domain (DDSI-RTPS 2.2, 9.6.1.1). Counting these ports shows whether discovery is complete, which
DDS itself cannot count.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

# DDSI-RTPS 2.2, 9.6.1.4: PB, DG, PG and d1
_PORT_BASE = 7400
_DOMAIN_GAIN = 250
_PARTICIPANT_GAIN = 2
_METATRAFFIC_UNICAST_OFFSET = 10

_SOCKET_TABLE = Path('/proc/net/udp')
_OWN_DESCRIPTORS = Path('/proc/self/fd')


@dataclass(frozen=True, slots=True)
class DiscoveryPorts:
    """The discovery ports of one domain that are bound on this host, one per participant.

    Attributes:
        own: Those of this process.
        others: Those of other processes.
    """

    own: frozenset[int] = frozenset()
    others: frozenset[int] = frozenset()

    @property
    def count(self) -> int:
        """How many participants there are; 0 where the kernel does not list them (no procfs)."""
        return len(self.own) + len(self.others)


def read_ports(domain_id: int) -> DiscoveryPorts:
    """Look the discovery ports up.

    Args:
        domain_id: The ROS domain.

    Returns:
        The ports; none where there is no procfs.
    """
    try:
        with _SOCKET_TABLE.open(encoding='ascii') as table:
            return parse_ports(table, domain_id, _own_sockets())
    except OSError:
        return DiscoveryPorts()


def parse_ports(
    table: Iterable[str], domain_id: int, own_sockets: frozenset[str]
) -> DiscoveryPorts:
    """Find the discovery ports in the kernel's table of UDP sockets.

    Args:
        table: The lines of `/proc/net/udp` (proc(5)), with its head line.
        domain_id: The ROS domain.
        own_sockets: The inodes of this process's sockets.

    Returns:
        The ports.
    """
    start = _PORT_BASE + _DOMAIN_GAIN * domain_id
    wanted = range(start + _METATRAFFIC_UNICAST_OFFSET, start + _DOMAIN_GAIN, _PARTICIPANT_GAIN)
    lines = iter(table)
    next(lines, None)
    inodes = {}
    for line in lines:
        _, address, *rest = line.split()
        port = int(address.rpartition(':')[2], 16)
        if port in wanted:
            inodes[port] = rest[7]  # the tenth column
    own = frozenset(port for port, inode in inodes.items() if inode in own_sockets)
    return DiscoveryPorts(own, frozenset(inodes) - own)


def _own_sockets() -> frozenset[str]:
    found = set()
    for entry in _OWN_DESCRIPTORS.iterdir():
        try:
            target = str(entry.readlink())
        except OSError:  # closed since, or the descriptor of this very listing
            continue
        if target.startswith('socket:['):
            found.add(target[len('socket:[') : -1])
    return frozenset(found)

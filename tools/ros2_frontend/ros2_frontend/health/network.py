# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Network interfaces, as far as DDS needs them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
import socket

from .findings import error, Finding, Report, warning


@dataclass(frozen=True, slots=True)
class Interface:
    """A network interface.

    Attributes:
        flags: What it can do, e.g. `up`, `loopback`, `multicast`.
        inet: Its IPv4 addresses.
        mtu: Largest packet [byte].
    """

    flags: frozenset[str]
    inet: tuple[str, ...]
    mtu: int


def read_interfaces() -> Mapping[str, Interface]:
    """The network interfaces of this host by name."""
    import psutil

    statistics, addresses = psutil.net_if_stats(), psutil.net_if_addrs()
    return {
        name: Interface(
            frozenset(found.flags.split(',')),
            tuple(a.address for a in addresses.get(name, ()) if a.family == socket.AF_INET),
            found.mtu,
        )
        for name, found in statistics.items()
    }


def check_network(interfaces: Mapping[str, Interface]) -> Iterator[Finding]:
    """Check that DDS can reach this host and others.

    Args:
        interfaces: The interfaces by name.

    Yields:
        What is wrong.
    """
    flags = [interface.flags for interface in interfaces.values() if interface.inet]
    if not any('loopback' in entry for entry in flags):
        yield error('No loopback IP address is found.')
    if all('loopback' in entry for entry in flags):
        yield warning('Only loopback IP address is found.')
    if not any('multicast' in entry for entry in flags):
        yield warning('No multicast IP address is found.')


def report_network(interfaces: Mapping[str, Interface]) -> Report:
    """The interfaces.

    Args:
        interfaces: The interfaces by name.

    Returns:
        Name, addresses, flags and largest packet of each.
    """
    rows: list[tuple[str, object]] = []
    for name, interface in interfaces.items():
        rows.append(('device', name))
        rows.extend(('inet', address) for address in interface.inet)
        rows.append(('flags', ','.join(sorted(interface.flags)).upper()))
        rows.append(('mtu', interface.mtu))
    return Report('NETWORK CONFIGURATION', tuple(rows))

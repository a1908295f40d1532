# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which hosts are this computer itself, and which it can serve at."""

from __future__ import annotations

import ipaddress
import socket

LOOPBACK_NAMES = frozenset({'localhost', 'ip6-localhost', 'ip6-loopback'})
ELSEWHERE = {socket.AF_INET: '192.0.2.1', socket.AF_INET6: '2001:db8::1'}
"""Addresses for documentation, which are no host: by them the way out is found."""


def is_loopback(host: str) -> bool:
    """Whether a host is reached from this computer only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host in LOOPBACK_NAMES


def binding_problem(host: str) -> str:
    """Return why nothing can be served at a host; empty where it can be."""
    try:
        family, kind, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as server:
            server.bind(address)
    except OSError as error:
        return error.strerror or str(error)
    except UnicodeError:
        return 'no name of a host'
    return ''


def shown_host(host: str) -> str:
    """Return the host of a URL by which a browser reaches a server.

    Args:
        host: What the server is bound to; for all addresses of this computer, the URL has the one
            by which others reach it.
    """
    if host in {'localhost', '127.0.0.1'}:
        return 'localhost'
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if address.is_unspecified:
        address = ipaddress.ip_address(_outward(address.version))
    return f'[{address}]' if address.version == 6 else str(address)


def _outward(version: int) -> str:
    family = socket.AF_INET if version == 4 else socket.AF_INET6
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((ELSEWHERE[family], 9))  # of a datagram: nothing is sent
        except OSError:  # there is no network
            return '127.0.0.1' if version == 4 else '::1'
        return str(probe.getsockname()[0])

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which hosts are this computer itself, and which it can serve at."""

from __future__ import annotations

import ipaddress
import socket

LOOPBACK_NAMES = frozenset({'localhost', '127.0.0.1', '::1'})


def is_loopback(host: str) -> bool:
    """Whether a host is reached from this computer only.

    Args:
        host: A name or an address, as a server is to be bound to.
    """
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host in LOOPBACK_NAMES


def binding_problem(host: str) -> str:
    """Return why nothing can be served at a host; empty where it can be.

    Args:
        host: A name or an address, as a server is to be bound to.
    """
    try:
        family, kind, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as server:
            server.bind(address)
    except OSError as error:
        return error.strerror or str(error)
    except UnicodeError:
        return 'no name of a host'
    return ''

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which hosts are this computer itself."""

from __future__ import annotations

import ipaddress

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

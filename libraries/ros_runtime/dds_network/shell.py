# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Prints the variables of this package as shell commands, which env.sh evaluates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import os
from shlex import quote
import sys

from .environment import (
    dds_variables,
    LOCALHOST_ONLY_VARIABLE,
    NETWORK_VARIABLE,
    PEERS_VARIABLE,
    PROFILE_VARIABLE,
    RANGE_VARIABLE,
    selected_reach,
    SERVER_VARIABLE,
    TRANSPORTS_VARIABLE,
)
from .reach import NetworkChoiceError, Reach

_SUBNET = 'SUBNET'
_UDP = 'UDPv4'


def notices(environ: Mapping[str, str], reach: Reach) -> Iterator[str]:
    """Report what is open, and which settings of the user have no effect."""
    if reach.own_transports:
        yield reach.describe()
        return
    transports = environ.get(TRANSPORTS_VARIABLE) or _UDP
    if transports != _UDP:
        yield (
            f'{TRANSPORTS_VARIABLE}={transports} has no effect, DDS uses {_UDP} alone; for '
            f'others, name a profile of your own in {PROFILE_VARIABLE}'
        )
    if reach.without_link or not reach.is_this_host:
        yield reach.describe()
        return
    without_effect = [
        f'{name}={environ[name]}'
        for name, effective in (
            (PEERS_VARIABLE, bool(environ.get(PEERS_VARIABLE))),
            (SERVER_VARIABLE, _is_elsewhere(environ.get(SERVER_VARIABLE, ''))),
            (RANGE_VARIABLE, environ.get(RANGE_VARIABLE, '').upper() == _SUBNET),
        )
        if effective and environ.get(LOCALHOST_ONLY_VARIABLE) != '1'
    ]
    if without_effect:
        yield (
            f'{" and ".join(without_effect)} has no effect, DDS stays on this host; to open it: '
            f'export {NETWORK_VARIABLE}=INTERFACE or a peer, and source env.sh again'
        )


def _is_elsewhere(servers: str) -> bool:
    """Whether a list of discovery servers (ADDRESS[:PORT]) has one beyond loopback."""
    addresses = (each.strip() for each in servers.split(';'))
    return any(each and not each.startswith(('127.', 'localhost')) for each in addresses)


def main(environ: Mapping[str, str] = os.environ) -> int:
    """Print the commands.

    Returns:
        0, or 1 when the choice is wrong; the commands then keep DDS on this host.
    """
    status = 0
    try:
        reach = selected_reach(environ)
        lines = list(notices(environ, reach))
    except NetworkChoiceError as error:
        reach, lines, status = Reach(), [f'{NETWORK_VARIABLE}: {error}'], 1
    for line in lines:
        sys.stderr.write(f'env.sh: {line}\n')
    for name, value in dds_variables(environ, reach).items():
        sys.stdout.write(f'export {name}={quote(value)}\n')
    return status


if __name__ == '__main__':
    sys.exit(main())

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments that bring-ups and demos have in common."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import math
import os
import sys

from dds_network import NETWORK_VARIABLE, NetworkChoiceError, open_dds

from .exceptions import StartError


def seconds_from(least: float, *, finite: bool = True) -> Callable[[str], float]:
    """Return a type of argparse: a time that is long enough.

    Args:
        least: The shortest in [s]; 0 means anything above.
        finite: Refuse ``inf``, which waits without limit.
    """

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (value > 0 and value >= least) or (finite and math.isinf(value)):
            bound = f'of at least {least:g}' if least else 'above 0'
            raise argparse.ArgumentTypeError(f'{text} is no number of seconds {bound}')
        return value

    return read


def add_timeout(parser: argparse.ArgumentParser) -> None:
    """Declare ``--timeout``."""
    parser.add_argument(
        '--timeout',
        metavar='S',
        type=seconds_from(0.0, finite=False),
        default=30.0,
        help='longest time until all is ready in [s]; inf for no limit (default: %(default)s)',
    )


def add_network(parser: argparse.ArgumentParser) -> None:
    """Declare ``--network``."""
    parser.add_argument(
        '--network',
        metavar='NAMES',
        help='open DDS to other machines: network interfaces, or addresses of peers, separated by '
        'commas; without authentication: any client there can command the robot (default: '
        f'the variable {NETWORK_VARIABLE}, else this host only)',
    )


def apply_network(arguments: argparse.Namespace) -> None:
    """Keep DDS of this process and those that it starts to what a person opened; print it.

    Raises:
        StartError: There is no such interface or peer.
    """
    try:
        sys.stdout.write(f'{open_dds(os.environ, arguments.network)}\n')
    except NetworkChoiceError as error:
        raise StartError(f'--network: {error}') from error

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arguments that bring-ups and demos have in common."""

from __future__ import annotations

import argparse
from collections.abc import Callable
import math


def seconds_from(least: float, *, finite: bool = True) -> Callable[[str], float]:
    """Return a type of argparse: a time that is long enough.

    Args:
        least: The shortest in [s]; 0 means anything above.
        finite: Refuse ``inf``, which waits for ever.
    """

    def read(text: str) -> float:
        value = float(text)
        if not (value > 0 and value >= least) or (finite and math.isinf(value)):
            bound = f'of at least {least:g}' if least else 'above 0'
            raise argparse.ArgumentTypeError(f'{text} is no number of seconds {bound}')
        return value

    return read


def add_timeout(parser: argparse.ArgumentParser) -> None:
    """Declare ``--timeout``.

    Args:
        parser: Where to.
    """
    parser.add_argument(
        '--timeout',
        metavar='S',
        type=seconds_from(0.0, finite=False),
        default=30.0,
        help='longest time until all is ready in [s]; inf waits for ever (default: %(default)s)',
    )

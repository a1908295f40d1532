# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Adapters that keep bytes back: FTDI's send what is no full packet when a timer has run out.

The timer is 16 ms as delivered, so a report of the robot comes that much late, and a question of
protocol v1 is answered that much later.
"""

from __future__ import annotations

import os
from pathlib import Path

SYSFS = Path('/sys/class/tty')
MAX_LATENCY = 0.004  # [s] a report every 20 ms does not suffer from


def latency_timer(path: str, sysfs: Path = SYSFS) -> float | None:
    """Return the latency timer of an adapter [s]; None where the port has none.

    Args:
        path: Device file, or a link to one.
    """
    name = Path(os.path.realpath(path)).name
    try:
        return int((sysfs / name / 'device' / 'latency_timer').read_text(encoding='ascii')) / 1e3
    except (OSError, ValueError):
        return None


def latency_problem(path: str, latency: float | None) -> str:
    """Say that an adapter keeps bytes back for too long, and the remedy; nothing where not.

    Args:
        path: Device file, or a link to one.
        latency: Its latency timer [s].
    """
    if latency is None or latency <= MAX_LATENCY:
        return ''
    name = Path(os.path.realpath(path)).name
    return (
        f'the adapter keeps bytes back for {latency * 1e3:.0f} ms (latency_timer): '
        f'echo 1 | sudo tee {SYSFS}/{name}/device/latency_timer'
    )

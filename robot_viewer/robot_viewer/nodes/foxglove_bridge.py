# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run robot_viewer foxglove_bridge``: topics and services for Foxglove."""

from __future__ import annotations

import os
import threading

from node_runner import run_program

from .foxglove import BridgeError
from .serving import serve

NAME = 'foxglove_bridge'
NICENESS = 10
"""No viewer takes time that a control loop needs."""
MISSING = (
    'foxglove-sdk (MIT, 55 MB) is not installed; install it with '
    '`(cd tools && python3 -m workspace build --with foxglove robot_viewer)`, '
    'or `pip install foxglove-sdk`'
)


def main() -> int:
    """Run until Ctrl-C.

    Returns:
        0, or 1 when it could not begin.
    """
    return run_program(NAME, _serve, BridgeError)


def _serve(stop: threading.Event) -> None:
    try:
        from .foxglove.node import FoxgloveBridge
    except ModuleNotFoundError as error:
        if error.name != 'foxglove':
            raise
        raise BridgeError(MISSING) from None
    os.setpriority(os.PRIO_PROCESS, 0, max(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))
    node = FoxgloveBridge(NAME)
    serve(node, node.seen_at, node.close, stop)

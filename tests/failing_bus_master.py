# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The master's program beside a node with a defect, on a bus that goes down at SIGUSR1."""

from __future__ import annotations

import signal
import sys
import threading
from typing import TYPE_CHECKING

from rclpy.node import Node

from arm_canopen import BusError, run_master
from canopen_core.can.socket_bus import SocketBus

if TYPE_CHECKING:
    from canopen_core.can import Frame

DOWN = 'the bus went down'
DEFECT = 'a defect beside the master'


def main() -> int:
    """Run the master."""
    down = threading.Event()
    signal.signal(signal.SIGUSR1, lambda *_: down.set())
    receive = SocketBus.receive

    def failing(bus: SocketBus, timeout: float) -> list[Frame]:
        if down.is_set():
            raise BusError(DOWN)
        return receive(bus, timeout)

    SocketBus.receive = failing  # type: ignore[assignment]
    return run_master(extend=lambda _: [_failing_node()])


def _failing_node() -> Node:
    node = Node('beside')

    def fail() -> None:
        raise RuntimeError(DEFECT)

    node.create_timer(0.1, fail)
    return node


if __name__ == '__main__':
    sys.exit(main())

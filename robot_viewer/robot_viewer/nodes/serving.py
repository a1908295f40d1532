# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the programs that show a robot do once their node is made."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import sys
import threading
import traceback

from rclpy.node import Node

from node_runner import log_as, notify_ready, spin


class Border:
    """Where errors of what comes from ROS end: said once in a sentence, and all else goes on."""

    def __init__(self, node: Node, say: Callable[[str], None] = lambda _: None) -> None:
        self._node, self._say = node, say
        self._said: set[str] = set()

    @contextmanager
    def around(self, what: str) -> Iterator[None]:
        """Report what the block raises, and go on behind it."""
        try:
            yield
        except Exception as error:  # noqa: BLE001  # whatever comes from ROS
            self.report(what, error)

    def report(self, what: str, error: Exception) -> None:
        """Log an error once."""
        text = f'{what}: {_reason(error)}'
        if text in self._said:
            return
        self._said.add(text)
        self._node.get_logger().error(text)
        self._node.get_logger().debug(''.join(traceback.format_exception(error)))
        self._say(text)


def _reason(error: Exception) -> str:
    if isinstance(error, ModuleNotFoundError):
        package = (error.name or str(error)).partition('.')[0]
        return f'{package} is not installed here: run `make build`, or install it'
    return str(error) if isinstance(error, ValueError) else f'{type(error).__name__}: {error}'


def serve(
    node: Node,
    seen_at: str,
    close: Callable[[], None],
    stop: threading.Event,
    border: Border | None = None,
) -> None:
    """Serve a viewer until it is to end, and let its viewers go."""
    border = border or Border(node)
    log_as(node)
    sys.stdout.write(f'{seen_at}\n')  # not into /rosout and bags: it may have a token
    sys.stdout.flush()
    notify_ready(seen_at)
    try:
        spin([node], stop, survive=lambda error: border.report('a message or answer', error))
    finally:
        close()
        node.destroy_node()

# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A program for the tests: a node that says what happens, and takes its time to end."""

from __future__ import annotations

import sys
import threading

from rclpy.node import Node

from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt, run_program, spin


class Careful(Node):
    """Has one parameter of each kind."""

    @destroyed_when_refused
    def __init__(self) -> None:
        super().__init__('careful')
        read = ParameterReader(self)
        self.rate = read.number('rate', 10.0, (1.0, 100.0), 'rate [Hz]')
        self.code = read.whole('code', 0, (0, 100), 'exit code')
        read.text('frame', 'base', 'frame')
        read.choice('gait', 'trot', {'trot': 1, 'crawl': 2}, 'gait')
        refuse_misspelt(self)


def say(word: str) -> None:
    """Report to the test."""
    sys.stdout.write(f'{word}\n')
    sys.stdout.flush()


def body(stop: threading.Event) -> int:
    """Spin, then wait for a line of the test before the end."""
    node = Careful()
    say('ready')
    spin([node], stop)
    say('stopping')
    sys.stdin.readline()
    node.destroy_node()
    say('ended')
    return node.code


if __name__ == '__main__':
    sys.exit(run_program('careful', body, OSError, patient='--patient' in sys.argv))

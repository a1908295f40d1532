# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_sim fake_xgo``: a simulated XGO on a pseudo-terminal."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
import signal
import sys
from types import FrameType

from process_supervisor import ServiceManager, split_ros_arguments

from .exceptions import SimulationError
from .options import build, parse_arguments
from .server import PseudoTerminal, Server


def run(argv: Sequence[str] | None = None) -> int:
    """Simulate until Ctrl-C or SIGTERM; return the exit code."""
    own, ros = split_ros_arguments(sys.argv[1:] if argv is None else argv)
    options = parse_arguments(own)
    try:
        simulation = build(options)
        with PseudoTerminal(options.link) as terminal:
            server = Server(simulation.plant, simulation.line, terminal)
            report_ready = partial(_report_ready, _describe(options, terminal), ServiceManager())
            with _stopped_by_signals(server):
                if options.no_ros or find_spec('rclpy') is None:
                    report_ready()
                    server.run()
                else:
                    from .fake_xgo_node import serve_with_ros

                    serve_with_ros(server, simulation, ['--ros-args', *ros], report_ready)
            server.close()
    except SimulationError as error:
        sys.stderr.write(f'fake_xgo: {error}\n')
        return 2 if isinstance(error, ValueError) else 1
    return 0


def main() -> None:
    """Entry point."""
    sys.exit(run())


@contextmanager
def _stopped_by_signals(server: Server) -> Iterator[None]:
    """Stop the server on SIGINT and SIGTERM."""

    def stop(_number: int, _frame: FrameType | None) -> None:
        server.stop()

    previous = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _report_ready(description: str, manager: ServiceManager) -> None:
    """Print the configuration, and notify the supervisor of this process."""
    sys.stdout.write(f'fake_xgo: {description}\n')
    sys.stdout.flush()
    manager.report('READY=1')


def _describe(options: argparse.Namespace, terminal: PseudoTerminal) -> str:
    robot = f'{options.preset}{" with arm" if options.arm else ""}'
    physics = 'in the air' if options.physics == 'none' else f'servos {options.servo}'
    place = f'{terminal.link} -> {terminal.device}'
    return f'{robot} ({physics}) at {place}, protocol {options.protocol}'


if __name__ == '__main__':
    main()

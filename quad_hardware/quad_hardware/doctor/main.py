# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Doctor of the quadruped: finds what is wrong with port, robot, machine and ROS."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
import os
from pathlib import Path

from quad_description import run_command

from ..link import DEFAULT_PORT
from .finding import error, Finding, note, Severity
from .machine_checks import check_environment, check_library, check_memory, check_port


def run_doctor(argv: Sequence[str]) -> int:
    """Print all findings; return 1 when one of them is an error, else 0."""
    options = _parser().parse_args(argv)
    worst = Severity.GOOD
    order = list(Severity)
    for finding in _findings(options.port, options.duration):
        print(finding, flush=True)  # noqa: T201  # what the program is for
        worst = max(worst, finding.severity, key=order.index)
    return 1 if worst is Severity.ERROR else 0


def main() -> None:
    """Entry point."""
    run_command(run_doctor)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument('--port', default=DEFAULT_PORT, help='of the robot (%(default)s)')
    parser.add_argument(
        '--duration', type=float, default=3.0, help='of listening to topics [s] (%(default)s)'
    )
    return parser


def _findings(port: str, duration: float) -> Iterator[Finding]:
    has_ros = find_spec('rclpy') is not None
    if has_ros:
        yield from check_environment(os.environ)
    else:
        remedy = 'source env.sh first, if nodes are to be checked, too'
        yield note('ROS', 'not there for this Python: robot and machine are checked alone', remedy)
    meminfo = Path('/proc/meminfo')
    if meminfo.exists():
        yield from check_memory(meminfo.read_text(encoding='ascii'))
    yield check_library()
    yield from check_port(port)
    if not has_ros:
        return
    try:
        from .graph import check_graph, observe
    except ImportError as problem:
        yield error('ROS', str(problem), 'source the workspace first: source env.sh')
        return
    yield from check_graph(observe(duration), port)


if __name__ == '__main__':
    main()

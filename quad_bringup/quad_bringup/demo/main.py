# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_bringup demo``: a simulated quadruped stands up, walks and lies down."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
import math
import os
import re
import sys
import threading

from rich.console import Console

from process_supervisor import (
    explain,
    LineWriter,
    Outcome,
    Painter,
    ProcessSpec,
    Runner,
    SupervisorError,
    USAGE_ERROR,
    wants_colour,
)
from process_supervisor.display import choose_display, Setting, TableDisplay
from quad_description import LEGS

from ..exceptions import BringupError
from ..session import add_arguments, Session, session
from .figures import Figures
from .itinerary import SHORTEST
from .play import Client, Play
from .view import QuadView

GROUND_TRUTH = '/fake_xgo/ground_truth'
"""Topic on which the simulated robot says where its body is."""


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Parse the command line.

    Args:
        argv: Arguments without the program's name; None takes those of the process.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run quad_bringup demo',
        description='Bring a simulated quadruped up, let it stand up, walk, turn, strafe, stop '
        'and lie down. In a terminal a live table shows what it does; elsewhere a line every few '
        'seconds. Ctrl-C lets it lie down and ends everything.',
    )
    add_arguments(parser)
    parser.add_argument(
        '--duration',
        metavar='S',
        type=_duration,
        help=f'walk for so many seconds, at least {SHORTEST:g}, and end with a summary; the exit '
        'code says whether it moved as it was told (default: until Ctrl-C)',
    )
    return parser.parse_args(argv)


def _duration(text: str) -> float:
    value = float(text)
    if not SHORTEST <= value < math.inf:
        raise argparse.ArgumentTypeError(
            f'{text} is no number of seconds from {SHORTEST:g} on: the robot would not get going'
        )
    return value


def join_ros(joints: Sequence[str], given_up: Callable[[], bool]) -> Client:
    """Make the ROS client of the demo; rclpy loads while the processes start.

    Args:
        joints: Names of the joints, in the order of /joint_command.
        given_up: True when nothing shall be waited for any more.
    """
    from .client import QuadClient

    return QuadClient(joints, GROUND_TRUTH, given_up)


def commands(domain: str, port: str) -> list[str]:
    """Return commands to try in a second terminal.

    Args:
        domain: ROS domain, empty for the default one.
        port: Serial port of the robot.
    """
    return [
        f'source env.sh; export ROS_DOMAIN_ID={domain}' if domain else 'source env.sh',
        'ros2 topic hz /joint_command',
        'ros2 topic echo /odom',
        f'ros2 run quad_hardware doctor --port {port}',
    ]


def without_readiness(
    processes: Sequence[ProcessSpec], take: Callable[[str, str], None]
) -> Callable[[str, str], None]:
    """Leave out the lines by which processes say that they are ready: the supervisor says so.

    Args:
        processes: What runs.
        take: Takes all other lines, with the name of the process first.
    """
    ready = {spec.name: re.compile(spec.ready) for spec in processes if spec.ready}

    def line(name: str, text: str) -> None:
        if name not in ready or not ready[name].search(text):
            take(name, text)

    return line


def run(quad: Session, mode: str, duration: float | None) -> int:
    """Run the demo.

    Args:
        quad: The quadruped, prepared.
        mode: Mode in which it walks.
        duration: How long it walks in [s]; None until Ctrl-C.

    Returns:
        0, or 1 when something went wrong.
    """
    write = LineWriter(sys.stdout)
    names = [spec.name for spec in quad.processes]
    setting = Setting(
        QuadView(quad.title, LEGS),
        Figures(),
        commands(os.environ.get('ROS_DOMAIN_ID', ''), quad.port),
        Painter('demo', names, wants_colour(sys.stdout, os.environ)),
    )
    display = choose_display(setting, Console(), write)
    play = Play(display, mode, duration)
    try:
        with Runner(
            quad.processes,
            without_readiness(quad.processes, display.line),
            display.notice,
            on_interrupt=play.leave,
        ) as runner:
            make_client = partial(join_ros, quad.joints)
            thread = threading.Thread(target=play.run, args=[runner, make_client], name='play')
            thread.start()
            outcome = runner.run()
            thread.join()
    finally:
        display.close()
    with_summary = duration is not None or not isinstance(display, TableDisplay)
    return conclude(write, play, outcome, with_summary=with_summary)


def conclude(write: LineWriter, play: Play, outcome: Outcome, *, with_summary: bool) -> int:
    """Say how it went.

    Args:
        write: Takes the lines.
        play: The course, ended.
        outcome: How the supervisor ended.
        with_summary: Write the summary of the walk.

    Returns:
        The exit code.
    """
    for line in play.result.summary if with_summary else []:
        write(line)
    failures = [] if play.left else play.result.problems
    if outcome.exit_code:
        failures = [explain(outcome), *failures]
    for line in failures:
        write(f'error: {line}')
    return 1 if failures else 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo until its end or Ctrl-C.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 when all went well, 1 when something did not, 2 when nothing was started.
    """
    arguments = parse(argv)
    mode = 'walk' if arguments.policy is None else 'policy'
    try:
        with session(arguments, None) as quad:
            return run(quad, mode, arguments.duration)
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR

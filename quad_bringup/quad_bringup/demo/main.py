# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_bringup demo``: a simulated quadruped stands up, walks and lies down."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
import sys

from demo_runner import run_demo
from process_supervisor import parse_with_ros, RosOptions, SupervisorError, USAGE_ERROR
from process_supervisor.arguments import seconds_from
from quad_description import LEGS

from ..exceptions import BringupError
from ..session import add_arguments, Session, session
from .figures import Figures
from .scenario import Client, WalkScenario
from .segments import MIN_DURATION, share_of
from .view import QuadView

GROUND_TRUTH = 'fake_xgo/ground_truth'
"""Topic on which the simulated robot publishes where its body is."""


def parse(argv: Sequence[str]) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line.

    Args:
        argv: Arguments without the program's name.

    Returns:
        What was requested, and the options of all nodes.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run quad_bringup demo',
        description='Bring a simulated quadruped up, let it stand up, walk, turn, strafe, stop '
        'and lie down. In a terminal a live table shows what it does; elsewhere a line every few '
        'seconds. Ctrl-C lets it lie down and ends everything.',
        allow_abbrev=False,
    )
    add_arguments(parser)
    parser.add_argument(
        '--duration',
        metavar='S',
        type=seconds_from(MIN_DURATION),
        help=f'walk for so many seconds, at least {MIN_DURATION:g}, and end with a summary; the '
        'exit code is 0 when it moved as commanded (default: until Ctrl-C)',
    )
    return parse_with_ros(parser, argv)


def join_ros(joints: Sequence[str], namespace: str, given_up: Callable[[], bool]) -> Client:
    """Make the ROS client of the demo; rclpy loads while the processes start.

    Args:
        joints: Names of the joints, in the order of /joint_command.
        namespace: That of the robot.
        given_up: True when nothing shall be waited for any more.
    """
    from .client import QuadClient

    return QuadClient(joints, GROUND_TRUTH, given_up, namespace)


def commands(port: str, ros: RosOptions) -> list[str]:
    """Return commands to try in a second terminal.

    Args:
        port: Serial port of the robot.
        ros: Options of all nodes.
    """
    return [
        f'ros2 topic hz {ros.resolve("joint_command")}',
        f'ros2 topic echo {ros.resolve("odom")}',
        f'ros2 run quad_hardware doctor --port {port}{ros.hint}',
    ]


def run(quad: Session, ros: RosOptions, mode: str, duration: float | None, share: float) -> int:
    """Run the demo.

    Args:
        quad: The quadruped, prepared.
        ros: Options of all nodes.
        mode: Mode in which it walks.
        duration: How long it walks in [s]; None until Ctrl-C.
        share: Of the velocities of a trot.

    Returns:
        0, or 1 when something went wrong.
    """
    return run_demo(
        quad.processes,
        view=QuadView(quad.title, LEGS),
        figures=Figures(),
        commands=commands(quad.port, ros),
        make_scenario=lambda display: WalkScenario(display, mode, duration, share),
        make_client=partial(join_ros, quad.joints, ros.namespace),
        endless=duration is None,
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo until its end or Ctrl-C.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 when all went well, 1 when something did not, 2 when nothing was started.
    """
    arguments, ros = parse(sys.argv[1:] if argv is None else argv)
    geometric = arguments.policy is None
    mode, share = ('walk', share_of(arguments.gait)) if geometric else ('policy', 1.0)
    try:
        with session(arguments, ros, None) as quad:
            return run(quad, ros, mode, arguments.duration, share)
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR
